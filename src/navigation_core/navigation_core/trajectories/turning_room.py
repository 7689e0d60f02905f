"""Room to turn, for vehicles that cannot turn on the spot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from navigation_core.geometry import wrap_angle
from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["drivable_path", "has_room_to_turn"]

# A first line within this of the heading is reached by what pursuit does anyway.
_AHEAD_RAD = math.radians(20.0)
_STEP_RAD = math.radians(30.0)
# How far straight ahead a turn may begin, in radii, if it can't begin at once.
_AHEAD_RADII = (0.0, 1.0, 2.0, 4.0)
# How many places at which a turn could end are tried as beginnings of a path.
_TRIES_MAX = 4
_ROUNDING_M = 1e-3
_SAMPLES = 9


def has_room_to_turn(
    path: Array, obstacles: Obstacles, clearance_m: float, radius_m: float
) -> bool:
    """Whether all corners of a path can be driven as arcs, clear of all obstacles.

    An arc of radius r that touches both lines of a corner of angle a begins ``r tan(a / 2)``
    before it, and passes ``r (1 / cos(a / 2) - 1)`` inside of it.

    Args:
        path: points in a plane, shape (N, 3).
        obstacles: all that count.
        clearance_m: that the arcs keep.
        radius_m: of the arcs.
    """
    lines = np.diff(path, axis=0)
    length = np.hypot(lines[:, 0], lines[:, 1])
    course = np.arctan2(lines[:, 1], lines[:, 0])
    turn = np.array([wrap_angle(float(b - a)) for a, b in itertools.pairwise(course)])
    reach = radius_m * np.tan(0.5 * np.minimum(np.abs(turn), math.radians(178.0)))
    taken = np.concatenate([[0.0], reach]) + np.concatenate([reach, [0.0]])
    if (taken > length + _ROUNDING_M).any():
        return False
    arcs = [
        _on_arc(path[row + 1] - reach[row] * lines[row] / length[row], course[row], angle, radius_m)
        for row, angle in enumerate(turn)
    ]
    if not arcs:
        return True
    return bool((obstacles.clearance_m(np.concatenate(arcs)) >= clearance_m - _ROUNDING_M).all())


def drivable_path(
    direct: Array,
    heading_enu_rad: float,
    path_from: Callable[[Array], Array | None],
    obstacles: Obstacles,
    clearance_m: float,
    radius_m: float,
) -> Array | None:
    """Return a path that begins with a turn from a heading, shape (N, 3); None without room.

    Args:
        direct: a path, shape (N, 3), that needs to be changed only at its beginning.
        heading_enu_rad: where the nose points there.
        path_from: returns a path to the goal from a place, or None.
        obstacles: all that count.
        clearance_m: that the turn keeps.
        radius_m: of the turn.
    """
    start = direct[0]
    turned = _turned(start, heading_enu_rad, direct[1:], obstacles, clearance_m, radius_m)
    if turned is not None:
        return turned
    tries = 0
    for lead, course in _beginnings(start, heading_enu_rad, obstacles, clearance_m, radius_m):
        if tries == _TRIES_MAX:
            break
        tries += 1
        rest = path_from(lead[-1])
        if rest is None:
            continue
        turned = _turned(lead[-1], course, rest[1:], obstacles, clearance_m, radius_m)
        if turned is not None:
            return np.concatenate([lead[:-1], turned])
    return None


def _turned(
    start: Array,
    heading_rad: float,
    rest: Array,
    obstacles: Obstacles,
    clearance_m: float,
    radius_m: float,
) -> Array | None:
    """Return a turn towards the first point of the rest, and the rest; None if not clear."""
    offset = rest[0] - start
    ahead = wrap_angle(math.atan2(offset[1], offset[0]) - heading_rad)
    if abs(ahead) <= _AHEAD_RAD:
        return np.concatenate([start[None], rest])
    found = []
    for side in (1.0, -1.0):
        angle = _angle_to(start, heading_rad, rest[0], side, radius_m)
        if angle is None:
            continue
        arc, _ = _arc(start, heading_rad, side * angle, radius_m)
        turned = np.concatenate([arc, rest])
        if _is_clear(turned[: len(arc) + 1], obstacles, clearance_m):
            found.append((angle, turned))
    return min(found, key=lambda item: item[0])[1] if found else None


def _angle_to(
    start: Array, heading_rad: float, to: Array, side: float, radius_m: float
) -> float | None:
    """Return by how much to turn until a point is ahead; None for one inside the circle."""
    middle = start[:2] + side * radius_m * np.array([-math.sin(heading_rad), math.cos(heading_rad)])
    offset = to[:2] - middle
    reach = math.hypot(offset[0], offset[1])
    if reach <= radius_m + _ROUNDING_M:
        return None
    course = math.atan2(offset[1], offset[0]) + side * math.asin(radius_m / reach)
    return (side * (course - heading_rad)) % math.tau


def _arc(
    start: Array, heading_rad: float, angle_rad: float, radius_m: float
) -> tuple[Array, float]:
    """Return the corners of a polygon about an arc, from its start to its end, and the course."""
    count = max(math.ceil(abs(angle_rad) / _STEP_RAD), 1)
    step = angle_rad / count
    half_side = radius_m * math.tan(0.5 * abs(step))
    points, course = [start], heading_rad
    for _ in range(count):
        points.append(points[-1] + half_side * _along(course))
        course += step
        points.append(points[-1] + half_side * _along(course))
    # Of the points on the arc only the first and the last are wanted, the rest are its corners.
    return np.array([points[0], *points[1::2], points[-1]]), course


def _along(course_rad: float) -> Array:
    return np.array([math.cos(course_rad), math.sin(course_rad), 0.0])


def _on_arc(start: Array, heading_rad: float, angle_rad: float, radius_m: float) -> Array:
    """Return points on an arc."""
    course = heading_rad + angle_rad * np.linspace(0.0, 1.0, _SAMPLES)
    side = math.copysign(radius_m, angle_rad)
    east = side * (np.sin(course) - math.sin(heading_rad))
    north = side * (math.cos(heading_rad) - np.cos(course))
    return np.asarray(start + np.column_stack([east, north, np.zeros(_SAMPLES)]))


def _is_clear(path: Array, obstacles: Obstacles, clearance_m: float) -> bool:
    return bool(obstacles.are_clear(path[:-1], path[1:], clearance_m).all())


def _beginnings(
    start: Array, heading_rad: float, obstacles: Obstacles, clearance_m: float, radius_m: float
) -> Iterator[tuple[Array, float]]:
    """Yield clear turns of some angles, each with the course at its end, the shortest first."""
    for ahead in _AHEAD_RADII:
        begin = start + ahead * radius_m * _along(heading_rad)
        if not obstacles.are_clear(start[None], begin[None], clearance_m)[0]:
            return
        for angle in (0.5 * math.pi, math.pi):
            for side in (1.0, -1.0):
                arc, course = _arc(begin, heading_rad, side * angle, radius_m)
                if _is_clear(arc, obstacles, clearance_m):
                    yield np.concatenate([start[None], arc] if ahead else [arc]), course
