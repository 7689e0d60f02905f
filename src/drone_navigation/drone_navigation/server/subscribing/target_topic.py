"""The topic or the frame of TF of a target, for the time in which a goal follows it."""

from __future__ import annotations

import math
from typing import TypeAlias

from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.exceptions import NameValidationException
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_msgs.msg import Header

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.frames.transform_listener import TransformListener
from drone_navigation.server.frames.transform_tree import Placed
from drone_navigation.steady_timer import steady_timer
from mavlink_vehicle.positions.frames import yaw_of_quaternion
from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_core.tasks.inputs.tracked_target import TargetSample

__all__ = ["TargetTopic", "topic_types"]

TargetMessage: TypeAlias = PoseStamped | PoseWithCovarianceStamped | Odometry

_TYPES: dict[str, type[TargetMessage]] = {
    "geometry_msgs/msg/PoseStamped": PoseStamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": PoseWithCovarianceStamped,
    "nav_msgs/msg/Odometry": Odometry,
}
# A best-effort subscriber also hears reliable publishers.
_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)
_PERIOD_S = 0.1
_TINY = 1e-6


def topic_types(access: BridgeAccess, topic: str) -> tuple[str, ...]:
    """Return the types with which a topic is published now."""
    if not topic:
        return ()
    try:
        infos = access.node.get_publishers_info_by_topic(topic)
    except (ValueError, NameValidationException):  # the goal is rejected for its name
        return ()
    return tuple(sorted({info.topic_type for info in infos}))


class TargetTopic:
    """Subscribes when a goal begins to follow a target, and no longer than that."""

    def __init__(self, access: BridgeAccess) -> None:
        """Wait for a goal."""
        self._node, self._bridge, self._frames = access.node, access.bridge, access.frames
        self._access = access
        self._group = MutuallyExclusiveCallbackGroup()
        self._wanted: TargetSource | None = None
        self._source: TargetSource | None = None
        self._subscriptions: list[Subscription[TargetMessage]] = []
        self._timer: Timer | None = None
        self._transforms = TransformListener(self._node, self._group)
        self._stamp_s = -math.inf
        # Subscriptions are made by the executor: they take longer than a setpoint may wait.
        self._changed = self._node.create_guard_condition(self._apply, callback_group=self._group)
        access.bridge.feature(FollowedTarget).on_source = self._change

    def _change(self, source: TargetSource | None) -> None:
        """Have the executor listen to another source; on the driver's thread."""
        self._wanted = source
        self._changed.trigger()

    # --- on the executor's threads, one at a time -------------------------------------------

    def _apply(self) -> None:
        source = self._wanted
        if source is self._source:
            return
        self._source = source
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
            self._timer = None
        self._transforms.close()
        self._stamp_s = -math.inf
        if source is None or not (source.topic or source.frame):
            return
        self._transforms.listen()
        if source.frame:
            self._timer = steady_timer(self._node, _PERIOD_S, self._look, self._group)
            return
        types = topic_types(self._access, source.topic)
        kind = next((_TYPES[name] for name in types if name in _TYPES), PoseStamped)
        self._subscriptions.append(
            self._node.create_subscription(
                kind, source.topic, self._hear, _QOS, callback_group=self._group
            )
        )

    def _hear(self, message: TargetMessage) -> None:
        pose: Pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
        self._offer(self._sample(message.header, pose))

    def _sample(self, header: Header, pose: Pose) -> TargetSample | str:
        """Return a pose as a sample in the map frame, or why it is none."""
        stamp_s = header.stamp.sec + 1e-9 * header.stamp.nanosec
        if not stamp_s:
            return "It has no stamp: the time of the measurement."
        frame = self._frames.plain(header.frame_id) or "map"
        frame = self._frames.prefix + frame if frame in ("map", "base_link") else header.frame_id
        axes = (
            Placed()
            if frame == self._frames.map
            else self._transforms.pose(frame, self._frames.map, stamp_s)
        )
        if axes is None:
            return f"There is no transform from '{frame}' to '{self._frames.map}'."
        place, turn = pose.position, pose.orientation
        placed = Placed((place.x, place.y, place.z), (turn.w, turn.x, turn.y, turn.z))
        measured_s = self._measured_s(stamp_s)
        if abs(turn.w) + abs(turn.x) + abs(turn.y) + abs(turn.z) < _TINY:
            return TargetSample(measured_s, axes.of(placed.position))
        placed = placed.then(axes)
        return TargetSample(measured_s, placed.position, None, yaw_of_quaternion(placed.turn))

    def _look(self) -> None:
        """Look up the frame of TF; what only stands still is measured now."""
        source = self._source
        if source is None:
            return
        placed = self._transforms.pose(source.frame, self._frames.map)
        if placed is None:
            self._offer(f"There is no transform from '{source.frame}' to '{self._frames.map}'.")
            return
        if placed.stamp_s == math.inf:
            now = self._access.clock.now()
            self._offer(TargetSample(now, placed.position, None, yaw_of_quaternion(placed.turn)))
        elif placed.stamp_s != self._stamp_s:
            self._stamp_s = placed.stamp_s
            measured_s = self._measured_s(placed.stamp_s)
            self._offer(
                TargetSample(measured_s, placed.position, None, yaw_of_quaternion(placed.turn))
            )

    def _measured_s(self, stamp_s: float) -> float:
        """Return a stamp on the steady clock, by its age now."""
        now_s = float(self._node.get_clock().now().nanoseconds) / 1e9
        return self._access.clock.now() - (now_s - stamp_s)

    def _offer(self, sample: TargetSample | str) -> None:
        source, now = self._source, self._access.clock.now()
        if source is None:
            return
        feature = self._bridge.feature(FollowedTarget)
        self._access.driver.post(lambda: feature.offer(source, sample, now))
