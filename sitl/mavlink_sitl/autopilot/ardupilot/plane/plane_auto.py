"""AUTO of planes: flies the mission and its landing."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.plane.plane_landing import Approach
from mavlink_sitl.autopilot.ardupilot.plane.plane_tasks import (
    Climb,
    FlyLine,
    GlideTask,
    GoRound,
    GroundDelay,
    ItemAuto,
)
from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.plans.plan_commands import MOVING
from mavlink_sitl.autopilot.plans.plans import Cmd, MissionState, PlanItem
from mavlink_sitl.exchange import Guidance, Motors, Severity, Vector
from mavlink_sitl.guidance import GlideGuidance

ROUND = (Cmd.LOITER_UNLIM, Cmd.LOITER_TIME, Cmd.LOITER_TURNS, Cmd.LOITER_TO_ALT)
MODE_RTL = 11
PLACED = (Cmd.WAYPOINT, Cmd.LAND, *ROUND)
"""Items that are somewhere"""
GO_AROUND_M = 30.0
"""How high a go-around climbs when nobody says it"""


class GlideAuto(ItemAuto):
    """Flies the uploaded mission; at its end it returns to launch."""

    moving = MOVING - {Cmd.SPLINE}

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it; without one, return."""
        self.target = None
        self.begin_level()
        self._leg_end: Vector | None = None
        Auto.enter(self)
        if not self.has_mission:
            self._complete()

    def leave(self) -> None:
        """Another mode takes over; a landing will have to begin again."""
        was_flown = self.vehicle.plans.state is MissionState.ACTIVE
        Auto.leave(self)
        if was_flown and isinstance(self.task, Approach):
            self._go_back_before_landing()

    @property
    def taking_off(self) -> bool:
        """While a take-off climbs."""
        return isinstance(self.task, GlideTask) and self.task.taking_off

    def ground_motors(self) -> Motors:
        """A take-off rolls before it flies; a landing rolls out."""
        launched = isinstance(self.task, GlideTask) and self.task.launched
        return Motors.FLY if launched else Motors.IDLE

    def hold_guidance(self) -> Guidance:
        """Wings level, until the first item says more."""
        return GlideGuidance()

    def _change_speed(self, kind: int, speed_m_s: float) -> None:
        self.vehicle.set_speed(kind, speed_m_s)

    def _say_reached(self, place: int, item: PlanItem) -> None:
        """The items say it themselves."""

    def _complete(self) -> None:
        self.vehicle.plans.state = MissionState.COMPLETE
        self.task = None
        self.vehicle.enter_mode(MODE_RTL)
        self.vehicle.say(Severity.INFO, "Mission complete, changing mode to RTL")

    def _begin(self, item: PlanItem) -> None:
        here, command = self.vehicle.motion[:3], item.command
        start = self._leg_end or here
        target = self.place_of(item, here)
        self._leg_end = target if command in PLACED else None
        if command == Cmd.RTL:
            self.task = None
            self.vehicle.enter_mode(MODE_RTL)
        elif command == Cmd.TAKEOFF:
            self.task = Climb(self, item, target[2])
        elif command == Cmd.DELAY:
            self.task = GroundDelay(self, item)
        elif command == Cmd.LAND:
            self.task = Approach(self, item, start, target)
        elif command in ROUND:
            self.task = GoRound(self, item, target, self._place_after())
        else:
            self.task = FlyLine(self, item, start, target, self._place_after())

    def _place_after(self) -> Vector | None:
        """Where the item after the one in force is, if it has a place."""
        for item in self.following_items():
            if item.command in PLACED and item.has_place:
                return self.place_of(item, self.vehicle.motion[:3])
        return None

    def jump_to(self, place: int) -> None:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT while it flies: from here."""
        self._leg_end = None
        Auto.jump_to(self, place)

    def place_of(self, item: PlanItem, instead: Vector) -> Vector:
        """See `Auto`; where a waypoint or a landing is given, a height of 0 is meant."""
        north, east, down = Auto.place_of(self, item, instead)
        if item.command in (Cmd.WAYPOINT, Cmd.LAND) and item.has_place:
            down = self._down_m(item)
        return north, east, down

    # Landing.

    def landing_start(self) -> int | None:
        """The place of the nearest DO_LAND_START, or None."""
        items, here = self.vehicle.plans.mission.items, self.vehicle.motion[:3]
        best, best_m = None, math.inf
        for place, item in enumerate(items):
            if place < self._first or item.command != Cmd.LAND_START:
                continue
            where = item
            if not item.has_place:
                following = (i for i in items[place:] if i.command in PLACED and i.has_place)
                where = next(following, item)
                if where is item:
                    continue
            distance_m = math.dist(self.place_of(where, here), here)
            if distance_m < best_m:
                best, best_m = place, distance_m
        return best

    def go_around(self, height_m: float) -> bool:
        """DO_GO_AROUND: break a landing off; whether there was one."""
        if not isinstance(self.task, Approach) or self.task.go_around is not None:
            return False
        height = next((h for h in (height_m, self.task.item.params[0]) if h > 0.0), GO_AROUND_M)
        self.task.abort(height)
        return True

    def restart_landing(self) -> None:
        """After a go-around: begin the landing again."""
        if self._go_back_before_landing():
            self.jump_to(self.vehicle.plans.current)

    def _go_back_before_landing(self) -> bool:
        """Let the mission continue where the approach begins."""
        plans = self.vehicle.plans
        start = self.landing_start()
        text = f"Restarted landing via DO_LAND_START: {start}"
        if start is None:
            before = range(plans.current - 1, self._first - 1, -1)
            items = plans.mission.items
            start = next((i for i in before if items[i].command in PLACED), None)
            text = f"Restarted landing sequence at waypoint {start}"
        if start is None:
            self.vehicle.say(Severity.WARNING, "Unable to restart landing sequence")
            return False
        plans.current = start
        self.vehicle.say(Severity.NOTICE, text)
        return True
