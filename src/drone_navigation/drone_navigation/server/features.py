"""The ROS side of the features of a bridge: one line each."""

from __future__ import annotations

from collections.abc import Callable

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.logs.log_servers import LogServers
from drone_navigation.server.storage.list_servers import ListServers
from drone_navigation.server.storage.parameter_servers import ParameterServers
from drone_navigation.server.subscribing.correction_topic import CorrectionTopic
from drone_navigation.server.subscribing.external_odometry import ExternalOdometry
from drone_navigation.server.subscribing.sensor_topics import SensorTopics
from drone_navigation.server.subscribing.velocity_topic import VelocityTopic

__all__ = ["FEATURE_SERVERS"]

FEATURE_SERVERS: tuple[Callable[[BridgeAccess], object], ...] = (
    ListServers,
    ParameterServers,
    LogServers,
    CorrectionTopic,
    ExternalOdometry,
    SensorTopics,
    VelocityTopic,
)
