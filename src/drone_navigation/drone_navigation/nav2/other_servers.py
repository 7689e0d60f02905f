"""Detection of other nodes that serve Nav2's clients in the ROS domain.

An action has one server. With two, rcl gives a client's goal to both, and both execute it.
"""

from __future__ import annotations

import time
import uuid

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from drone_navigation.steady_timer import steady_timer

ACTION = "navigate_to_pose"
"""The action whose servers are counted."""

_PERIOD_S = 1.0
_SILENT_S = 2.5
_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)


class OtherServers:
    """Monitors the servers of the action, Nav2's own among them.

    Each of ours publishes its identifier, which begins with the time of its start, so that of
    two exactly one ends, whoever discovers the other first.
    """

    def __init__(self, node: Node) -> None:
        """Publish and listen."""
        self._node = node
        self._own_id = f"{time.time_ns():020d}-{uuid.uuid4().hex}"
        self._heard_s: dict[str, float] = {}
        self._publisher = node.create_publisher(String, "~/server_id", _QOS)
        node.create_subscription(String, "~/server_id", self._take, _QOS)
        steady_timer(node, _PERIOD_S, self._tell)

    def _tell(self) -> None:
        self._publisher.publish(String(data=self._own_id))

    def _take(self, message: String) -> None:
        if message.data != self._own_id:
            self._heard_s[message.data] = time.monotonic()

    @property
    def servers(self) -> int:
        """Number of servers of the action in the graph, including recently killed ones."""
        return int(self._node.count_services(f"{ACTION}/_action/send_goal"))

    @property
    def earlier(self) -> bool:
        """True if one of ours that started before this one serves, too."""
        since_s = time.monotonic() - _SILENT_S
        return self.servers > 1 and any(
            other < self._own_id and heard_s > since_s for other, heard_s in self._heard_s.items()
        )

    @property
    def foreign(self) -> bool:
        """True if a server is none of ours: Nav2's own."""
        return self.servers > int(self._node.count_publishers("~/server_id"))
