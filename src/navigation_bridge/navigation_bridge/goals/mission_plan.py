"""A route as mission items, and the vehicle's progress reports about them. No ROS."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import (
    AMSL,
    NO_FRAME,
    RELATIVE_ALT,
    TERRAIN_ALT,
    MissionItem,
    MissionRules,
)
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles import CommandAltitude, Profile, VehicleKind
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.goals.act_commands import stored_commands_of
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.waypoint_acts import PointPosition, WaitHere, WaypointAct
from navigation_core.tasks.observation import MissionReport
from navigation_core.tasks.waypoint import MissionPlan, RouteWaypoint

_GROUND_SPEED = 1.0
# Minimum climb of a plane; TKOFF_LVL_PITCH and the like are the vehicle's own.
_PLANE_PITCH_DEG = 12.0
# An ArduPlane stores radii in one byte.
_RADIUS_MAX_M = 255.0
_NO_YAW = math.nan
# An ArduCopter does one act in each of its turns while it flies to the next waypoint, or holds
# there. Observed: of four behind the last waypoint one was done, also with a waypoint behind them
# that it reached at once.
_ACTS_S = 2.0


@dataclass(frozen=True)
class PlannedItem:
    """One item, and the number from 0 of the waypoint that it leads to."""

    item: MissionItem
    waypoint: int


def plan_items(
    plan: MissionPlan,
    profile: Profile,
    rules: MissionRules,
    map_frame: MapFrame,
    state: VehicleState,
) -> tuple[PlannedItem, ...]:
    """Convert a plan to mission items for the vehicle's firmware and kind.

    By profile and rules: heights above home, or above sea level where home moves in flight; a
    heading as a separate item; a hold as loitering for vehicles that cannot stand still; the acts
    behind their waypoint. Home is not among the items.
    """
    return tuple(_Writer(plan, profile, rules, map_frame, state).items())


class _Writer:
    def __init__(
        self,
        plan: MissionPlan,
        profile: Profile,
        rules: MissionRules,
        map_frame: MapFrame,
        state: VehicleState,
    ) -> None:
        self._plan = plan
        self._rules = rules
        self._map_frame = map_frame
        self._equipment = profile.equipment
        self._plane = profile.kind is VehicleKind.PLANE
        self._ground_enu_m = map_frame.ground_enu_m(state)
        above_home = profile.altitude_reference is CommandAltitude.HOME
        self._home_amsl_m = state.home.altitude_amsl_m if above_home and state.home else None

    def items(self) -> Iterator[PlannedItem]:
        yield from self._takeoff()
        speed_m_s: float | None = None
        for index, waypoint in enumerate(self._plan.waypoints):
            wanted_m_s = waypoint.max_speed_m_s or self._plan.speed_m_s
            if wanted_m_s is not None and wanted_m_s != speed_m_s:
                speed_m_s = wanted_m_s
                yield PlannedItem(_speed(wanted_m_s, airspeed=self._plane), index)
            if waypoint.yaw_enu_rad is not None and self._rules.yaw_command:
                yield PlannedItem(_turn(waypoint.yaw_enu_rad), index)
            yield PlannedItem(self._waypoint(waypoint), index)
            for act in waypoint.acts:
                yield from (PlannedItem(item, index) for item in self._act(waypoint, act))
        if self._plan.circle_at_end:
            last = self._plan.waypoints[-1]
            item = self._at(last, mavlink.MAV_CMD_NAV_LOITER_UNLIM, (0.0, 0.0, 0.0, _NO_YAW))
            yield PlannedItem(item, len(self._plan.waypoints))
        elif self._plan.waypoints[-1].acts and self._equipment.open_end:
            again = replace(self._plan.waypoints[-1], hold_time_s=_ACTS_S)
            yield PlannedItem(self._waypoint(again), len(self._plan.waypoints) - 1)

    def _act(self, waypoint: RouteWaypoint, act: WaypointAct) -> Iterator[MissionItem]:
        if isinstance(act.act, WaitHere) and self._plane:
            # It cannot stand, and flies on in a delay.
            yield self._waypoint(replace(waypoint, hold_time_s=act.act.time_s))
            return
        for command in stored_commands_of(act.act, self._equipment, self._map_frame):
            params = (*command.params, *([0.0] * (7 - len(command.params))))
            first, second, third, fourth, x, y, z = params
            four = (first, second, third, fourth)
            if isinstance(act.act, PointPosition):
                yield self._item(act.act.position_enu_m, command.command, four)
            else:
                yield MissionItem(command.command, NO_FRAME, four, round(x), round(y), z)

    def _takeoff(self) -> Iterator[PlannedItem]:
        start = self._plan.takeoff_from_enu_m
        if start is None:
            return
        # A plane takes off towards the first waypoint.
        place = self._plan.waypoints[0].position_enu_m if self._plane else start
        height_m = max(self._plan.takeoff_height_m, self._rules.takeoff_least_m)
        top = (place[0], place[1], self._ground_enu_m + height_m)
        pitch_deg = _PLANE_PITCH_DEG if self._plane else 0.0
        params = (pitch_deg, 0.0, 0.0, _NO_YAW)
        yield PlannedItem(self._item(top, mavlink.MAV_CMD_NAV_TAKEOFF, params), 0)

    def _waypoint(self, waypoint: RouteWaypoint) -> MissionItem:
        yaw = _NO_YAW
        if waypoint.yaw_enu_rad is not None:
            yaw = _compass_deg(waypoint.yaw_enu_rad)
        # ArduPilot stores whole seconds only.
        stay_s = float(math.ceil(waypoint.hold_time_s))
        if self._plane and stay_s > 0.0:
            params = (stay_s, 0.0, 0.0, 0.0)
            return self._at(waypoint, mavlink.MAV_CMD_NAV_LOITER_TIME, params)
        radius_m = min(waypoint.acceptance_radius_m, _RADIUS_MAX_M)
        if self._plane and self._rules.home_first:
            radius_m = float(math.ceil(radius_m))
        params = (stay_s, radius_m, 0.0, yaw)
        return self._at(waypoint, mavlink.MAV_CMD_NAV_WAYPOINT, params)

    def _at(
        self, waypoint: RouteWaypoint, command: int, params: tuple[float, float, float, float]
    ) -> MissionItem:
        item = self._item(waypoint.position_enu_m, command, params)
        height_m = waypoint.height_above_ground_m
        if height_m is None:
            return item
        return MissionItem(command, TERRAIN_ALT, params, item.x, item.y, height_m)

    def _item(
        self, position_enu_m: Vector3, command: int, params: tuple[float, float, float, float]
    ) -> MissionItem:
        latitude_deg, longitude_deg, altitude_m = self._map_frame.geodetic(position_enu_m)
        frame = AMSL
        if self._home_amsl_m is not None:
            frame, altitude_m = RELATIVE_ALT, altitude_m - self._home_amsl_m
        x, y = round(latitude_deg * 1e7), round(longitude_deg * 1e7)
        return MissionItem(command, frame, params, x, y, altitude_m)


def _speed(speed_m_s: float, *, airspeed: bool) -> MissionItem:
    kind = 0.0 if airspeed else _GROUND_SPEED
    return MissionItem(mavlink.MAV_CMD_DO_CHANGE_SPEED, NO_FRAME, (kind, speed_m_s, -1.0, 0.0))


def _turn(yaw_enu_rad: float) -> MissionItem:
    params = (_compass_deg(yaw_enu_rad), 0.0, 0.0, 0.0)
    return MissionItem(mavlink.MAV_CMD_CONDITION_YAW, NO_FRAME, params)


def _compass_deg(yaw_enu_rad: float) -> float:
    return math.degrees(frames.yaw_enu_to_ned(yaw_enu_rad)) % 360.0


class MissionTracker:
    """Tracks the vehicle's progress reports about the mission uploaded last."""

    def __init__(self, items: tuple[PlannedItem, ...], rules: MissionRules) -> None:
        """Track these items, numbered as the vehicle numbers them by `rules`."""
        self._waypoints = [planned.waypoint for planned in items]
        self._flown = frozenset(
            index
            for index, planned in enumerate(items)
            if planned.item.command
            in (mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_LOITER_TIME)
        )
        self._circles = items[-1].item.command == mavlink.MAV_CMD_NAV_LOITER_UNLIM
        self._offset = rules.offset
        self._disowned = False

    def disown(self) -> None:
        """Another station has stored a mission; it must not be removed."""
        self._disowned = True

    def report(self, state: VehicleState, changed: str = "") -> MissionReport | None:
        """Return the mission's progress; None before the vehicle reports it.

        Args:
            state: the vehicle's state.
            changed: how our mission was changed (`Vehicle.mission_change`).
        """
        mission, offset = state.mission, self._offset
        if mission is None:
            return None
        if self._disowned:
            changed = changed or "it was replaced"
        count = len(self._waypoints)
        index = min(max(mission.current - offset, 0), count - 1)
        circling = self._circles and index == count - 1
        reached = {self._flown_before(seq - offset) for seq in mission.reached} - {None}
        return MissionReport(
            time_s=mission.time_s,
            current=self._waypoints[index],
            reached=frozenset(
                self._waypoints[item] for item in reached if item is not None and item <= index
            ),
            complete=mission.state == mavlink.MISSION_STATE_COMPLETE or circling,
            changed=changed,
        )

    def _flown_before(self, item: int) -> int | None:
        """Return the waypoint's item that a report is about.

        A waypoint is reported by the number of the last item executed with it, such as the speed of
        the next leg (observed on both firmwares).
        """
        return max((flown for flown in self._flown if flown <= item), default=None)
