"""Obstacles as markers for RViz."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from drone_navigation.server.publishing.publishing_node import TopicPublisher
from navigation_bridge.bridge import Bridge
from navigation_bridge.names import FRAME_MAP
from navigation_core.mapping.obstacles import Array, Box, Cylinder, KnownObstacle, Obstacles

__all__ = ["KNOWN", "SENSED", "ObstacleMarkers", "obstacle_markers"]

KNOWN, SENSED = "known", "sensed"
_COLOURS = {KNOWN: (0.95, 0.6, 0.1, 0.8), SENSED: (0.85, 0.1, 0.1, 0.6)}
# All cubes of a list have one size: heights are drawn in steps of this.
_STEP_M = 0.5
_THIN_M = 0.05
_PERIOD_S = 0.5
# An obstacle without a top is drawn up to this height above the vehicle, rounded to steps.
_ABOVE_M = 5.0


class ObstacleMarkers:
    """Publishes the obstacles when they have changed, at most twice a second.

    Not while nobody subscribes: markers of 200 known obstacles take the thread that flies 10 ms.
    """

    def __init__(
        self, publisher: TopicPublisher, bridge: Bridge, map_frame: str = FRAME_MAP
    ) -> None:
        """Prepare.

        Args:
            publisher: of the markers.
            bridge: whose obstacles are shown.
            map_frame: name of the vehicle's map.
        """
        self._publisher = publisher
        self._bridge = bridge
        self._map_frame = map_frame
        self._next_s = -math.inf
        self._shown: tuple[Obstacles, Obstacles] | None = None

    def update(self, stamp: Callable[[], Time], now: float) -> None:
        """Publish changes, if due."""
        if now < self._next_s:
            return
        self._next_s = now + _PERIOD_S
        if not self._publisher.get_subscription_count():
            return
        feed, shown = self._bridge.obstacles, self._shown
        around, named = feed.look(), feed.standing.known_by_name
        known, sensed = around.known, around.sensed
        if shown is not None and shown[0] is known and shown[1] is sensed:
            return
        # One that may come to know some is told from one that never will.
        if shown is None and not (len(known) or len(sensed) or feed.has_sensor):
            return
        self._shown = (known, sensed)
        pose = self._bridge.pose
        height_m = 0.0 if pose is None else pose.position_enu_m[2]
        high_m = (math.floor(max(height_m, 0.0) / _ABOVE_M) + 2.0) * _ABOVE_M
        self._publisher.publish(
            obstacle_markers(
                known, sensed, min(height_m - 1.0, 0.0), high_m, stamp(), self._map_frame, named
            )
        )


def obstacle_markers(
    known: Obstacles,
    sensed: Obstacles,
    low_m: float,
    high_m: float,
    stamp: Time,
    map_frame: str = FRAME_MAP,
    named: Sequence[KnownObstacle] = (),
) -> MarkerArray:
    """Return markers in the map, the first of which deletes those before.

    Args:
        known: those of the file; each a marker of its own, in namespace "known".
        sensed: those that were seen, lists of cubes in namespace "sensed".
        low_m: map z from which what has no bottom is drawn.
        high_m: map z up to which what has no top is drawn.
        stamp: time of the markers.
        map_frame: name of the map.
        named: the known ones with their names, which their markers then have as text.
    """
    array = MarkerArray()
    array.markers.append(Marker(action=Marker.DELETEALL))
    shown = list(_known(known, low_m, high_m))
    # In the order of the tables: posts, then boxes.
    names = [o.name for kind in (Cylinder, Box) for o in named if isinstance(o, kind)]
    for marker, name in zip(shown, names, strict=False):
        marker.text = name
    array.markers += shown
    array.markers += _sensed(sensed, low_m, high_m)
    for number, marker in enumerate(array.markers):
        marker.header.frame_id = map_frame
        marker.header.stamp = stamp
        marker.id = number
    return array


def _marker(namespace: str, kind: int) -> Marker:
    marker = Marker(ns=namespace, type=kind, action=Marker.ADD)
    marker.pose.orientation.w = 1.0
    red, green, blue, alpha = _COLOURS[namespace]
    marker.color = ColorRGBA(r=red, g=green, b=blue, a=alpha)
    return marker


def _known(known: Obstacles, low_m: float, high_m: float) -> Iterator[Marker]:
    for east, north, radius, bottom, top in _ended(known.posts, low_m, high_m):
        marker = _marker(KNOWN, Marker.CYLINDER)
        marker.scale.x = marker.scale.y = 2.0 * radius
        _place(marker, east, north, bottom, top)
        yield marker
    for east, north, length, width, yaw, bottom, top in _ended(known.boxes, low_m, high_m):
        marker = _marker(KNOWN, Marker.CUBE)
        marker.scale.x = max(2.0 * length, _THIN_M)
        marker.scale.y = max(2.0 * width, _THIN_M)
        marker.pose.orientation.z = math.sin(yaw / 2.0)
        marker.pose.orientation.w = math.cos(yaw / 2.0)
        _place(marker, east, north, bottom, top)
        yield marker


def _place(marker: Marker, east: float, north: float, bottom: float, top: float) -> None:
    position = marker.pose.position
    position.x, position.y, position.z = east, north, 0.5 * (bottom + top)
    marker.scale.z = top - bottom


def _sensed(sensed: Obstacles, low_m: float, high_m: float) -> Iterator[Marker]:
    lists: dict[tuple[float, float], Marker] = {}
    for east, north, radius, bottom, top in _ended(sensed.posts, low_m, high_m):
        height = max(round((top - bottom) / _STEP_M), 1) * _STEP_M
        marker = lists.get((radius, height))
        if marker is None:
            marker = lists[radius, height] = _marker(SENSED, Marker.CUBE_LIST)
            marker.scale.x = marker.scale.y = 2.0 * radius
            marker.scale.z = height
        marker.points.append(Point(x=east, y=north, z=0.5 * (bottom + top)))
    yield from lists.values()


def _ended(table: Array, low_m: float, high_m: float) -> list[list[float]]:
    """Return the rows of a table with finite heights, which are its last two columns."""
    ended = table.copy()
    bottom, top = ended[:, -2], ended[:, -1]
    bottom[np.isinf(bottom)] = low_m
    top[np.isinf(top)] = high_m
    # An obstacle that ends at the picture's lower edge or below still gets a height.
    top[:] = np.maximum(top, bottom + _THIN_M)
    rows: list[list[float]] = ended.tolist()
    return rows
