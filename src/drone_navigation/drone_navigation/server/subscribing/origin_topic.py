"""The topic by which clients name themselves for their goals."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_msgs.msg import String

from drone_navigation.qos import STREAM_QOS
from drone_navigation.server.bridge_access import BridgeAccess
from navigation_bridge.requests.goal_origins import GoalOrigins

__all__ = ["OriginTopic"]


class OriginTopic:
    """Subscribes to ``~/goal_origin``: the goal's id as hexadecimal digits, a space, a name."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe."""
        self._bridge, self._driver = access.bridge, access.driver
        access.node.create_subscription(
            String,
            "~/goal_origin",
            self._hear,
            STREAM_QOS,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def _hear(self, message: String) -> None:
        goal_id, _, origin = message.data.partition(" ")
        self._driver.post(lambda: self._bridge.feature(GoalOrigins).name(goal_id, origin))
