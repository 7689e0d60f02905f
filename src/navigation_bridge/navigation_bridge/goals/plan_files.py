"""QGroundControl `.plan` and `QGC WPL 110` files as waypoints of a route. No ROS.

Formats: https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html and
https://mavlink.io/en/file_formats/. Items that a route cannot express are rejected with a sentence,
or left out with a note where that does not change the path.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from mavlink_vehicle.codec import mavlink
from navigation_bridge.configuration.text_files import read_text
from navigation_bridge.goals.requests import AltitudeReference, WaypointRequest

_WPL_HEADER = "QGC WPL 110"
_WPL_COLUMNS = 12
_PX4 = mavlink.MAV_AUTOPILOT_PX4
FRAME_REFERENCES = {
    mavlink.MAV_FRAME_GLOBAL: AltitudeReference.AMSL,
    mavlink.MAV_FRAME_GLOBAL_INT: AltitudeReference.AMSL,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: AltitudeReference.HOME,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: AltitudeReference.HOME,
    mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT: AltitudeReference.GROUND,
    mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: AltitudeReference.GROUND,
}
_WAYPOINTS = frozenset({mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LOITER_TIME})
_ENDS = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH})
# Cameras and gimbals: the path is the same without them.
_LEFT_OUT = frozenset(
    {
        mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
        mavlink.MAV_CMD_DO_DIGICAM_CONFIGURE,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
        mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
        mavlink.MAV_CMD_VIDEO_STOP_CAPTURE,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
    }
)


class PlanError(ValueError):
    """A file cannot be used as a route; the message names the item or line and the reason."""


@dataclass(frozen=True)
class PlannedRoute:
    """Content of a file.

    Attributes:
        waypoints: geodetic waypoints, in order.
        notes: sentences about what was left out.
    """

    waypoints: tuple[WaypointRequest, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Item:
    """One item: `where` for sentences; params are param1 to param7, NaN where there is none."""

    where: str
    command: int
    frame: int
    params: tuple[float, ...]


class _Reader(Protocol):
    def __call__(self, text: str) -> tuple[list[_Item], list[str], bool]:
        """Return the items, notes, and whether a heading of 0 is meant as such."""


def read_plan(path: Path) -> PlannedRoute:
    """Read a `.plan` file.

    Raises:
        PlanError: it is not one, or holds what a route does not have.
    """
    return _read(path, _plan_items)


def read_waypoints(path: Path) -> PlannedRoute:
    """Read a `QGC WPL 110` file.

    Raises:
        PlanError: it is not one, or holds what a route does not have.
    """
    return _read(path, _wpl_items)


def plan_document(path: Path) -> dict[str, Any]:
    """Return the JSON object of a `.plan` file.

    Raises:
        PlanError: it is not one.
    """
    text = read_text(path, PlanError, "utf-8-sig")
    try:
        return _document(text)
    except PlanError as error:
        raise PlanError(f"{path}: {error}") from None


def _read(path: Path, reader: _Reader) -> PlannedRoute:
    text = read_text(path, PlanError, "utf-8-sig")
    try:
        return _parse(text, reader)
    except PlanError as error:
        raise PlanError(f"{path}: {error}") from None


def parse_plan(text: str) -> PlannedRoute:
    """Return the route of a `.plan` file's text.

    Raises:
        PlanError: it is not one, or holds what a route does not have.
    """
    return _parse(text, _plan_items)


def _parse(text: str, reader: _Reader) -> PlannedRoute:
    items, notes, zero_is_north = reader(text)
    maker = _RouteMaker(zero_is_north)
    for place, item in enumerate(items):
        maker.take(item, items[place + 1 :])
    maker.finish()
    return PlannedRoute(tuple(maker.waypoints), (*notes, *maker.notes))


# --- the two formats ------------------------------------------------------------------


def _document(text: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:  # also a number with thousands of digits
        line = f"line {error.lineno}: " if isinstance(error, json.JSONDecodeError) else ""
        raise PlanError(f"{line}not valid JSON.") from None
    mission = document.get("mission") if isinstance(document, dict) else None
    if not isinstance(mission, dict) or document.get("fileType") != "Plan":
        raise PlanError("not a QGroundControl plan (fileType 'Plan' with a mission).")
    assert isinstance(document, dict)
    return document


def _plan_items(text: str) -> tuple[list[_Item], list[str], bool]:
    document = _document(text)
    mission = document["mission"]
    entries = mission.get("items")
    if not isinstance(entries, list):
        raise PlanError("the mission has no item list.")
    notes = []
    for key, what, command in (
        ("geoFence", ("polygons", "circles"), "fence"),
        ("rallyPoints", ("points",), "rally"),
    ):
        part = document.get(key)
        if isinstance(part, dict) and any(part.get(name) for name in what):
            text = f"The plan's {key} is not sent to the vehicle; the command {command} does that."
            notes.append(text)
    items: list[_Item] = []
    for number, entry in enumerate(entries, start=1):
        items += _entry(entry, f"item {number}")
    return items, notes, mission.get("firmwareType") == _PX4


def _entry(entry: Any, where: str) -> Iterator[_Item]:
    if not isinstance(entry, dict):
        raise PlanError(f"{where} is not an object.")
    if entry.get("type") == "SimpleItem":
        yield _simple(entry, where)
        return
    if entry.get("type") != "ComplexItem":
        raise PlanError(f"{where} is a {entry.get('type')!r}; only SimpleItem is supported.")
    name = entry.get("complexItemType")
    transects = entry.get("TransectStyleComplexItem")
    inner = transects.get("Items") if isinstance(transects, dict) else None
    if not isinstance(inner, list) or not inner:
        raise PlanError(
            f"{where} is a complex item ({name}) without its waypoints; open the plan in "
            "QGroundControl and save it again, or convert it to simple items."
        )
    for place, item in enumerate(inner, start=1):
        inside = f"{where} ({name}), its item {place}"
        if not isinstance(item, dict) or item.get("type") != "SimpleItem":
            raise PlanError(f"{inside} is not a SimpleItem.")
        yield _simple(item, inside)


def _simple(entry: dict[str, Any], where: str) -> _Item:
    command, frame, params = entry.get("command"), entry.get("frame"), entry.get("params")
    if type(command) is not int or type(frame) is not int:
        raise PlanError(f"{where}: command and frame must be integers.")
    if not isinstance(params, list) or len(params) != 7:
        raise PlanError(f"{where} does not have seven params.")
    values = []
    for number, value in enumerate(params, start=1):
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
            raise PlanError(f"{where}: param {number} is {value!r}, not a number.")
        try:
            values.append(math.nan if value is None else float(value))
        except OverflowError:
            raise PlanError(f"{where}: param {number} is too large.") from None
    return _Item(where, command, frame, tuple(values))


def _wpl_items(text: str) -> tuple[list[_Item], list[str], bool]:
    lines = text.splitlines()
    if not lines or lines[0].strip() != _WPL_HEADER:
        raise PlanError(f"line 1: a waypoint file must begin with {_WPL_HEADER!r}.")
    items = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip() or line.startswith("#"):
            continue
        cells = line.split()
        if len(cells) != _WPL_COLUMNS:
            raise PlanError(f"line {number}: {len(cells)} columns instead of {_WPL_COLUMNS}.")
        try:
            index, frame, command = int(cells[0]), int(cells[2]), int(cells[3])
            params = tuple(float(cell) for cell in cells[4:11])
        except ValueError as error:
            raise PlanError(f"line {number}: {error}.") from None
        is_home = index == 0 and frame == 0 and command == mavlink.MAV_CMD_NAV_WAYPOINT
        if not is_home:
            items.append(_Item(f"line {number}", command, frame, params))
    return items, [], False


# --- items as waypoints ---------------------------------------------------------------


class _RouteMaker:
    """Converts items one by one and carries state over to the following ones."""

    def __init__(self, zero_is_north: bool) -> None:
        self.waypoints: list[WaypointRequest] = []
        self.notes: list[str] = []
        self._zero_is_north = zero_is_north
        self._speed_m_s = 0.0
        self._yaw_deg = math.nan
        self._left_out = 0

    def finish(self) -> None:
        """Report skipped items, and reject an empty route."""
        if not self.waypoints:
            raise PlanError("it contains no waypoint.")
        if self._left_out:
            self.notes.append(f"{self._left_out} camera and gimbal items are skipped.")

    def take(self, item: _Item, following: list[_Item]) -> None:
        """Convert an item; `following` are those after it."""
        command = item.command
        if command in _WAYPOINTS:
            self.waypoints.append(
                _waypoint(item, self._speed_m_s, self._yaw_deg, self._zero_is_north)
            )
            self._yaw_deg = math.nan
        elif command == mavlink.MAV_CMD_NAV_TAKEOFF and not self.waypoints:
            self.notes.append(f"{item.where}: take-off skipped; the server does it if needed.")
        elif command in _ENDS and not any(other.command in _WAYPOINTS for other in following):
            text = f"{item.where}: {_name(command)} is skipped; the vehicle holds at the end."
            self.notes.append(text)
        elif command in _LEFT_OUT:
            self._left_out += 1
        else:
            self._take_change(item)

    def _take_change(self, item: _Item) -> None:
        first, second, _, fourth = item.params[:4]
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            self._speed_m_s = max(_finite(second), 0.0)
        elif item.command == mavlink.MAV_CMD_CONDITION_YAW and _finite(fourth) == 0.0:
            self._yaw_deg = first
        elif item.command == mavlink.MAV_CMD_NAV_DELAY and self.waypoints:
            last = self.waypoints[-1]
            stay_s = last.hold_time_s + max(_finite(first), 0.0)
            self.waypoints[-1] = replace(last, hold_time_s=stay_s)
        else:
            name = _name(item.command)
            raise PlanError(f"{item.where}: {name} is not supported in a route.")


def _waypoint(
    item: _Item, speed_m_s: float, yaw_deg: float, zero_is_north: bool
) -> WaypointRequest:
    reference = FRAME_REFERENCES.get(item.frame)
    if reference is None:
        raise PlanError(f"{item.where}: MAV_FRAME {item.frame} is not supported for a waypoint.")
    latitude_deg, longitude_deg, altitude_m = item.params[4:7]
    if not all(math.isfinite(value) for value in item.params[4:7]):
        raise PlanError(f"{item.where}: the waypoint has no position.")
    if latitude_deg == 0.0 and longitude_deg == 0.0:
        raise PlanError(f"{item.where}: the waypoint is at 0, 0, which means no position.")
    own_deg = item.params[3]
    is_waypoint = item.command == mavlink.MAV_CMD_NAV_WAYPOINT
    if is_waypoint and math.isfinite(own_deg) and (own_deg != 0.0 or zero_is_north):
        yaw_deg = own_deg
    radius_m = _finite(item.params[1]) if is_waypoint else 0.0
    return WaypointRequest(
        (latitude_deg, longitude_deg, altitude_m),
        reference,
        acceptance_radius_m=max(radius_m, 0.0),
        hold_time_s=max(_finite(item.params[0]), 0.0),
        yaw_enu_rad=math.radians(90.0 - yaw_deg) if math.isfinite(yaw_deg) else None,
        max_speed_m_s=speed_m_s,
    )


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _name(command: int) -> str:
    entry = mavlink.enums["MAV_CMD"].get(command)
    return str(entry.name.removeprefix("MAV_CMD_")) if entry else f"MAV_CMD {command}"
