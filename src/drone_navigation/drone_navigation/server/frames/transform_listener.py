"""Hears ``/tf`` and ``/tf_static`` from a moment on."""

from __future__ import annotations

import math
import threading

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from tf2_msgs.msg import TFMessage

from drone_navigation.server.frames.transform_tree import Placed, TransformTree

__all__ = ["TransformListener"]

# A best-effort subscriber also hears reliable publishers.
_TF_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.BEST_EFFORT
)
# A message of each publisher waits here, not only the last one.
_STATIC_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


class TransformListener:
    """Keeps the tree of frames while it listens; any thread may ask it."""

    def __init__(self, node: Node, group: MutuallyExclusiveCallbackGroup | None = None) -> None:
        """Prepare; nothing is heard yet.

        Args:
            node: who subscribes.
            group: in which messages are processed; None for one of its own.
        """
        self._node = node
        self._group = group or MutuallyExclusiveCallbackGroup()
        self._changed = threading.Condition()
        self._tree = TransformTree()
        self._subscriptions: list[Subscription[TFMessage]] = []

    def listen(self) -> bool:
        """Hear transforms from now on; return False if it does already."""
        with self._changed:
            if self._subscriptions:
                return False
            for topic, qos, still in (("/tf", _TF_QOS, False), ("/tf_static", _STATIC_QOS, True)):
                self._subscriptions.append(
                    self._node.create_subscription(
                        TFMessage,
                        topic,
                        lambda message, still=still: self._hear(message, still),
                        qos,
                        callback_group=self._group,
                    )
                )
            return True

    def close(self) -> None:
        """Hear nothing more, and forget what was heard."""
        with self._changed:
            for subscription in self._subscriptions:
                self._node.destroy_subscription(subscription)
            self._subscriptions.clear()
            self._tree = TransformTree()

    def pose(self, frame: str, target: str, at_s: float | None = None) -> Placed | None:
        """Return the pose of a frame in another, as :meth:`TransformTree.pose` does."""
        with self._changed:
            return self._tree.pose(frame, target, at_s)

    def wait(self, timeout_s: float) -> None:
        """Wait for the next message, but no longer than a timeout."""
        with self._changed:
            self._changed.wait(timeout_s)

    def _hear(self, message: TFMessage, still: bool) -> None:
        with self._changed:
            for each in message.transforms:
                stamp = each.header.stamp
                translation, rotation = each.transform.translation, each.transform.rotation
                placed = Placed(
                    (translation.x, translation.y, translation.z),
                    (rotation.w, rotation.x, rotation.y, rotation.z),
                    math.inf if still else stamp.sec + 1e-9 * stamp.nanosec,
                )
                self._tree.take(each.child_frame_id, each.header.frame_id, placed)
            self._changed.notify_all()
