"""The topic of velocity commands, passed to the driver thread newest first."""

from __future__ import annotations

import uuid
from collections import deque

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.subscribing.sensor_topics import Newest
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame

__all__ = ["TOPIC", "VelocityTopic", "command_of"]

TOPIC = "~/cmd_vel"
# A best-effort subscriber also hears reliable publishers, as teleop_twist_keyboard is one; of
# several commands only the last counts.
_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)
_QUICKEST_OF_S = 10.0
# As of any twist, which is in the axes of the body unless it says otherwise.
_FRAMES = {"": VelocityFrame.BODY, "base_link": VelocityFrame.BODY, "map": VelocityFrame.MAP}


def command_of(twist: Twist, frame_id: str, now: float) -> VelocityCommand | str:
    """Return a command, or the sentence that says why its frame is unknown.

    Args:
        twist: the message; its angular x and y have no effect.
        frame_id: its frame without a vehicle's prefix; empty for base_link.
        now: when it was received.
    """
    frame = _FRAMES.get(frame_id)
    if frame is None:
        return f"unknown frame '{frame_id}'; use 'base_link' or 'map'."
    linear = (twist.linear.x, twist.linear.y, twist.linear.z)
    return VelocityCommand(now, frame, linear, twist.angular.z)


class StampDelays:
    """Delays of stamped messages, against the quickest of the last seconds.

    No clock of this machine is compared with the publisher's: either may be set, or stand still. A
    difference between the two that lasts is no delay.
    """

    def __init__(self) -> None:
        """Begin with no message."""
        self._offsets: deque[tuple[float, float]] = deque()

    def delay_s(self, stamp_s: float, now: float) -> float:
        """Return how much longer than the quickest a message took that has just come."""
        offset_s = now - stamp_s
        while self._offsets and self._offsets[0][0] < now - _QUICKEST_OF_S:
            self._offsets.popleft()
        # Kept in ascending order: a message that took longer than a later one never counts again.
        while self._offsets and self._offsets[-1][1] >= offset_s:
            self._offsets.pop()
        self._offsets.append((now, offset_s))
        return offset_s - self._offsets[0][1]


class VelocityTopic:
    """Subscribes to the velocity commands of one vehicle."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe."""
        stamped = access.config.bridge.commands.stamped
        self._node, self._bridge, self._frames = access.node, access.bridge, access.frames
        self._clock = access.clock
        self._delays = StampDelays()
        self._newest: Newest[VelocityCommand | str] = Newest(access.driver.post, self._take)
        self._node.create_subscription(
            TwistStamped if stamped else Twist,
            TOPIC,
            self._hear_stamped if stamped else self._hear,
            _QOS,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def _hear(self, message: Twist) -> None:
        self._newest.put(command_of(message, "", self._clock.now()))

    def _hear_stamped(self, message: TwistStamped) -> None:
        delay_s = self._delay_s(message.header.stamp)
        if delay_s > self._bridge.feature(VelocityCommands).timeout_s:
            self._newest.put(
                f"its stamp is {delay_s:.2f} s older than those before; check the network, and "
                "whether the publisher's clock was set."
            )
            return
        frame_id = self._frames.plain(message.header.frame_id)
        self._newest.put(command_of(message.twist, frame_id, self._clock.now()))

    def _delay_s(self, stamp: Time) -> float:
        """Return the delay of a message; 0 without a stamp, as some publishers leave it."""
        if stamp.sec == 0 and stamp.nanosec == 0:
            return 0.0
        return self._delays.delay_s(stamp.sec + 1e-9 * stamp.nanosec, self._clock.now())

    def _take(self, command: VelocityCommand | str) -> None:
        now, following = self._clock.now(), self._bridge.feature(VelocityCommands)
        if isinstance(command, str):
            following.reject(command, now)
        else:
            following.follow(command, uuid.uuid4().hex, now)
