"""Fence and rally points of a QGroundControl `.plan` file. No ROS.

Format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html, "GeoFence"
and "Rally Points". Rally points are above home.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from navigation_bridge.goals.plan_files import PlanError, plan_document
from navigation_bridge.storage.geographic import (
    Degrees,
    GeoArea,
    GeoFence,
    RallyPoint,
    fence_problem,
    rally_problem,
)

_VERSION = 2


def read_plan_fence(path: Path) -> GeoFence:
    """Return the fence of a `.plan` file.

    Raises:
        PlanError: it is not one, has no fence, or the fence cannot be sent.
    """
    part = _part(path, "geoFence")
    try:
        areas = [_polygon(entry) for entry in _list(part, "polygons")]
        areas += [_circle(entry) for entry in _list(part, "circles")]
        given = part.get("breachReturn")
        return_point_deg = None if not given else _place(given, "breachReturn", 3)
        fence = GeoFence(tuple(areas), return_point_deg)
        problem = "The plan has no fence." if not areas else fence_problem(fence)
    except PlanError as error:
        problem = f"geoFence: {error}"
    if problem is not None:
        raise PlanError(f"{path}: {problem}")
    return fence


def read_plan_rally(path: Path) -> tuple[RallyPoint, ...]:
    """Return the rally points of a `.plan` file.

    Raises:
        PlanError: it is not one, has no rally points, or they cannot be sent.
    """
    part = _part(path, "rallyPoints")
    try:
        points = []
        for entry in _list(part, "points"):
            place_deg = _place(entry, "a rally point", 3)
            if len(entry) != 3:
                raise PlanError("a rally point has no altitude.")
            points.append(RallyPoint(place_deg, float(entry[2])))
        problem = rally_problem(points) if points else "The plan has no rally points."
    except PlanError as error:
        problem = f"rallyPoints: {error}"
    if problem is not None:
        raise PlanError(f"{path}: {problem}")
    return tuple(points)


def _part(path: Path, key: str) -> dict[str, Any]:
    document = plan_document(path)
    part = document.get(key, {})
    if not isinstance(part, dict):
        raise PlanError(f"{path}: {key} is not an object.")
    version = part.get("version", _VERSION)
    if version != _VERSION:
        raise PlanError(
            f"{path}: {key} has version {version!r}, not {_VERSION}; open the plan in "
            "QGroundControl and save it again."
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
