"""The vehicle's own fence, from its parameters, in the map frame. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.positions.frames import LocalFrame
from mavlink_vehicle.profiles import Profile
from navigation_core.geometry import Vector3
from navigation_core.safety.fences import Area, CircleArea, Fence, Point2, PolygonArea

# Bits of FENCE_TYPE (AC_Fence.h).
_ALTITUDE_MAX, _CIRCLE, _POLYGON, _ALTITUDE_MIN = 1, 2, 4, 8
# FENCE_OPTIONS bit 1: being inside one inclusion suffices.
_UNION = 2
# MAV_CMD_NAV_FENCE_* (common.xml), and whether the vehicle must be inside.
_POLYGONS = {5001: True, 5002: False}
_CIRCLES = {5003: True, 5004: False}
NO_FENCE = Fence()


def areas_of(items: Sequence[MissionItem], enu: Callable[[Vector3], Vector3]) -> tuple[Area, ...]:
    """Return the areas of an uploaded fence; ``enu`` converts positions into the map frame.

    Each corner of a polygon carries the number of corners (mavlink.io, "Geofence" of the mission
    protocol).
    """

    def place(item: MissionItem) -> Point2:
        east_m, north_m, _ = enu((item.x * 1e-7, item.y * 1e-7, 0.0))
        return east_m, north_m

    areas: list[Area] = []
    left = list(items)
    while left:
        item = left[0]
        has_corners = item.command in _POLYGONS and math.isfinite(item.params[0])
        count = max(int(item.params[0]), 1) if has_corners else 1
        group, left = left[:count], left[count:]
        if item.command in _CIRCLES:
            areas.append(CircleArea(place(item), item.params[0], _CIRCLES[item.command]))
        elif item.command in _POLYGONS and len(group) >= 3:
            corners = tuple(place(corner) for corner in group)
            areas.append(PolygonArea(corners, _POLYGONS[item.command]))
    return tuple(areas)


class PlacedAreas:
    """The areas of the vehicle's own fence: the same object until they or the map change."""

    def __init__(self) -> None:
        """Begin with none."""
        self._items: Sequence[MissionItem] = ()
        self._frame: LocalFrame | None = None
        self._areas: tuple[Area, ...] = ()

    def of(
        self,
        items: Sequence[MissionItem] | None,
        frame: LocalFrame | None,
        enu: Callable[[Vector3], Vector3],
    ) -> tuple[Area, ...]:
        """Return the areas of an uploaded fence as far as known, whether in force or not."""
        if not items or frame is None:
            return ()
        if self._items is not items or self._frame != frame:
            self._items, self._frame, self._areas = items, frame, areas_of(items, enu)
        return self._areas


def has_areas(profile: Profile, parameters: Mapping[str, float]) -> bool:
    """Whether uploaded areas are in force by the parameters."""
    if "GF_ACTION" in profile.wanted_parameters:
        return bool(parameters.get("GF_ACTION", 1.0))
    enabled = parameters.get("FENCE_ENABLE", 1.0) or parameters.get("FENCE_AUTOENABLE")
    return bool(enabled) and bool(int(parameters.get("FENCE_TYPE", _POLYGON)) & _POLYGON)


def uploaded_fence(
    profile: Profile, parameters: Mapping[str, float], areas: tuple[Area, ...]
) -> Fence:
    """Return the fence that uploaded areas make once they are in force."""
    is_px4 = "GF_ACTION" in profile.wanted_parameters
    union = is_px4 or bool(int(parameters.get("FENCE_OPTIONS", 0)) & _UNION)
    found, alternatives = _sorted(areas, union)
    return Fence(areas=tuple(found), alternatives=alternatives)


def enforcement(profile: Profile, parameters: Mapping[str, float]) -> str:
    """Return whether uploaded areas are enforced, a sentence with the parameters that say it."""
    names: tuple[str, ...] = ("GF_ACTION",)
    if "GF_ACTION" not in profile.wanted_parameters:
        names = ("FENCE_ENABLE", "FENCE_AUTOENABLE", "FENCE_TYPE")
    if names[0] not in parameters:
        return f"Whether the autopilot enforces it is unknown: {names[0]} was not read."
    values = ", ".join(f"{name} {parameters[name]:g}" for name in names if name in parameters)
    if has_areas(profile, parameters):
        by_itself = parameters.get("FENCE_AUTOENABLE") and not parameters.get("FENCE_ENABLE")
        when = ", once its own rule enables it" if by_itself else ""
        return f"The autopilot enforces it{when} ({values})."
    return f"The autopilot does not enforce it ({values})."


def fence_of(
    profile: Profile,
    parameters: Mapping[str, float],
    home_enu_m: Vector3 | None,
    areas: tuple[Area, ...] = (),
) -> Fence | None:
    """Return the vehicle's own fence, or None while unknown.

    Args:
        profile: the vehicle's.
        parameters: the known ones of its `wanted_parameters`.
        home_enu_m: the launch point, reference of the fence's circle and heights.
        areas: its uploaded circles and polygons.
    """
    if "GF_ACTION" in profile.wanted_parameters:
        return _px4(parameters, home_enu_m, areas)
    if "FENCE_ENABLE" in profile.wanted_parameters:
        return _ardupilot(parameters, home_enu_m, areas)
    return NO_FENCE


def _circle(home_enu_m: Vector3, radius_m: float) -> CircleArea:
    return CircleArea((home_enu_m[0], home_enu_m[1]), radius_m, name="circle about home")


def _sorted(areas: Sequence[Area], union: bool) -> tuple[list[Area], tuple[Area, ...]]:
    """Split uploaded areas into those that all apply and those of which one suffices."""
    alternatives = [area for area in areas if union and area.inclusion]
    return [area for area in areas if area not in alternatives], tuple(alternatives)


def _ardupilot(
    parameters: Mapping[str, float], home_enu_m: Vector3 | None, areas: tuple[Area, ...]
) -> Fence | None:
    if "FENCE_ENABLE" not in parameters:
        return None
    # With FENCE_AUTOENABLE it is enabled by arming or the take-off.
    if not parameters["FENCE_ENABLE"] and not parameters.get("FENCE_AUTOENABLE"):
        return NO_FENCE
    if home_enu_m is None:
        return None
    kinds = int(parameters.get("FENCE_TYPE", 0))
    union = bool(int(parameters.get("FENCE_OPTIONS", 0)) & _UNION)
    found, alternatives = _sorted(areas if kinds & _POLYGON else (), union)
    radius_m = parameters.get("FENCE_RADIUS")
    if kinds & _CIRCLE and radius_m is not None:
        found.append(_circle(home_enu_m, radius_m))
    return Fence(
        areas=tuple(found),
        alternatives=alternatives,
        altitude_min_m=parameters.get("FENCE_ALT_MIN") if kinds & _ALTITUDE_MIN else None,
        altitude_max_m=parameters.get("FENCE_ALT_MAX") if kinds & _ALTITUDE_MAX else None,
    )


def _px4(
    parameters: Mapping[str, float], home_enu_m: Vector3 | None, areas: tuple[Area, ...]
) -> Fence | None:
    if "GF_ACTION" not in parameters:
        return None
    if not parameters["GF_ACTION"]:  # a breach has no consequence
        return NO_FENCE
    radius_m = parameters.get("GF_MAX_HOR_DIST", 0.0)
    height_m = parameters.get("GF_MAX_VER_DIST", 0.0)
    if (radius_m > 0.0 or height_m > 0.0) and home_enu_m is None:
        return None
    found, alternatives = _sorted(areas, union=True)
    if radius_m > 0.0 and home_enu_m is not None:
        found.append(_circle(home_enu_m, radius_m))
    return Fence(
        areas=tuple(found),
        alternatives=alternatives,
        altitude_max_m=height_m if height_m > 0.0 else None,
    )
