"""Subscriptions to ROS sensor topics, passed to the driver thread newest first."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan, PointCloud2

from drone_navigation.server.frame_names import FrameNames
from mavlink_vehicle.io.clock import Clock
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.fleet import DriverThread
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.obstacles.sensor_messages import SensorMessageError, points_of, scan_of

__all__ = ["Newest", "SensorTopics"]

ItemT = TypeVar("ItemT")

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

    def __init__(
        self,
        node: Node,
        feed: ObstacleFeed,
        driver: DriverThread,
        clock: Clock,
        config: ObstacleConfig,
        frames: FrameNames,
        add_frame: Callable[[str], None],
    ) -> None:
        """Subscribe to what is configured.

        Args:
            node: who subscribes.
            feed: takes what is seen, on the driver's thread.
            driver: of that thread.
            clock: gives the time at which something was seen.
            config: names the topics.
            frames: names of the vehicle's frames.
            add_frame: takes the name of each sensor's frame, on the driver's thread.
        """
        self._node = node
        self._clock = clock
        self._frames = frames
        self._told: set[str] = set()
        self._driver = driver
        self._add_frame = add_frame
        self._added: set[str] = set()
        for topic, kind, decode, take in (
            (config.scan_topic, LaserScan, scan_of, feed.take_scan),
            (config.points_topic, PointCloud2, points_of, feed.take_points),
        ):
            if topic:
                newest: Newest[tuple[Any, float]] = Newest(driver.post, partial(_apply, take))
                node.create_subscription(
                    kind,
                    topic,
                    partial(self._hear, decode, newest),
                    _SENSOR_QOS,
                    callback_group=MutuallyExclusiveCallbackGroup(),
                )

    def _hear(
        self, decode: Callable[[Any], Any], newest: Newest[tuple[Any, float]], message: Any
    ) -> None:
        now = self._clock.now()
        if message.header.frame_id not in self._added and len(self._added) < _FRAMES_MAX:
            self._added.add(message.header.frame_id)
            self._driver.post(partial(self._add_frame, message.header.frame_id))
        message.header.frame_id = self._frames.plain(message.header.frame_id)
        try:
            newest.put((decode(message), now))
        except SensorMessageError as error:
            if str(error) not in self._told:
                self._told.add(str(error))
                self._node.get_logger().warning(f"Ignored: {error}")


def _apply(take: Callable[[Any, float], None], seen: tuple[Any, float]) -> None:
    take(*seen)
