"""Fence and rally points of a QGroundControl `.plan` file. No ROS.

Format: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html, "GeoFence"
and "Rally Points". Rally points are above home.
"""

from __future__ import annotations

from collections.abc import Mapping

from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.plan_files.qgroundcontrol import members_of
from navigation_bridge.storage.geographic import Degrees, GeoArea, GeoFence, RallyPoint

_VERSION = 2


def plan_fence(document: Mapping[str, object]) -> GeoFence:
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


def plan_rally(document: Mapping[str, object]) -> tuple[RallyPoint, ...]:
    """Return the rally points of a plan.

    Raises:
        PlanError: it has none, or they are not described as they should be.
    """
    part = _part(document, "rallyPoints")
    points = []
    try:
        for entry in _list(part, "points"):
            latitude_deg, longitude_deg, *altitudes_m = _numbers(entry, "a rally point", 3)
            if not altitudes_m:
                raise PlanError("a rally point has no altitude.")
            points.append(RallyPoint((latitude_deg, longitude_deg), altitudes_m[0]))
    except PlanError as error:
        raise PlanError(f"rallyPoints: {error}") from None
    if not points:
        raise PlanError("The plan has no rally points.")
    return tuple(points)


def _part(document: Mapping[str, object], key: str) -> Mapping[str, object]:
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


def _list(part: Mapping[str, object], key: str) -> list[object]:
    entries = part.get(key, [])
    if not isinstance(entries, list):
        raise PlanError(f"{key} is not a list.")
    return entries


def _polygon(entry: object) -> GeoArea:
    corners = members_of(entry).get("polygon")
    if not isinstance(corners, list):
        raise PlanError("a polygon has no corners.")
    places_deg = tuple(_place(corner, "a corner", 2) for corner in corners)
    return GeoArea(places_deg, None, _inclusion(entry))


def _circle(entry: object) -> GeoArea:
    circle = members_of(entry).get("circle")
    if not isinstance(circle, dict):
        raise PlanError("a circle has no centre.")
    radius_m = _number(circle.get("radius"))
    if radius_m is None:
        raise PlanError(f"the radius {circle.get('radius')!r} is not a number.")
    place_deg = _place(circle.get("center"), "the centre of a circle", 2)
    return GeoArea((place_deg,), radius_m, _inclusion(entry))


def _inclusion(entry: object) -> bool:
    inclusion = members_of(entry).get("inclusion")
    if not isinstance(inclusion, bool):
        raise PlanError("an area does not say whether it is an inclusion.")
    return inclusion


def _place(value: object, what: str, most: int) -> Degrees:
    latitude_deg, longitude_deg, *_ = _numbers(value, what, most)
    return latitude_deg, longitude_deg


def _numbers(value: object, what: str, most: int) -> list[float]:
    """Return the numbers of a list of two, or up to `most`."""
    found = [_number(each) for each in value] if isinstance(value, list) else []
    numbers = [number for number in found if number is not None]
    if not 2 <= len(numbers) == len(found) <= most:
        raise PlanError(f"{what}, {value!r}, is not a latitude and a longitude.")
    return numbers


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e300:
        return None
    return float(value)
