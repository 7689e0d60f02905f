"""Topics of the navigation server."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

LATCHED_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class Topics:
    """Publishers of the server."""

    def __init__(self, node: Node) -> None:
        """Advertise ``~/last_rejection`` (std_msgs/String, latched)."""
        self._last_rejection = node.create_publisher(String, "~/last_rejection", LATCHED_QOS)

    def publish_rejection(self, text: str) -> None:
        """Publish why the last goal was refused, as "CODE: sentence"."""
        self._last_rejection.publish(String(data=text))
