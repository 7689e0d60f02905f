"""The ROS side of the features of a bridge: one line each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from rclpy.node import Node

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.computer_status import ComputerStatusTimer
from drone_navigation.server.logs.log_servers import LogServers
from drone_navigation.server.payload.payload_servers import PayloadServers
from drone_navigation.server.storage.list_servers import ListServers
from drone_navigation.server.storage.parameter_servers import ParameterServers
from drone_navigation.server.subscribing.correction_topic import CorrectionTopic
from drone_navigation.server.subscribing.external_odometry import ExternalOdometry
from drone_navigation.server.subscribing.lease_topic import LeaseTopic
from drone_navigation.server.subscribing.origin_topic import OriginTopic
from drone_navigation.server.subscribing.sensor_topics import SensorTopics
from drone_navigation.server.subscribing.target_topic import TargetTopic
from drone_navigation.server.subscribing.trajectory_topic import TrajectoryTopic
from drone_navigation.server.subscribing.velocity_topic import VelocityTopic
from drone_navigation.server.surveys.survey_server import SurveyServer
from drone_navigation.server.traffic.remote_id_timer import RemoteIdTimer
from drone_navigation.server.traffic.traffic_topic import TrafficTopic
from mavlink_vehicle.io.clock import Clock
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.fleet import Member

__all__ = ["FEATURE_SERVERS", "SHARED_FEATURES", "SharedFeature"]

FEATURE_SERVERS: tuple[Callable[[BridgeAccess], object], ...] = (
    ListServers,
    ParameterServers,
    LogServers,
    PayloadServers,
    CorrectionTopic,
    ExternalOdometry,
    LeaseTopic,
    OriginTopic,
    SensorTopics,
    SurveyServer,
    TargetTopic,
    VelocityTopic,
    TrajectoryTopic,
    ComputerStatusTimer,
    RemoteIdTimer,
)


class SharedFeature(Protocol):
    """A feature that the vehicles of a server share."""

    def join(self, bridge: Bridge) -> None:
        """Take one more vehicle in, before it starts."""

    def serve(self, member: Member) -> None:
        """Offer its topics; ``member`` takes work for the driver's thread."""

    def close(self) -> None:
        """Process the end of the server."""


SHARED_FEATURES: tuple[Callable[[Node, ServerConfig, Clock], SharedFeature], ...] = (TrafficTopic,)
