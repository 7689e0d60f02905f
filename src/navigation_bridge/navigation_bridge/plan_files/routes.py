"""Files of ground stations as waypoints of a route. No ROS.

`.plan` of QGroundControl and `QGC WPL`; the content decides. Each parameter of an item is honoured,
or rejected with its name; an item that a route cannot express is rejected, or left out with a note
where that does not change the path. Meanings: https://mavlink.io/en/messages/common.html#mav_commands
and ArduPilot's AP_Mission.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mavlink_vehicle.codec import mavlink
from navigation_bridge.goals.requests import ActKind, ActRequest, PointMode, WaypointRequest
from navigation_bridge.plan_files.act_items import ACT_ITEMS, act_of
from navigation_bridge.plan_files.items import (
    FRAME_REFERENCES,
    PlanError,
    PlanItem,
    command_name,
    read_plan_file,
)
from navigation_bridge.plan_files.qgroundcontrol import is_json, plan_document, plan_items
from navigation_bridge.plan_files.waypoint_lists import is_waypoint_list, parse_waypoint_rows

_WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
_LOITER_TIME = mavlink.MAV_CMD_NAV_LOITER_TIME
_LOITER_UNLIM = mavlink.MAV_CMD_NAV_LOITER_UNLIM
_DELAY = mavlink.MAV_CMD_NAV_DELAY
_SPEED = mavlink.MAV_CMD_DO_CHANGE_SPEED
_YAW = mavlink.MAV_CMD_CONDITION_YAW
_GATE = mavlink.MAV_CMD_CONDITION_GATE
_WAYPOINTS = frozenset({_WAYPOINT, _LOITER_TIME, _LOITER_UNLIM})
_ENDS = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH})
# Cameras and gimbals that no act expresses, and the gate that triggers one: the path is the same
# without them. The control of a gimbal is taken by the act that points it.
_LEFT_OUT = frozenset(
    {
        mavlink.MAV_CMD_DO_CONTROL_VIDEO,
        mavlink.MAV_CMD_DO_DIGICAM_CONFIGURE,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
        mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_DO_TRIGGER_CONTROL,
        mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
        mavlink.MAV_CMD_VIDEO_STOP_CAPTURE,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
        mavlink.MAV_CMD_SET_CAMERA_ZOOM,
        mavlink.MAV_CMD_SET_CAMERA_FOCUS,
        _GATE,
    }
)
_ADVICE = {
    mavlink.MAV_CMD_DO_JUMP: "remove it, and give --laps to repeat the route",
    _LOITER_UNLIM: "the vehicle would never leave it; end the route there",
}
# Parameters that a route does not have, by their numbers.
_NOT_IN_ROUTE: Mapping[int, Mapping[int, str]] = {
    _WAYPOINT: {3: "a pass radius"},
    _LOITER_TIME: {2: "a required heading", 3: "a loiter radius", 4: "an exit location"},
    _LOITER_UNLIM: {1: "param 1", 2: "param 2", 3: "a loiter radius"},
    _YAW: {2: "a turn rate", 3: "a turn direction", 4: "a relative angle"},
    _SPEED: {4: "a relative speed"},
}
_FENCE_AND_RALLY = {
    mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: "fence",
    mavlink.MAV_CMD_NAV_RALLY_POINT: "rally",
}
_AIRSPEED, _GROUND_SPEED = 0.0, 1.0
# A tenth of a metre.
_SAME_DEG = 1e-6
_UNCHANGED, _DEFAULT = -1.0, -2.0


@dataclass(frozen=True)
class PlannedRoute:
    """Content of a file.

    Attributes:
        waypoints: geodetic waypoints, in order.
        notes: sentences about what was left out.
    """

    waypoints: tuple[WaypointRequest, ...]
    notes: tuple[str, ...] = ()


def read_route(path: Path) -> PlannedRoute:
    """Read a `.plan` or `QGC WPL` file.

    Raises:
        PlanError: it is not one, or holds what a route does not have.
    """
    return read_plan_file(path, parse_route)


def parse_route(text: str) -> PlannedRoute:
    """Return the route of a file's text.

    Raises:
        PlanError: it is not one, or holds what a route does not have.
    """
    text = text.removeprefix("\ufeff")
    if not text.strip():
        raise PlanError("it is empty.")
    if is_json(text):
        items, notes, zero_is_north = plan_items(plan_document(text))
        return _route(items, notes, zero_is_north)
    if not is_waypoint_list(text) and text.startswith("RALLY"):
        raise PlanError("it has rally points; the command rally sends them.")
    rows = parse_waypoint_rows(text)
    notes = list(rows.notes)
    home = rows.home
    if home is not None and home.command in _FENCE_AND_RALLY:
        raise _not_a_route(home)
    if home is not None and home.command not in (0, _WAYPOINT):
        name = command_name(home.command)
        notes.append(f"{home.where}: row 0 is the planned home; {name} there is not flown.")
    return _route(rows.items, notes, zero_is_north=False)


def _route(items: Sequence[PlanItem], notes: list[str], zero_is_north: bool) -> PlannedRoute:
    maker = _RouteMaker(zero_is_north)
    for place, item in enumerate(items):
        maker.take(item, items[place + 1 :])
    maker.finish()
    return PlannedRoute(tuple(maker.waypoints), (*notes, *maker.notes))


class _RouteMaker:
    """Converts items one by one and carries state over to the following ones."""

    def __init__(self, zero_is_north: bool) -> None:
        self.waypoints: list[WaypointRequest] = []
        self.notes: list[str] = []
        self._zero_is_north = zero_is_north
        self._speed_m_s = 0.0
        self._yaw_deg = math.nan
        self._early_acts: list[tuple[PlanItem, ActRequest]] = []
        self._after_gate = False
        self._ended = False
        self._before_end: PlanItem | None = None
        self._left_out = 0
        self._changes: dict[int, Callable[[PlanItem], None]] = {
            _SPEED: self._change_speed,
            _YAW: self._turn,
            _DELAY: self._delay,
        }

    def finish(self) -> None:
        """Report skipped items, and reject an empty route."""
        if not self.waypoints:
            raise PlanError("it contains no waypoint.")
        if self._left_out:
            self.notes.append(f"{self._left_out} camera and gimbal items are skipped.")

    def take(self, item: PlanItem, following: Sequence[PlanItem]) -> None:
        """Convert an item; `following` are those after it."""
        command, name = item.command, command_name(item.command)
        is_last = not any(other.command in _WAYPOINTS for other in following)
        if command in _WAYPOINTS and (command != _LOITER_UNLIM or is_last):
            self._add_waypoint(item)
        elif command == mavlink.MAV_CMD_NAV_TAKEOFF and not self.waypoints:
            self._before_end = item
            height = f" to {item.params[6]:g} m" if math.isfinite(item.params[6]) else ""
            self.notes.append(
                f"{item.where}: take-off{height} skipped; on the ground the server takes off to "
                "takeoff_height_m."
            )
        elif command in _ENDS and is_last:
            self._end_with(item)
        elif is_last and self._is_without_effect(command):
            self.notes.append(f"{item.where}: {name} after the last waypoint is skipped.")
        elif command in _LEFT_OUT:
            self._after_gate = self._after_gate or command == _GATE
            self._left_out += 1
        elif command in ACT_ITEMS:
            self._add_act(item)
        elif command in self._changes:
            self._reject_unsupported(item)
            self._changes[command](item)
        elif command in _FENCE_AND_RALLY:
            raise _not_a_route(item)
        else:
            advice = f"; {_ADVICE[command]}" if command in _ADVICE else ""
            raise PlanError(f"{item.where}: {name} is not supported in a route{advice}.")
        if not item.autocontinue and not is_last:
            raise PlanError(
                f"{item.where}: {name} has autocontinue 0, so the vehicle would wait there for a "
                "command; set it to 1, or end the route there."
            )

    def _end_with(self, item: PlanItem) -> None:
        self._ended = True
        landing, name = self._waypoint_of_landing(item), command_name(item.command)
        if landing is not None:
            self._add_waypoint(landing)
        end = "is skipped" if landing is None else "is flown to, at the height before it"
        self.notes.append(f"{item.where}: {name} {end}; the vehicle holds at the end.")

    def _waypoint_of_landing(self, item: PlanItem) -> PlanItem | None:
        """Return a waypoint above a landing that has a place of its own; None for another end."""
        before, place = self._before_end, item.params[4:6]
        if item.command != mavlink.MAV_CMD_NAV_LAND or before is None:
            return None
        if not all(map(math.isfinite, place)) or place == (0.0, 0.0):
            return None  # where the vehicle is
        if math.dist(place, before.params[4:6]) < _SAME_DEG:
            return None
        params = (0.0, 0.0, 0.0, math.nan, *place, before.params[6])
        return replace(item, command=_WAYPOINT, frame=before.frame, params=params)

    def _add_waypoint(self, item: PlanItem) -> None:
        self._before_end = item
        self._reject_unsupported(item)
        reference = FRAME_REFERENCES.get(item.frame)
        if reference is None:
            text = f"MAV_FRAME {item.frame} is not supported for a waypoint"
            raise PlanError(f"{item.where}: {text}.")
        latitude_deg, longitude_deg, altitude_m = _position(item)
        first, second, _, fourth = item.params[:4]
        yaw_deg, stay_s, radius_m = self._yaw_deg, 0.0, 0.0
        if item.command != _LOITER_TIME and (fourth != 0.0 or self._zero_is_north):
            yaw_deg = _or(fourth, yaw_deg)
        if item.command != _LOITER_UNLIM:
            stay_s = _at_least_zero(item, first, "the hold time (param 1)")
        if item.command == _WAYPOINT:
            radius_m = _at_least_zero(item, second, "the acceptance radius (param 2)")
        if math.isinf(yaw_deg):
            raise PlanError(f"{item.where}: the heading (param 4) is {yaw_deg}.")
        self.waypoints.append(
            WaypointRequest(
                (latitude_deg, longitude_deg, altitude_m),
                reference,
                acceptance_radius_m=radius_m,
                hold_time_s=stay_s,
                yaw_enu_rad=math.radians(90.0 - yaw_deg) if math.isfinite(yaw_deg) else None,
                max_speed_m_s=self._speed_m_s,
            )
        )
        for early, act in self._early_acts:
            self._attach(early, act)
        self._early_acts.clear()
        self._yaw_deg, self._after_gate = math.nan, False

    def _add_act(self, item: PlanItem) -> None:
        """Add the act to the waypoint before it, or to the first one."""
        act = act_of(item)
        # At a gate, and after a landing or a return, it would be done elsewhere.
        if act is None or self._after_gate or self._ended:
            self._left_out += 1
            return
        if self.waypoints:
            self._attach(item, act)
            return
        name = command_name(item.command)
        self.notes.append(f"{item.where}: {name} is done at the first waypoint.")
        self._early_acts.append((item, act))

    def _attach(self, item: PlanItem, act: ActRequest) -> None:
        last = self.waypoints[-1]
        at_position = act.point is PointMode.POSITION
        if at_position and FRAME_REFERENCES.get(item.frame) is not last.altitude_reference:
            raise PlanError(
                f"{item.where}: its MAV_FRAME {item.frame} is not that of the waypoint, so that "
                "the altitudes differ; give both the same."
            )
        self.waypoints[-1] = replace(last, acts=(*last.acts, act))

    def _change_speed(self, item: PlanItem) -> None:
        """Take a speed; a copter of either firmware takes an airspeed as a ground speed, too."""
        kind, speed_m_s, throttle = item.params[:3]
        self._reject_after_gate(item)
        if kind not in (_AIRSPEED, _GROUND_SPEED):
            what = {2.0: "of the climb speed", 3.0: "of the descent speed"}.get(kind, "of a type")
            raise PlanError(
                f"{item.where}: DO_CHANGE_SPEED {what} (param 1 is {kind:g}) is not supported in a "
                "route; remove it, or set the vehicle's parameter."
            )
        if throttle > 0.0:
            raise PlanError(
                f"{item.where}: DO_CHANGE_SPEED with a throttle of {throttle:g} % (param 3) is not "
                "supported in a route; -1 leaves it unchanged."
            )
        if speed_m_s == _DEFAULT:
            self._speed_m_s = 0.0
        elif 0.0 < speed_m_s < math.inf:
            self._speed_m_s = speed_m_s
        elif speed_m_s != _UNCHANGED:
            raise PlanError(
                f"{item.where}: DO_CHANGE_SPEED to {speed_m_s:g} m/s (param 2) is not a speed; -1 "
                "leaves it unchanged, -2 means the default."
            )

    def _turn(self, item: PlanItem) -> None:
        self._reject_after_gate(item)
        if not math.isfinite(item.params[0]):
            raise PlanError(f"{item.where}: CONDITION_YAW has no angle (param 1).")
        self._yaw_deg = item.params[0]

    def _delay(self, item: PlanItem) -> None:
        stay_s = item.params[0]
        if not self.waypoints:
            raise PlanError(f"{item.where}: NAV_DELAY before the first waypoint is not supported.")
        if math.isfinite(self._yaw_deg):
            raise PlanError(f"{item.where}: NAV_DELAY after CONDITION_YAW is not supported.")
        if not 0.0 < stay_s < math.inf:
            raise PlanError(
                f"{item.where}: NAV_DELAY until a time of day (param 1 is {stay_s:g}) is not "
                "supported in a route."
            )
        last = self.waypoints[-1]
        if last.acts:
            wait = ActRequest(ActKind.WAIT, duration_s=stay_s)
            self.waypoints[-1] = replace(last, acts=(*last.acts, wait))
        else:
            self.waypoints[-1] = replace(last, hold_time_s=last.hold_time_s + stay_s)

    def _is_without_effect(self, command: int) -> bool:
        """Return whether a change after the last waypoint changes nothing of the route."""
        if command == _DELAY:
            return self._ended
        return command in (_SPEED, _YAW) and bool(self.waypoints)

    def _reject_after_gate(self, item: PlanItem) -> None:
        if self._after_gate:
            name = command_name(item.command)
            raise PlanError(f"{item.where}: {name} at a CONDITION_GATE is not supported.")

    def _reject_unsupported(self, item: PlanItem) -> None:
        for number, what in _NOT_IN_ROUTE.get(item.command, {}).items():
            value = item.params[number - 1]
            if value != 0.0 and not math.isnan(value):
                raise PlanError(
                    f"{item.where}: {command_name(item.command)} with {what} (param {number} is "
                    f"{value:g}) is not supported in a route; set it to 0."
                )


def _position(item: PlanItem) -> tuple[float, float, float]:
    latitude_deg, longitude_deg, altitude_m = item.params[4:7]
    if not (math.isfinite(latitude_deg) and math.isfinite(longitude_deg)):
        raise PlanError(f"{item.where}: the waypoint has no position.")
    if latitude_deg == 0.0 and longitude_deg == 0.0:
        raise PlanError(f"{item.where}: the waypoint is at 0, 0, which means no position.")
    if not abs(latitude_deg) <= 90.0 or not abs(longitude_deg) <= 180.0:
        raise PlanError(
            f"{item.where}: {latitude_deg:.9g}, {longitude_deg:.9g} is not a latitude and a "
            "longitude in degrees."
        )
    if not math.isfinite(altitude_m):
        raise PlanError(f"{item.where}: the waypoint has no altitude.")
    return latitude_deg, longitude_deg, altitude_m


def _at_least_zero(item: PlanItem, value: float, what: str) -> float:
    if value < 0.0 or math.isinf(value):
        raise PlanError(f"{item.where}: {what} is {value:g}; give 0 or more.")
    return _or(value, 0.0)


def _or(value: float, other: float) -> float:
    return other if math.isnan(value) else value


def _not_a_route(item: PlanItem) -> PlanError:
    name = command_name(item.command)
    command = _FENCE_AND_RALLY[item.command]
    return PlanError(
        f"{item.where}: {name} is not part of a route; the command {command} sends it."
    )
