"""Whether PX4 would fly an uploaded mission.

Read in the firmware's feasibility checks: they run when a mission or a fence has been
uploaded and once home is known, and say what is wrong. The upload is acknowledged in any
case; a mission that fails cannot be flown: AUTO.MISSION is refused in the air, and keeps
the vehicle from arming on the ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.auto import AMSL_FRAMES
from mavlink_sitl.autopilot.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Severity
from mavlink_sitl.geodesy import GeoPoint, to_local

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

WITH_POSITION = frozenset(
    (Cmd.WAYPOINT, Cmd.LOITER_UNLIM, Cmd.LOITER_TURNS, Cmd.LOITER_TIME, Cmd.LAND, Cmd.TAKEOFF)
)
BEFORE_TAKEOFF = frozenset((Cmd.DELAY, Cmd.JUMP, Cmd.CHANGE_SPEED, Cmd.CONDITION_DELAY))
"""What may stand before a take-off"""
NEEDS_TAKEOFF, NEEDS_LANDING, NEEDS_BOTH, BOTH_OR_NONE = 1, 2, 3, 4
"""MIS_TKO_LAND_REQ"""


class Feasibility:
    """Judges the mission of one vehicle, once for each change.

    Args:
        vehicle: it.
    """

    def __init__(self, vehicle: Px4Vehicle) -> None:
        """See the class."""
        self._vehicle = vehicle
        self._judged: tuple[int, int, bool] | None = None
        self._holds = False

    def holds(self) -> bool:
        """Whether the mission may be flown; says why not, the first time."""
        vehicle = self._vehicle
        plans, home = vehicle.plans, vehicle.navigator.home
        judged = (plans.mission.changes, plans.fence.changes, home is not None)
        if judged != self._judged:
            self._judged = judged
            self._holds = bool(plans.mission.items) and home is not None and self._check(home)
        return self._holds

    def _check(self, home: GeoPoint) -> bool:
        vehicle = self._vehicle
        vehicle.fence.update()  # an area uploaded just now counts
        wrong = next(self._faults(vehicle.plans.mission.items, home), None)
        if wrong is not None:
            vehicle.say(Severity.CRITICAL, wrong)
        self._warn(vehicle.plans.mission.items, home)
        return wrong is None

    def _faults(self, items: list[PlanItem], home: GeoPoint) -> Iterator[str]:
        """What makes it impossible."""
        vehicle = self._vehicle
        takeoff = landing = positions = False
        for place, item in enumerate(items):
            above_home_m = _height_m(item, home)
            if place == 0 and item.command == Cmd.LAND and vehicle.landed:
                yield "Mission rejected: starts with landing"
            if item.command in WITH_POSITION and vehicle.fence.enabled:
                spot = to_local(vehicle.navigator.origin, _point(item))
                down = vehicle.navigator.home_ned_m()[2] - above_home_m
                if vehicle.fence.broken_at((spot[0], spot[1], down)):
                    yield f"Geofence violation for waypoint {place + 1}"
            if item.command == Cmd.TAKEOFF:
                if above_home_m - 1.0 < self._acceptance_m(item):
                    yield "Mission rejected: Takeoff altitude too low!"
                if positions:
                    yield "Mission rejected: takeoff not first waypoint item"
                takeoff = True
            landing |= item.command == Cmd.LAND
            positions |= item.command not in BEFORE_TAKEOFF
        yield from vehicle.landing_faults(items)
        yield from self._required(takeoff, landing)

    def _acceptance_m(self, item: PlanItem) -> float:
        own_m = item.params[1]
        given = math.isfinite(own_m) and own_m > 0.05
        return own_m if given else self._vehicle.parameters["NAV_ACC_RAD"]

    def _required(self, takeoff: bool, landing: bool) -> Iterator[str]:
        needs = int(self._vehicle.parameters["MIS_TKO_LAND_REQ"])
        if needs == NEEDS_TAKEOFF and not takeoff:
            yield "Mission rejected: Takeoff waypoint required."
        elif needs == NEEDS_LANDING and not landing:
            yield "Mission rejected: Landing waypoint/pattern required."
        elif needs == NEEDS_BOTH and not (takeoff and landing):
            yield "Mission rejected: Takeoff or Landing item missing."
        elif needs == BOTH_OR_NONE and takeoff != landing:
            add = "Add Landing item or remove Takeoff." if takeoff else ""
            yield f"Mission rejected: {add or 'Add Takeoff item or remove Landing.'}"

    def _warn(self, items: list[PlanItem], home: GeoPoint) -> None:
        """What is only said: a first waypoint far away, waypoints below home."""
        vehicle = self._vehicle
        most_m = vehicle.parameters["MIS_DIST_1WP"]
        places = [(n, item) for n, item in enumerate(items, 1) if item.command in WITH_POSITION]
        for number, item in places:
            if _height_m(item, home) < 0.0:
                vehicle.say(Severity.CRITICAL, f"Warning: Waypoint {number} below home")
        if places and most_m > 0.0:
            away_m = math.hypot(*to_local(home, _point(places[0][1]))[:2])
            if away_m >= most_m:
                vehicle.say(
                    Severity.CRITICAL,
                    f"First waypoint far away from home: {away_m:.0f}m. Correct mission loaded?",
                )


def _point(item: PlanItem) -> GeoPoint:
    return GeoPoint(item.x / 1e7, item.y / 1e7, 0.0)


def _height_m(item: PlanItem, home: GeoPoint) -> float:
    """Above home."""
    return item.z - (home.altitude_amsl_m if item.frame in AMSL_FRAMES else 0.0)
