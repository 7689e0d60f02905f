"""Fences and rally points in files of ground stations; the content decides on the format. No ROS.

- `.plan` of QGroundControl (`plan_storage.py`);
- `QGC WPL` with the items of a fence or rally points, of MAVProxy and Mission Planner. A first row
  with another command is the planned home;
- `.fen`, and MAVProxy's older fence files: a latitude and a longitude a line. The first is the
  return point, the last repeats the second (MissionItemProtocol_Fence in pymavlink);
- `.poly` of Mission Planner: the same without the return point;
- `.ral`, and MAVProxy's older rally files: RALLY, latitude, longitude, altitude above home, break
  altitude, landing direction, flags.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from mavlink_vehicle.mission_items import MissionItem
from navigation_bridge.plan_files.items import (
    FRAME_REFERENCES,
    PlanError,
    PlanItem,
    command_name,
    decimal,
    read_plan_file,
)
from navigation_bridge.plan_files.qgroundcontrol import is_json, plan_document
from navigation_bridge.plan_files.waypoint_lists import (
    content_lines,
    is_waypoint_list,
    parse_waypoint_rows,
)
from navigation_bridge.storage.geographic import (
    FENCE_COMMANDS,
    POLYGON_COMMANDS,
    RALLY_COMMANDS,
    RETURN_COMMAND,
    Degrees,
    GeoArea,
    GeoFence,
    RallyPoint,
    fence_of_items,
    fence_problem,
    point_item,
    rally_of_items,
    rally_problem,
)
from navigation_bridge.storage.plan_storage import plan_fence, plan_rally

_DRAWN_POLYGON, _OLD_FENCE = ".poly", ".fen"
# A return point, three corners, and the first of these again.
_OLD_FENCE_LEAST = 5
_RALLY_COLUMNS = 7
# Larger numbers, and those that are not finite, are no position.
_NUMBER_MAX = 1e9
# Files have seven digits at most: 1 cm.
_SAME_PLACE_DEG = 1e-7


@dataclass(frozen=True)
class FenceFile:
    """A fence of a file that can be sent, and sentences about what was left out."""

    fence: GeoFence
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class RallyFile:
    """Rally points of a file that can be sent, and sentences about what was left out."""

    points: tuple[RallyPoint, ...]
    notes: tuple[str, ...] = ()


def read_fence(path: Path) -> FenceFile:
    """Read the fence of a file.

    Raises:
        PlanError: it has none, or one that cannot be sent.
    """
    return read_plan_file(path, partial(_parse_fence, suffix=path.suffix.lower()))


def read_rally(path: Path) -> RallyFile:
    """Read the rally points of a file.

    Raises:
        PlanError: it has none, or such that cannot be sent.
    """
    return read_plan_file(path, _parse_rally)


def _parse_fence(text: str, suffix: str) -> FenceFile:
    if is_json(text):
        file = FenceFile(plan_fence(plan_document(text)))
    elif is_waypoint_list(text):
        items, notes = _rows(text, FENCE_COMMANDS, "fence")
        file = FenceFile(_fence_of(items), notes)
    else:
        file = _fence_of_places(text, suffix)
    problem = fence_problem(file.fence)
    if problem is not None:
        raise PlanError(problem)
    return file


def _parse_rally(text: str) -> RallyFile:
    if is_json(text):
        file = RallyFile(plan_rally(plan_document(text)))
    elif is_waypoint_list(text):
        items, notes = _rows(text, RALLY_COMMANDS, "rally")
        file = RallyFile(rally_of_items([_item(item) for item in items]), notes)
    else:
        file = _rally_of_lines(text)
    problem = rally_problem(file.points)
    if problem is not None:
        raise PlanError(problem)
    return file


# --- QGC WPL ---------------------------------------------------------------------------


def _rows(
    text: str, commands: frozenset[int], name: str
) -> tuple[tuple[PlanItem, ...], tuple[str, ...]]:
    """Return the rows with these commands; the planned home may stand before them."""
    rows = parse_waypoint_rows(text, home_first=False)
    items = rows.items
    if rows.home is not None and rows.home.command in FENCE_COMMANDS | RALLY_COMMANDS:
        items = (rows.home, *items)
    for item in items:
        if item.command not in commands:
            other = "fence" if item.command in FENCE_COMMANDS else "rally"
            advice = (
                f"; the command {other} sends it"
                if item.command in FENCE_COMMANDS | RALLY_COMMANDS
                else ""
            )
            what = command_name(item.command)
            raise PlanError(f"{item.where}: {what} is not part of a {name} list{advice}.")
        if item.frame not in FRAME_REFERENCES:
            raise PlanError(f"{item.where}: MAV_FRAME {item.frame} is not supported here.")
        if not all(abs(value) < _NUMBER_MAX for value in item.params[4:7]):
            raise PlanError(f"{item.where}: it has no position.")
    if not items:
        raise PlanError(f"it contains no {name} items.")
    return items, rows.notes


def _fence_of(items: Sequence[PlanItem]) -> GeoFence:
    left = list(items)
    while left:
        del left[: _corners(left) if left[0].command in POLYGON_COMMANDS else 1]
    returns = [item for item in items if item.command == RETURN_COMMAND]
    if len(returns) > 1:
        raise PlanError(f"{returns[1].where}: a second return point.")
    return fence_of_items([_item(item) for item in items])


def _corners(items: Sequence[PlanItem]) -> int:
    """Return how many of the items are the corners of the polygon that begins here."""
    first = items[0]
    count = first.params[0]
    if not 1.0 <= count <= len(items) or not count.is_integer():
        raise PlanError(
            f"{first.where}: the polygon has {count:g} corners (param 1), but {len(items)} items "
            "are left."
        )
    corners = items[: int(count)]
    for corner in corners:
        if (corner.command, corner.params[0]) != (first.command, count):
            raise PlanError(
                f"{corner.where}: it is not a corner of the polygon of {count:g} that begins in "
                f"{first.where}."
            )
    return len(corners)


def _item(item: PlanItem) -> MissionItem:
    latitude_deg, longitude_deg, altitude_m = item.params[4:7]
    place_deg = (latitude_deg, longitude_deg)
    return point_item(item.command, item.frame, place_deg, item.params[0], altitude_m)


# --- lines of places -------------------------------------------------------------------


def _fence_of_places(text: str, suffix: str) -> FenceFile:
    places_deg: list[Degrees] = []
    for number, line in content_lines(text):
        where, cells = f"line {number}", line.split()
        if len(cells) != 2:
            raise PlanError(
                f"{where}: {len(cells)} columns; a latitude and a longitude are expected, a .plan, "
                "or a file that begins with 'QGC WPL 110'."
            )
        latitude_deg, longitude_deg = (
            decimal(cell, where, what)
            for cell, what in zip(cells, ("the latitude", "the longitude"), strict=True)
        )
        places_deg.append((latitude_deg, longitude_deg))
    if not places_deg:
        raise PlanError("it contains no fence.")
    notes = (f"The polygon of {suffix} becomes an inclusion.",) if suffix == _DRAWN_POLYGON else ()
    if suffix != _OLD_FENCE and _same(places_deg[0], places_deg[-1]):
        return FenceFile(GeoFence((GeoArea(tuple(places_deg[:-1])),)), notes)
    if suffix == _DRAWN_POLYGON:
        return FenceFile(GeoFence((GeoArea(tuple(places_deg)),)), notes)
    if len(places_deg) >= _OLD_FENCE_LEAST and _same(places_deg[1], places_deg[-1]):
        return FenceFile(GeoFence((GeoArea(tuple(places_deg[1:-1])),), places_deg[0]))
    raise PlanError(
        "its polygon is not closed: the first line is the return point, and the last one repeats "
        "the second; a polygon alone has a name that ends in .poly."
    )


def _same(one_deg: Degrees, other_deg: Degrees) -> bool:
    return all(
        math.isclose(a, b, rel_tol=0.0, abs_tol=_SAME_PLACE_DEG)
        for a, b in zip(one_deg, other_deg, strict=True)
    )


def _rally_of_lines(text: str) -> RallyFile:
    points, left_out = [], 0
    for number, line in content_lines(text):
        where, cells = f"line {number}", line.split()
        if cells[0].upper() != "RALLY" or len(cells) != _RALLY_COLUMNS:
            raise PlanError(
                f"{where}: it is not RALLY with six numbers; rally points stand in such lines, in "
                "a .plan, or in a file that begins with 'QGC WPL 110'."
            )
        numbers = [
            decimal(cell, where, f"number {place}") for place, cell in enumerate(cells[1:], start=1)
        ]
        latitude_deg, longitude_deg, altitude_m, *rest, flags = numbers
        if flags != 0.0:
            raise PlanError(
                f"{where}: the flags of a rally point, {flags:g}, cannot be sent; set them to 0."
            )
        left_out += any(rest)
        points.append(RallyPoint((latitude_deg, longitude_deg), altitude_m))
    if not points:
        raise PlanError("it contains no rally points.")
    text = f"Break altitudes and landing directions of {left_out} rally points are left out."
    return RallyFile(tuple(points), (text,) if left_out else ())
