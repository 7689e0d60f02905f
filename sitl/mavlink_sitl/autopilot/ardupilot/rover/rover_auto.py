"""AUTO of rovers and boats: drives the mission. Seen in the recording `rover_auto`.

Waypoints are driven through at the speed of a corner;
at the last one, and at those with a delay, the vehicle stands.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import DriveMode
from mavlink_sitl.autopilot.ardupilot.rover.track_reference import TrackReference
from mavlink_sitl.autopilot.common.auto import Auto, AutoTask, Delay
from mavlink_sitl.autopilot.plans.plan_commands import MOVING
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Guidance, Motors, Severity, Vector
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
START_S = 0.1
"""From arming until a mission moves"""
STAYING = (Cmd.TAKEOFF, Cmd.LAND)
"""Items that lead to nowhere else"""


class DriveTo(AutoTask):
    """The way to an item's place.

    Args:
        target: its place, NED metres.
        last: whether nothing comes after it.
    """

    auto: DriveAuto
    vehicle: Rover

    def __init__(self, auto: DriveAuto, item: PlanItem, target: Vector, last: bool) -> None:
        super().__init__(auto, item)
        self._target = target
        waits = item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME)
        self._wait_s = max(item.params[0], 0.0) if waits else 0.0
        self._stops = last or self._wait_s > 0.0
        self._endless = item.command == Cmd.LOITER_UNLIM
        rover = self.vehicle
        self.route = TrackReference(rover, target[:2], rover.navigator.cruise_m_s())
        if isinstance(auto.task, DriveTo):
            self.route.continue_from(auto.task.route)
        auto.route = self.route

    def update(self) -> None:
        """Drive on, or stay."""
        if not self._stops:
            following = self.auto.following_point(self._target)
            if following is not None:
                self.route.offer(following)
        if not self.route.reached:
            self.auto.drive(self.route.follow())
        else:
            self.vehicle.rest_at(self.auto, self.route.destination)

    def finished(self) -> bool:
        """Whether it is there, and has waited."""
        return not self._endless and self.stayed(self.route.reached, self._wait_s)


class Obey(AutoTask):
    """NAV_GUIDED_ENABLE: follows setpoints as GUIDED does, within DO_GUIDED_LIMITS.

    Args:
        item: param1 above 0 begins it, else it is over at once.
        time_s: it ends after this; 0 for no limit.
        distance_m: it ends so far from where it began; 0 for no limit.
    """

    auto: DriveAuto
    vehicle: Rover

    def __init__(self, auto: DriveAuto, item: PlanItem, time_s: float, distance_m: float) -> None:
        super().__init__(auto, item)
        self._time_s, self._distance_m = time_s, distance_m
        self._began_s, self._began_at = self.vehicle.now_s, self.vehicle.motion[:2]
        self.begins = item.params[0] > 0.0
        auto.route = None
        if self.begins:
            self.vehicle.guided.enter()

    def update(self) -> None:
        """Run one step of GUIDED."""
        if self.begins:
            self.vehicle.guided.update()

    def finished(self) -> bool:
        """At a limit, or at once."""
        away_m = math.dist(self._began_at, self.vehicle.motion[:2])
        return (
            not self.begins
            or 0.0 < self._time_s <= self.vehicle.now_s - self._began_s
            or 0.0 < self._distance_m < away_m
        )


class DriveAuto(DriveMode, Auto):
    """Drives the uploaded mission."""

    vehicle: Rover

    moving = MOVING - {Cmd.SPLINE, Cmd.LOITER_TO_ALT} | {Cmd.GUIDED_ENABLE}

    def hold_guidance(self) -> Guidance:
        """Brake."""
        return DriveGuidance(motors=Motors.FLY, limits=self.vehicle.navigator.limits())

    def enter(self) -> None:
        """Resume the mission where it was left, or begin it."""
        self.route = None
        self.vehicle.backwards = False
        self._bounds = (0.0, 0.0)
        super().enter()

    def update(self) -> None:
        """Run one step once armed."""
        if self.vehicle.armed and self.vehicle.now_s - self.vehicle.arming.armed_at_s >= START_S:
            Auto.update(self)

    def limits_changed(self) -> None:
        """Another speed: continue with it."""
        if isinstance(self.task, DriveTo):
            self.task.route.change_speed(self.vehicle.navigator.cruise_m_s())

    def _do(self, item: PlanItem, begins: bool) -> bool:
        """DO_SET_REVERSE and DO_GUIDED_LIMITS, besides what every vehicle does."""
        if item.command == Cmd.SET_REVERSE:
            self.vehicle.backwards = item.params[0] == 1.0
        elif item.command == Cmd.GUIDED_LIMITS:
            self._bounds = (max(item.params[0], 0.0), max(item.params[3], 0.0))
        return super()._do(item, begins)

    def _say_reached(self, place: int, item: PlanItem) -> None:
        if item.command in (Cmd.WAYPOINT, Cmd.LOITER_TIME):
            self.vehicle.say(Severity.INFO, f"Reached waypoint #{place}")

    def _complete(self) -> None:
        super()._complete()
        self.route = None
        self.vehicle.say(Severity.NOTICE, "Mission Complete")

    def _begin(self, item: PlanItem) -> None:
        here = self.vehicle.motion[:3]
        if item.command == Cmd.DELAY:
            self.task = Delay(self, item)
            return
        if item.command == Cmd.GUIDED_ENABLE:
            self.task = Obey(self, item, *self._bounds)
            return
        last = not any(i.command in self.moving for i in self.following_items())
        self.task = DriveTo(self, item, self._place(item, here), last)

    def _place(self, item: PlanItem, here: Vector) -> Vector:
        if item.command == Cmd.RTL:
            return self.vehicle.navigator.home_ned_m()
        return here if item.command in STAYING else self.place_of(item, here)

    def following_point(self, here: Vector) -> tuple[float, float] | None:
        """Where the next item leads, if it is driven to without a stop before."""
        item = next((i for i in self.following_items() if i.command in self.moving), None)
        if item is None or item.command in (Cmd.DELAY, Cmd.GUIDED_ENABLE, *STAYING):
            return None
        return self._place(item, here)[:2]
