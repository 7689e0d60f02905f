"""The topic of trajectories, passed to the driver thread newest first."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from trajectory_msgs.msg import MultiDOFJointTrajectory

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.subscribing.sensor_topics import Newest
from drone_navigation.server.subscribing.trajectory_messages import placed_in_time, request_of
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.requests.trajectory_commands import TrajectoryCommands

__all__ = ["TOPIC", "TrajectoryTopic"]

TOPIC = "~/cmd_trajectory"
# A best-effort subscriber also hears reliable publishers; of several trajectories the last counts.
_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)


class TrajectoryTopic:
    """Subscribes to the trajectories for one vehicle."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe."""
        self._access = access
        self._newest: Newest[TrajectoryRequest] = Newest(access.driver.post, self._take)
        access.node.create_subscription(
            MultiDOFJointTrajectory,
            TOPIC,
            self._hear,
            _QOS,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def _hear(self, message: MultiDOFJointTrajectory) -> None:
        self._newest.put(placed_in_time(request_of(message), message, self._access))

    def _take(self, request: TrajectoryRequest) -> None:
        feature = self._access.bridge.feature(TrajectoryCommands)
        feature.replace(request, self._access.clock.now())
