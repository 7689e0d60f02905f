"""Fences and rally points in degrees, as clients give them and as mission items. No ROS.

Items: https://mavlink.io/en/services/mission.html#geofence and MAV_CMD_NAV_RALLY_POINT. Each corner
of a polygon carries the number of its corners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import AMSL, RELATIVE_ALT, TERRAIN_ALT, MissionItem
from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.plan_files.items import FRAME_REFERENCES

Degrees = tuple[float, float]
"""Latitude and longitude (WGS-84)."""

# MissionItemProtocol_Fence.cpp rejects more in param1.
CORNERS_MAX = 255
# More than any autopilot has room for; it says itself how many it stores.
_ITEMS_MAX = 2000
_RADIUS_MAX_M = 1e6
_ALTITUDE_MAX_M = 10_000.0
_UNIT = 1e7

_POLYGONS = {
    True: mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    False: mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
}
_CIRCLES = {
    True: mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION,
    False: mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION,
}
_INCLUSION = {command: inside for inside, command in (*_POLYGONS.items(), *_CIRCLES.items())}
RETURN_COMMAND = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT
# The height of an item of a fence means nothing; in this frame both firmwares take it.
_FENCE_FRAME = mavlink.MAV_FRAME_GLOBAL
_RALLY = mavlink.MAV_CMD_NAV_RALLY_POINT

FENCE_COMMANDS = frozenset({*_INCLUSION, RETURN_COMMAND})
POLYGON_COMMANDS = frozenset(_POLYGONS.values())
RALLY_COMMANDS = frozenset({_RALLY})
_FRAMES = {
    AltitudeReference.HOME: RELATIVE_ALT,
    AltitudeReference.AMSL: AMSL,
    AltitudeReference.GROUND: TERRAIN_ALT,
}


@dataclass(frozen=True)
class GeoArea:
    """A polygon or a circle.

    Attributes:
        points_deg: corners in order, or the centre alone.
        radius_m: of a circle; None for a polygon.
        inclusion: whether the vehicle must stay inside; otherwise outside.
    """

    points_deg: tuple[Degrees, ...]
    radius_m: float | None = None
    inclusion: bool = True


@dataclass(frozen=True)
class GeoFence:
    """A fence as it is uploaded; `return_point_deg` is where an ArduPlane flies to."""

    areas: tuple[GeoArea, ...] = ()
    return_point_deg: Degrees | None = None


@dataclass(frozen=True)
class RallyPoint:
    """A rally point: a place, metres, and what they are above."""

    place_deg: Degrees
    altitude_m: float
    reference: AltitudeReference = AltitudeReference.HOME


# --- checks ------------------------------------------------------------------------------


def fence_problem(fence: GeoFence) -> str | None:
    """Return why a fence is not sent, a sentence that names the area; None if it can be."""
    for number, area in enumerate(fence.areas, start=1):
        problem = _area_problem(area)
        if problem is not None:
            return f"Area {number}: {problem}."
    if fence.return_point_deg is not None:
        problem = _place_problem(fence.return_point_deg)
        if problem is not None:
            return f"Return point: {problem}."
        if not fence.areas:
            return "A return point alone is not a fence."
    count = len(fence_items(fence))
    if count > _ITEMS_MAX:
        return f"The fence has {count} corners and circles; at most {_ITEMS_MAX} are sent."
    return None


def rally_problem(points: Sequence[RallyPoint]) -> str | None:
    """Return why rally points are not sent, a sentence that names the point, or None."""
    if len(points) > _ITEMS_MAX:
        return f"{len(points)} rally points; at most {_ITEMS_MAX} are sent."
    for number, point in enumerate(points, start=1):
        problem = _place_problem(point.place_deg)
        if problem is None and not abs(point.altitude_m) <= _ALTITUDE_MAX_M:
            low, high = -_ALTITUDE_MAX_M, _ALTITUDE_MAX_M
            problem = f"altitude {point.altitude_m:g} m is not from {low:g} to {high:g}"
        if problem is not None:
            return f"Rally point {number}: {problem}."
    return None


def _place_problem(place_deg: Degrees) -> str | None:
    latitude_deg, longitude_deg = place_deg
    if not abs(latitude_deg) <= 90.0:
        return f"latitude {latitude_deg:.7g} is not from -90 to 90 degrees"
    if not abs(longitude_deg) <= 180.0:
        return f"longitude {longitude_deg:.7g} is not from -180 to 180 degrees"
    if latitude_deg == longitude_deg == 0.0:
        return "0, 0 means no position"
    return None


def _area_problem(area: GeoArea) -> str | None:
    for number, place_deg in enumerate(area.points_deg, start=1):
        problem = _place_problem(place_deg)
        if problem is not None:
            return f"point {number}: {problem}"
    if area.radius_m is not None:
        if len(area.points_deg) != 1:
            return f"a circle has one centre, not {len(area.points_deg)}"
        if not 0.0 < area.radius_m <= _RADIUS_MAX_M:
            return f"radius {area.radius_m:g} m is not above 0 and at most {_RADIUS_MAX_M:g}"
        return None
    if len(area.points_deg) < 3:
        return f"a polygon has at least 3 corners, not {len(area.points_deg)}"
    if len(area.points_deg) > CORNERS_MAX:
        return f"a polygon has at most {CORNERS_MAX} corners, not {len(area.points_deg)}"
    return _polygon_problem(area.points_deg)


def _polygon_problem(points_deg: Sequence[Degrees]) -> str | None:
    """Return why a polygon is not simple. The integers that are sent are compared, so exactly."""
    first = points_deg[0][1]
    corners = [
        (_integer(first + math.remainder(longitude - first, 360.0)), _integer(latitude))
        for latitude, longitude in points_deg
    ]
    count = len(corners)
    for i in range(count):
        j = (i + 1) % count
        if corners[i] == corners[j]:
            return f"corners {i + 1} and {j + 1} are the same"
    if max(east for east, _ in corners) - min(east for east, _ in corners) >= 180.0 * _UNIT:
        return "it is wider than half of the earth"
    for i in range(count):
        a, b, c = corners[i], corners[(i + 1) % count], corners[(i + 2) % count]
        if _turn(a, b, c) == 0 and _faces(a, b, c) > 0:
            return f"it turns back on itself at corner {(i + 1) % count + 1}"
        for j in range(i + 2, count):
            if (j + 1) % count == i:
                continue
            if _meet(a, b, corners[j], corners[(j + 1) % count]):
                return (
                    f"its edges from corner {i + 1} and from corner {j + 1} cross; give the "
                    "corners in their order around it"
                )
    return None


_Point = tuple[int, int]


def _turn(a: _Point, b: _Point, c: _Point) -> int:
    """Return twice the area of a triangle, positive when it turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _faces(a: _Point, b: _Point, c: _Point) -> int:
    """Return whether a and c lie on the same side of b: the sign of a product."""
    return (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1])


def _meet(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """Return whether two segments have a point in common."""
    turns = (_turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b))
    if (turns[0] > 0) != (turns[1] > 0) and (turns[2] > 0) != (turns[3] > 0) and all(turns):
        return True
    ends = ((a, b, c, turns[0]), (a, b, d, turns[1]), (c, d, a, turns[2]), (c, d, b, turns[3]))
    return any(turn == 0 and _faces(start, point, end) <= 0 for start, end, point, turn in ends)


# --- items -------------------------------------------------------------------------------


def fence_items(fence: GeoFence) -> tuple[MissionItem, ...]:
    """Return a fence as mission items, the return point last."""
    items: list[MissionItem] = []
    for area in fence.areas:
        if area.radius_m is None:
            command, first = _POLYGONS[area.inclusion], float(len(area.points_deg))
        else:
            command, first = _CIRCLES[area.inclusion], area.radius_m
        items += [point_item(command, _FENCE_FRAME, place, first) for place in area.points_deg]
    if fence.return_point_deg is not None:
        items.append(point_item(RETURN_COMMAND, _FENCE_FRAME, fence.return_point_deg))
    return tuple(items)


def rally_items(points: Sequence[RallyPoint]) -> tuple[MissionItem, ...]:
    """Return rally points as mission items."""
    return tuple(
        point_item(_RALLY, _FRAMES[point.reference], point.place_deg, altitude_m=point.altitude_m)
        for point in points
    )


def point_item(
    command: int, frame: int, place_deg: Degrees, param1: float = 0.0, altitude_m: float = 0.0
) -> MissionItem:
    """Return an item of a fence or a rally point.

    Args:
        command: MAV_CMD.
        frame: MAV_FRAME.
        place_deg: its position.
        param1: number of corners, or radius in metres.
        altitude_m: above what the frame names.
    """
    x, y = map(_integer, place_deg)
    return MissionItem(command, frame, (param1, 0.0, 0.0, 0.0), x, y, altitude_m)


def fence_of_items(items: Sequence[MissionItem]) -> GeoFence:
    """Return the fence that items describe; other items are left out."""
    areas: list[GeoArea] = []
    return_point_deg: Degrees | None = None
    left = list(items)
    while left:
        item = left[0]
        count = 1
        if item.command in _POLYGONS.values() and math.isfinite(item.params[0]):
            count = max(int(item.params[0]), 1)
        group, left = left[:count], left[count:]
        places_deg = tuple(_place_deg(corner) for corner in group)
        if item.command == RETURN_COMMAND:
            return_point_deg = places_deg[0]
        elif item.command in _CIRCLES.values():
            areas.append(GeoArea(places_deg, item.params[0], _INCLUSION[item.command]))
        elif item.command in _POLYGONS.values():
            areas.append(GeoArea(places_deg, None, _INCLUSION[item.command]))
    return GeoFence(tuple(areas), return_point_deg)


def rally_of_items(items: Sequence[MissionItem]) -> tuple[RallyPoint, ...]:
    """Return the rally points that items describe; others are left out."""
    return tuple(
        RallyPoint(_place_deg(item), item.z, FRAME_REFERENCES[item.frame])
        for item in items
        if item.command == _RALLY and item.frame in FRAME_REFERENCES
    )


def _integer(degrees: float) -> int:
    return round(degrees * _UNIT)


def _place_deg(item: MissionItem) -> Degrees:
    return item.x / _UNIT, item.y / _UNIT
