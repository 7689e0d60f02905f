"""A client that publishes what teleop_twist_keyboard of ROS 2 Jazzy publishes, key by key."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Twist, TwistStamped

from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight

__all__ = ["TOPIC", "Teleop"]

TOPIC = f"{SERVER_NODE_NAME}/cmd_vel"
# For each key linear x, y, z and angular z, each -1, 0 or 1; any other key stops. Both speeds are
# those that it begins with.
_KEYS = {
    "i": (1, 0, 0, 0), ",": (-1, 0, 0, 0), "j": (0, 0, 0, 1), "l": (0, 0, 0, -1),
    "u": (1, 0, 0, 1), "J": (0, 1, 0, 0), "L": (0, -1, 0, 0), "t": (0, 0, 1, 0),
    "b": (0, 0, -1, 0),
}  # fmt: skip
SPEED_M_S, TURN_RAD_S = 0.5, 1.0


class Teleop:
    """Reliable publisher of depth 10; the stamp is the present time, the frame is empty."""

    def __init__(self, flight: Flight, stamped: bool, frame_id: str = "") -> None:
        """Advertise the topic, and wait until the server hears it."""
        self._flight = flight
        self._stamped = stamped
        self._frame_id = frame_id
        kind = TwistStamped if stamped else Twist
        self.publisher: Any = flight.advertise(kind, TOPIC, 10)
        flight.wait(self.publisher.get_subscription_count, 10.0, "a subscription of the server")

    def press(self, key: str) -> None:
        """Publish once."""
        x, y, z, turn = _KEYS.get(key, (0, 0, 0, 0))
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = (SPEED_M_S * each for each in (x, y, z))
        twist.angular.z = TURN_RAD_S * turn
        self.publish(twist)

    def publish(self, twist: Twist, age_s: int = 0, frame_id: str | None = None) -> None:
        """Publish a twist that is so old."""
        if not self._stamped:
            self.publisher.publish(twist)
            return
        message = TwistStamped(twist=twist)
        message.header.stamp = self._flight.node.get_clock().now().to_msg()
        message.header.stamp.sec -= age_s
        message.header.frame_id = self._frame_id if frame_id is None else frame_id
        self.publisher.publish(message)

    def hold(self, key: str, seconds: float) -> None:
        """Press a key again and again, as a keyboard repeats it."""
        for _ in range(round(seconds / 0.1)):
            self.press(key)
            self._flight.spin_for(0.1)
