"""Subscriptions to ROS sensor topics, passed to the driver thread newest first."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Generic, TypeVar

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan, PointCloud2

from drone_navigation.server.bridge_access import BridgeAccess
from navigation_bridge.obstacles.obstacle_feed import SensorPoints, SensorScan
from navigation_bridge.obstacles.sensor_messages import SensorMessageError, points_of, scan_of

__all__ = ["Newest", "SensorTopics"]

ItemT = TypeVar("ItemT")
MessageT = TypeVar("MessageT", LaserScan, PointCloud2)

# A best-effort subscriber also hears reliable publishers.
_SENSOR_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)

# One scanner and one camera; a source that names another frame each time fills no tree.
_FRAMES_MAX = 4


class Newest(Generic[ItemT]):
    """Passes items to another thread; if it is slower, only the newest."""

    def __init__(
        self, post: Callable[[Callable[[], object]], None], take: Callable[[ItemT], None]
    ) -> None:
        """Prepare.

        Args:
            post: has something called on the other thread, soon.
            take: what is called there.
        """
        self._post = post
        self._take = take
        self._lock = threading.Lock()
        self._items: list[ItemT] = []

    def put(self, item: ItemT) -> None:
        """Pass an item; one still waiting is dropped."""
        with self._lock:
            waits = bool(self._items)
            self._items[:] = [item]
        if not waits:
            self._post(self._deliver)

    def _deliver(self) -> None:
        with self._lock:
            (item,) = self._items
            self._items.clear()
        self._take(item)


class SensorTopics:
    """Subscribes to the configured sensors."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe to what is configured."""
        self._node, self._bridge, self._frames = access.node, access.bridge, access.frames
        self._driver, self._clock = access.driver, access.clock
        self._reported: set[str] = set()
        self._add_frame = access.topics.transforms.add_sensor
        self._added: set[str] = set()
        config = access.config.bridge.obstacles
        self._subscribe(config.scan_topic, LaserScan, scan_of, self._take_scan)
        self._subscribe(config.points_topic, PointCloud2, points_of, self._take_points)

    def _subscribe(
        self,
        topic: str,
        kind: type[MessageT],
        decode: Callable[[MessageT], ItemT],
        take: Callable[[tuple[ItemT, float]], None],
    ) -> None:
        """Subscribe to a topic, if there is one."""
        if topic:
            newest: Newest[tuple[ItemT, float]] = Newest(self._driver.post, take)
            self._node.create_subscription(
                kind,
                topic,
                partial(self._hear, decode, newest),
                _SENSOR_QOS,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )

    def _hear(
        self,
        decode: Callable[[MessageT], ItemT],
        newest: Newest[tuple[ItemT, float]],
        message: MessageT,
    ) -> None:
        now = self._clock.now()
        if message.header.frame_id not in self._added and len(self._added) < _FRAMES_MAX:
            self._added.add(message.header.frame_id)
            self._driver.post(partial(self._add_frame, message.header.frame_id))
        message.header.frame_id = self._frames.plain(message.header.frame_id)
        try:
            newest.put((decode(message), now))
        except SensorMessageError as error:
            if str(error) not in self._reported:
                self._reported.add(str(error))
                self._node.get_logger().warning(f"Ignored: {error}")

    # On the driver's thread.

    def _take_scan(self, seen: tuple[SensorScan, float]) -> None:
        self._bridge.obstacles.take_scan(*seen)

    def _take_points(self, seen: tuple[SensorPoints, float]) -> None:
        self._bridge.obstacles.take_points(*seen)
