"""The topic by which clients keep the leases of their goals."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from std_msgs.msg import String

from drone_navigation.qos import STREAM_QOS
from drone_navigation.server.bridge_access import BridgeAccess
from navigation_bridge.requests.goal_leases import GoalLeases

__all__ = ["LeaseTopic"]


class LeaseTopic:
    """Subscribes to ``~/goal_lease``: the goal's id as hexadecimal digits."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe."""
        self._bridge, self._driver, self._clock = access.bridge, access.driver, access.clock
        access.node.create_subscription(
            String,
            "~/goal_lease",
            self._hear,
            STREAM_QOS,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def _hear(self, message: String) -> None:
        goal_id = message.data
        self._driver.post(
            lambda: self._bridge.feature(GoalLeases).renew(goal_id, self._clock.now())
        )
