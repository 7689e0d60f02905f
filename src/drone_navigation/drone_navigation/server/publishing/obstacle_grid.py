"""The obstacles at the vehicle's height as an OccupancyGrid."""

from __future__ import annotations

import array
import math
from collections.abc import Callable

from builtin_interfaces.msg import Time
from nav_msgs.msg import OccupancyGrid

from drone_navigation.server.publishing.publishing_node import TopicPublisher
from navigation_bridge.bridge import Bridge
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.mapping.occupancy import GridWindow, occupancy

__all__ = ["ObstacleGrid", "grid_message"]

_PERIOD_S = 0.5


class ObstacleGrid:
    """Publishes the grid twice a second while somebody subscribes to it."""

    def __init__(self, publisher: TopicPublisher, bridge: Bridge, map_frame: str) -> None:
        """Publish ``bridge``'s obstacles in its map, by that frame's name."""
        self._bridge, self._publisher = bridge, publisher
        self._map_frame = map_frame
        self._next_s = -math.inf

    def update(self, stamp: Callable[[], Time], now: float) -> None:
        """Publish, if due and wanted."""
        if now < self._next_s:
            return
        self._next_s = now + _PERIOD_S
        pose = self._bridge.pose
        if pose is None or not self._publisher.get_subscription_count():
            return
        feed = self._bridge.obstacles
        east_m, north_m, height_m = pose.position_enu_m
        window = GridWindow.about(east_m, north_m, *feed.map_size_and_cell_m)
        clearance_m = feed.clearance_m
        around = feed.look()
        beside = around.known.joined(around.sensed)
        beside = beside.between(height_m - clearance_m, height_m + clearance_m)
        message = grid_message(beside, window)
        message.header.stamp = message.info.map_load_time = stamp()
        message.header.frame_id = self._map_frame
        message.info.origin.position.z = height_m
        self._publisher.publish(message)


def grid_message(obstacles: Obstacles, window: GridWindow) -> OccupancyGrid:
    """Return a grid without header; x is east, rows go from south to north."""
    message = OccupancyGrid()
    info = message.info
    info.resolution, info.width, info.height = window.cell_m, window.count, window.count
    info.origin.position.x = window.west_cell * window.cell_m
    info.origin.position.y = window.south_cell * window.cell_m
    info.origin.orientation.w = 1.0
    message.data = array.array("b", occupancy(obstacles, window).tobytes())
    return message
