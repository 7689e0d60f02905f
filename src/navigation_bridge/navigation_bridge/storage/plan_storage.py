"""Fence and rally points of a QGroundControl `.plan` file. No ROS.

Format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html, "GeoFence"
and "Rally Points". Rally points are above home.
"""

from __future__ import annotations

from typing import Any

from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.storage.geographic import Degrees, GeoArea, GeoFence, RallyPoint

_VERSION = 2


def plan_fence(document: dict[str, Any]) -> GeoFence:
    """Return the fence of a plan.

    Raises:
        PlanError: it has none, or the fence is not described as it should be.
    """
    part = _part(document, "geoFence")
    try:
        areas = [_polygon(entry) for entry in _list(part, "polygons")]
        areas += [_circle(entry) for entry in _list(part, "circles")]
        given = part.get("breachReturn")
        return_point_deg = None if not given else _place(given, "breachReturn", 3)
    except PlanError as error:
        raise PlanError(f"geoFence: {error}") from None
    if not areas:
        raise PlanError("The plan has no fence.")
    return GeoFence(tuple(areas), return_point_deg)


def plan_rally(document: dict[str, Any]) -> tuple[RallyPoint, ...]:
    """Return the rally points of a plan.

    Raises:
        PlanError: it has none, or they are not described as they should be.
    """
    part = _part(document, "rallyPoints")
    points = []
    try:
        for entry in _list(part, "points"):
            place_deg = _place(entry, "a rally point", 3)
            if len(entry) != 3:
                raise PlanError("a rally point has no altitude.")
            points.append(RallyPoint(place_deg, float(entry[2])))
    except PlanError as error:
        raise PlanError(f"rallyPoints: {error}") from None
    if not points:
        raise PlanError("The plan has no rally points.")
    return tuple(points)


def _part(document: dict[str, Any], key: str) -> dict[str, Any]:
    part = document.get(key, {})
    if not isinstance(part, dict):
        raise PlanError(f"{key} is not an object.")
    version = part.get("version", _VERSION)
    if version != _VERSION:
        raise PlanError(
            f"{key} has version {version!r}, not {_VERSION}; open the plan in QGroundControl and "
            "save it again."
        )
    return part


def _list(part: dict[str, Any], key: str) -> list[Any]:
    entries = part.get(key, [])
    if not isinstance(entries, list):
        raise PlanError(f"{key} is not a list.")
    return entries


def _polygon(entry: Any) -> GeoArea:
    corners = entry.get("polygon") if isinstance(entry, dict) else None
    if not isinstance(corners, list):
        raise PlanError("a polygon has no corners.")
    places_deg = tuple(_place(corner, "a corner", 2) for corner in corners)
    return GeoArea(places_deg, None, _inclusion(entry))


def _circle(entry: Any) -> GeoArea:
    circle = entry.get("circle") if isinstance(entry, dict) else None
    if not isinstance(circle, dict):
        raise PlanError("a circle has no centre.")
    radius_m = circle.get("radius")
    if not isinstance(radius_m, (int, float)) or not _is_number(radius_m):
        raise PlanError(f"the radius {radius_m!r} is not a number.")
    place_deg = _place(circle.get("center"), "the centre of a circle", 2)
    return GeoArea((place_deg,), float(radius_m), _inclusion(entry))


def _inclusion(entry: dict[str, Any]) -> bool:
    inclusion = entry.get("inclusion")
    if not isinstance(inclusion, bool):
        raise PlanError("an area does not say whether it is an inclusion.")
    return inclusion


def _place(value: Any, what: str, most: int) -> Degrees:
    fits = isinstance(value, list) and 2 <= len(value) <= most
    if not fits or not all(_is_number(number) for number in value):
        raise PlanError(f"{what}, {value!r}, is not a latitude and a longitude.")
    return float(value[0]), float(value[1])


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return abs(value) < 1e300
