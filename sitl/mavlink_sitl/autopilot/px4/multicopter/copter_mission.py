"""Mission items of a multicopter with PX4: waypoints within NAV_ACC_RAD."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.common.auto import AutoTask
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.px4.mission_mode import Px4Mission
from mavlink_sitl.autopilot.px4.multicopter.copter_modes import REACHED_M, CopterMode, Land
from mavlink_sitl.exchange import Severity, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter

LEAST_RADIUS_M = 0.05
"""An acceptance radius below it counts as not given"""
YAW_REACHED_RAD = math.radians(12.0)
"""MIS_YAW_ERR"""
LEAST_TURN_S = 0.8
"""Least duration of a turn, recorded when the yaw was right already (`mission_clear`)"""


class Mission(CopterMode, Px4Mission):
    """Flies the uploaded mission."""

    def announce(self) -> None:
        """Say that it begins; a take-off says its height."""
        super().announce()
        if isinstance(self.task, ClimbTo):
            height = self.vehicle.navigator.home_ned_m()[2] - self.task.target[2]
            self.vehicle.say(Severity.INFO, f"Climb to {height:.1f} meters above home")

    @property
    def taking_off(self) -> bool:
        """While the take-off climbs."""
        return isinstance(self.task, ClimbTo)

    def wants_to_lift(self) -> bool:
        """With a take-off, or any other item that is above the ground."""
        return isinstance(self.task, GoTo) and self.task.target[2] < self.here()[2] - REACHED_M

    def last_place(self) -> Vector:
        """See `Px4Mission`."""
        return self.task.target if isinstance(self.task, GoTo) else self.here()

    def _begin_moving(self, item: PlanItem) -> None:
        command = item.command
        target = self.place_of(item, self.last_place())
        if command == Cmd.LAND:
            self.task = LandAt(self, item, target)
        elif command == Cmd.TAKEOFF:
            self.task = ClimbTo(self, item, (*self.here()[:2], target[2]))
        elif command == Cmd.DELAY:
            self.task = GoTo(self, item, self.last_place())
        else:
            self.task = GoTo(self, item, target, isinstance(self.task, ClimbTo))

    def limits_changed(self) -> None:
        """Another speed: the item continues with it."""
        if isinstance(self.task, GoTo):
            self.task.begin()


class Px4Task(AutoTask):
    """An item in flight."""

    auto: Mission
    vehicle: Px4Copter


class GoTo(Px4Task):
    """To a place, and for a while at it.

    Args:
        target: where to, NED metres.
        turn_first: the nose turns there before it goes, as after a take-off.
    """

    def __init__(
        self, mission: Mission, item: PlanItem, target: Vector, turn_first: bool = False
    ) -> None:
        super().__init__(mission, item)
        self.target = target
        self._turning_since_s = self.vehicle.now_s if turn_first else None
        self._stay_s = max(item.params[0], 0.0) if math.isfinite(item.params[0]) else 0.0
        if item.command == Cmd.LOITER_UNLIM:
            self._stay_s = math.inf
        self.begin()

    def begin(self) -> None:
        """Pass the guidance to the controllers."""
        motion, target = self.vehicle.motion, self.target
        yaw = None
        if math.dist(motion[:2], target[:2]) > self._acceptance_m():
            yaw = math.atan2(target[1] - motion.east_m, target[0] - motion.north_m)
        if self._turning_since_s is not None and yaw is not None:
            self._yaw_rad = yaw
            self.auto.guide(self.auto.hold_at(self.auto.here(), yaw))
            return
        self._turning_since_s = None
        limits = self.vehicle.navigator.line_limits(motion[:3], target)
        self.auto.guide(replace(self.auto.hold_at(target, yaw), limits=limits))

    def update(self) -> None:
        """Once the nose looks where it goes: go."""
        if self._turning_since_s is None:
            return
        off_rad = math.remainder(self._yaw_rad - self.vehicle.motion.yaw_rad, math.tau)
        turned = abs(off_rad) < YAW_REACHED_RAD
        if turned and self.vehicle.now_s - self._turning_since_s >= LEAST_TURN_S:
            self._turning_since_s = None
            self.begin()

    def _acceptance_m(self) -> float:
        """Of the item, or NAV_ACC_RAD."""
        own_m = self.item.params[1] if self.item.command == Cmd.WAYPOINT else 0.0
        given = math.isfinite(own_m) and own_m > LEAST_RADIUS_M
        return own_m if given else self.vehicle.parameters["NAV_ACC_RAD"]

    def _near(self) -> bool:
        motion = self.vehicle.motion
        level_m = math.dist(motion[:2], self.target[:2])
        return level_m < self._acceptance_m() and abs(motion.down_m - self.target[2]) < REACHED_M

    def finished(self) -> bool:
        """There, for long enough."""
        return self.vehicle.in_flight and self.stayed(self._near(), self._stay_s)


class ClimbTo(GoTo):
    """Straight up: the take-off."""

    def begin(self) -> None:
        """Pass the guidance to the controllers."""
        limits = self.vehicle.navigator.takeoff_limits()
        guidance = replace(self.auto.hold_at(self.target), restart_z=True, limits=limits)
        self.auto.guide(guidance)


class LandAt(GoTo):
    """To a place, then down."""

    _sink: Land | None = None

    @property
    def landing(self) -> bool:
        """Once above the place."""
        return self._sink is not None

    def update(self) -> None:
        """Sink, once there."""
        if self._sink is not None:
            self._sink.update()
        elif math.dist(self.vehicle.motion[:2], self.target[:2]) < self._acceptance_m():
            self._sink = Land(self.vehicle, self.auto.spec)
            self._sink.enter()

    def begin(self) -> None:
        """At the height where it is."""
        self.target = (*self.target[:2], self.vehicle.motion.down_m)
        super().begin()

    def finished(self) -> bool:
        """On the ground."""
        return self._sink is not None and not self.vehicle.in_flight
