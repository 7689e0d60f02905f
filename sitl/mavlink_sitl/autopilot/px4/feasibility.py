"""PX4's feasibility check of an uploaded mission.

The checks run when a mission or a fence has been uploaded and once home is known. The upload is
acknowledged in any case; a mission that fails cannot be flown: AUTO.MISSION is rejected in the
air, and keeps the vehicle from arming on the ground. Seen of the real one: only a violated
fence gets a text, MISSION_CURRENT.mission_state reports the rest; a first waypoint far away and
waypoints below home are feasible. The other rules are read in the firmware.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plan_rules import PX4_DEVICES
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Severity
from mavlink_sitl.geodesy import GeoPoint

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

WITH_POSITION = frozenset((Cmd.WAYPOINT, Cmd.LOITER_UNLIM, Cmd.LOITER_TIME, Cmd.LAND, Cmd.TAKEOFF))
BEFORE_TAKEOFF = PX4_DEVICES | {
    Cmd.DELAY, Cmd.JUMP, Cmd.CHANGE_SPEED, Cmd.CONDITION_DELAY, Cmd.SET_HOME, Cmd.LAND_START,
    Cmd.SET_ROI, Cmd.SET_ROI_LOCATION, Cmd.SET_ROI_NONE,
}  # fmt: skip
"""Items that are allowed before a take-off"""
TAKEOFFS, LANDINGS = (Cmd.TAKEOFF, Cmd.VTOL_TAKEOFF), (Cmd.LAND, Cmd.VTOL_LAND)
LEAST_TAKEOFF_M = 1e-6
NEEDS_TAKEOFF, NEEDS_LANDING, NEEDS_BOTH, BOTH_OR_NONE = 1, 2, 3, 4
"""MIS_TKO_LAND_REQ"""
KNOWN_AFTER_S = 0.1
"""The commander looks at the result ten times a second; MISSION_START 10 ms after an upload was
rejected"""


class Feasibility:
    """Judges the mission of one vehicle, once for each change."""

    def __init__(self, vehicle: Px4Vehicle) -> None:
        self._vehicle = vehicle
        self._judged: tuple[int, int, bool] | None = None
        self._judged_at_s = -math.inf
        self._heard = False
        self._holds = False

    def known(self) -> bool:
        """Whether the commander has heard of the latest judgement."""
        return self._heard or self._vehicle.now_s - self._judged_at_s >= KNOWN_AFTER_S

    def hear(self) -> None:
        """The commander looks at once, as whenever it is to arm."""
        self.holds()
        self._heard = True

    def holds(self) -> bool:
        """Whether the mission may be flown; says where it violates the fence, the first time."""
        vehicle = self._vehicle
        plans, home = vehicle.plans, vehicle.navigator.home
        judged = (plans.mission.changes, plans.fence.changes, home is not None)
        if judged != self._judged:
            self._judged, self._judged_at_s = judged, vehicle.now_s
            self._heard = False
            self._holds = bool(plans.mission.items) and home is not None and self._check(home)
        return self._holds

    def _check(self, home: GeoPoint) -> bool:
        vehicle = self._vehicle
        items = vehicle.plans.mission.items
        vehicle.fence.update()  # an area uploaded just now counts
        return (
            self._inside_fence(items, home)
            and self._in_order(items, home)
            and vehicle.may_land_by(items)
            and self._complete({item.command for item in items})
        )

    def _inside_fence(self, items: list[PlanItem], home: GeoPoint) -> bool:
        vehicle = self._vehicle
        if not vehicle.fence.enabled:
            return True
        home_down_m = vehicle.navigator.home_ned_m()[2]
        for number, item in enumerate(items, 1):
            level = item.level_m(vehicle.navigator.frame)
            place = (*level, home_down_m - _height_m(item, home))
            if item.command in WITH_POSITION and vehicle.fence.broken_at(place):
                text = f"Geofence violation for waypoint {number}"
                vehicle.say(Severity.CRITICAL, text)
                return False
        return True

    def _in_order(self, items: list[PlanItem], home: GeoPoint) -> bool:
        """A take-off comes first and leads up; a landing comes first only in the air."""
        if items[0].command == Cmd.LAND and self._vehicle.landed:
            return False
        positions = False
        for item in items:
            takes_off = item.command in TAKEOFFS
            if takes_off and (positions or _height_m(item, home) < LEAST_TAKEOFF_M):
                return False
            positions |= item.command not in BEFORE_TAKEOFF
        return True

    def _complete(self, commands: set[int]) -> bool:
        needs = int(self._vehicle.parameters["MIS_TKO_LAND_REQ"])
        takeoff = not commands.isdisjoint(TAKEOFFS)
        landing = not commands.isdisjoint(LANDINGS)
        return {
            NEEDS_TAKEOFF: takeoff,
            NEEDS_LANDING: landing,
            NEEDS_BOTH: takeoff and landing,
            BOTH_OR_NONE: takeoff == landing,
        }.get(needs, True)


def _height_m(item: PlanItem, home: GeoPoint) -> float:
    """Above home."""
    return item.z - (home.altitude_amsl_m if item.is_amsl else 0.0)
