"""Tasks of AUTO for copters: one class per type of movement item."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace

from mavlink_sitl.autopilot.ardupilot.copter.copter_modes import Land
from mavlink_sitl.autopilot.ardupilot.copter.guided import (
    ARMING_DELAY_S,
    TAKEOFF_MARGIN_M,
    TAKEOFF_SPEED_M_S,
)
from mavlink_sitl.autopilot.ardupilot.copter.rtl import (
    ReturnToLaunch,
    stopping_point,
    wpnav_jerk_m_s3,
)
from mavlink_sitl.autopilot.common.auto import Auto, AutoTask
from mavlink_sitl.autopilot.control.circle import Orbit, circle_radius_m, circle_rate_rad_s
from mavlink_sitl.autopilot.control.track import LegTrack, TrackLeg
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Vector, YawMode

THROTTLE_RAISED = 0.05
LEAST_CLIMB_M = 1.0
"""Of a take-off from the ground"""
ALLOW_TAKEOFF = 2
"""Bit of AUTO_OPTIONS: no raised throttle needed for the take-off"""
HEIGHT_REACHED_M = 0.05


class LegAuto(Auto):
    """AUTO that knows the leg after the one that is flown."""

    @abstractmethod
    def following_leg(self) -> FlyTo | None:
        """The leg to the next item, if that is flown straight and without stopping here."""


class CopterTask(AutoTask):
    """An item in flight."""

    auto: LegAuto

    def follow(self, place: Vector, velocity: Vector, acceleration: Vector, begins: bool) -> None:
        """Hand on a moving reference, NED; the nose looks where it goes."""
        guidance = self.auto.hold_guidance().exactly(place, velocity, acceleration)
        ahead = YawMode.LOOK_AHEAD
        self.auto.guide(replace(guidance, restart_xy=begins, restart_z=begins, yaw_mode=ahead))


class TakeOffTask(CopterTask):
    """Straight up, once the motors turn and somebody wants it.

    Args:
        down_m: how high, NED.
    """

    def __init__(self, auto: LegAuto, item: PlanItem, down_m: float) -> None:
        super().__init__(auto, item)
        motion = self.vehicle.motion
        # Never downwards, and from the ground by a metre at least.
        highest = motion.down_m - (LEAST_CLIMB_M if self.vehicle.landed else 0.0)
        self.target: Vector = (motion.north_m, motion.east_m, min(down_m, highest))
        self.lifting = False

    def _wanted(self) -> bool:
        return (
            not self.vehicle.landed
            or self.auto.may_take_off
            or bool(int(self.vehicle.parameters["AUTO_OPTIONS"]) & ALLOW_TAKEOFF)
            or self.vehicle.radio.throttle(self.vehicle.now_s) > THROTTLE_RAISED
        )

    def update(self) -> None:
        """Begin when everything is ready."""
        copter = self.vehicle
        if self.lifting or not copter.armed or not self._wanted():
            return
        if copter.landed and copter.now_s - copter.arming.armed_at_s < ARMING_DELAY_S:
            return
        self.lifting = True
        self.target = (copter.motion.north_m, copter.motion.east_m, self.target[2])
        self.auto.guide(self.auto.hold_guidance().at(self.target))

    def finished(self) -> bool:
        """At its height and slow."""
        motion = self.vehicle.motion
        near = motion.down_m <= self.target[2] + TAKEOFF_MARGIN_M
        return self.lifting and near and abs(motion.velocity_down_m_s) < TAKEOFF_SPEED_M_S


class FlyTo(CopterTask):
    """To a place, and for a while at it: waypoints and loiters.

    Args:
        start: where the leg begins, NED metres.
        target: where it ends.
    """

    def __init__(self, auto: LegAuto, item: PlanItem, start: Vector, target: Vector) -> None:
        super().__init__(auto, item)
        self.target = target
        self.leg = self._leg_from(start)
        self.track = LegTrack(self.leg, self.vehicle.now_s)
        self.following: FlyTo | None = None
        self._restarted = True
        self.stay_s = max(item.params[0], 0.0)
        if item.command == Cmd.LOITER_UNLIM:
            self.stay_s = math.inf

    def _leg_from(self, start: Vector) -> TrackLeg:
        return TrackLeg(
            start, self.target, self.vehicle.navigator.limits(), wpnav_jerk_m_s3(self.vehicle)
        )

    def continue_from(self, old: FlyTo) -> None:
        """Round the corner from the leg before."""
        self.track = old.track
        if old.following is not None:
            self.leg = old.following.leg
        self.track.go_on(self.leg, self.vehicle.now_s)
        self._restarted = False

    def goes_on(self) -> None:
        """The controllers are where the leg begins already."""
        self._restarted = False

    def forget_following(self) -> None:
        """Drop the planned next leg: the next item may have changed."""
        if self.track.rounding:
            self.restart()
        self.following = None

    def change_limits(self) -> None:
        """Other speeds from now on, without a stop."""
        if not self.track.rounding:
            self.following = None
        self.track.change_limits(self.vehicle.navigator.limits(), self.vehicle.now_s)

    def restart(self) -> None:
        """From where the vehicle can stop, as after a pause with new limits."""
        copter = self.vehicle
        self.leg = self._leg_from(stopping_point(copter))
        self.track = LegTrack(self.leg, copter.now_s)
        self.following = None
        self._restarted = True

    def update(self) -> None:
        """Follow the track; look for the corner."""
        copter = self.vehicle
        if not copter.armed or copter.landed:
            return
        if self.stay_s == 0.0:
            if self.following is None:
                self.following = self.auto.following_leg()
            if self.following is not None:
                radius = copter.parameters["WPNAV_RADIUS"] / 100.0
                self.track.offer(self.following.leg, radius, copter.now_s)
        self.track.advance(
            copter.now_s, self.auto.paused, copter.motion, wpnav_jerk_m_s3(self.vehicle)
        )
        position, velocity, acceleration = self.track.at(copter.now_s)
        self.follow(position, velocity, acceleration, begins=self._restarted)
        self._restarted = False

    def finished(self) -> bool:
        """Past the corner, or long enough at the place."""
        copter = self.vehicle
        if not copter.armed or copter.landed or not self.track.passed(copter.now_s):
            return False
        if self.stay_s == 0.0 and self.following is not None:
            return True
        radius = copter.parameters["WPNAV_RADIUS"] / 100.0
        return self.stayed(math.dist(copter.motion[:3], self.target) <= radius, self.stay_s)


class CircleTask(CopterTask):
    """Round a place, a number of turns; first to the nearest point of the circle.

    Args:
        item: the item: param1 turns, param3 radius (negative: against the clock).
        start: where the way begins, NED metres.
        centre: NED metres.
    """

    def __init__(self, auto: LegAuto, item: PlanItem, start: Vector, centre: Vector) -> None:
        super().__init__(auto, item)
        rate = math.copysign(abs(circle_rate_rad_s(self.vehicle)), item.params[2])
        radius_m = abs(item.params[2]) or circle_radius_m(self.vehicle)
        angle = math.atan2(start[1] - centre[1], start[0] - centre[0])
        self._orbit = Orbit(self.vehicle, centre, radius_m, rate, angle)
        way = replace(item, command=Cmd.LOITER_UNLIM)
        self._way = FlyTo(auto, way, start, self._orbit.point())
        self._round = False

    def update(self) -> None:
        """To the edge, then round."""
        if not self._round:
            self._way.update()
            self._round = self._way.track.passed(self.vehicle.now_s)
            self._orbit.begin()
            return
        self.auto.guide(self._orbit.go_on(self.auto.hold_guidance()))

    def finished(self) -> bool:
        """When all turns are done."""
        return self._orbit.turned_rad >= max(self.item.params[0], 0.0) * math.tau


class LoiterToAltitude(FlyTo):
    """To a place, and there to a height: ends as soon as that is passed or met."""

    _above: bool | None = None

    def __init__(self, auto: LegAuto, item: PlanItem, start: Vector, target: Vector) -> None:
        super().__init__(auto, item, start, target)
        self.stay_s = math.inf

    def finished(self) -> bool:
        """There, and at the height."""
        if not self.track.passed(self.vehicle.now_s):
            return False
        above_m = self.target[2] - self.vehicle.motion.down_m
        passed = self._above is not None and self._above != (above_m > 0.0)
        self._above = above_m > 0.0
        return passed or abs(above_m) < HEIGHT_REACHED_M


class ReturnHome(CopterTask):
    """Home, and down; ends in disarming, which is not AUTO's business."""

    def __init__(self, auto: LegAuto, item: PlanItem) -> None:
        super().__init__(auto, item)
        self._way = ReturnToLaunch(self.vehicle, auto.spec)
        self._way.enter()

    @property
    def landing(self) -> bool:
        """In the last stage."""
        return self._way.landing

    def update(self) -> None:
        """Run one step."""
        self._way.update()


class LandAt(CopterTask):
    """Down, at a place or here."""

    def __init__(
        self, auto: LegAuto, item: PlanItem, start: Vector, target: Vector, moves: bool
    ) -> None:
        super().__init__(auto, item)
        self._sink = Land(self.vehicle, auto.spec)
        self._way: FlyTo | None = None
        if moves:
            self._way = FlyTo(auto, replace(item, command=Cmd.LOITER_UNLIM), start, target)
        else:
            self._sink.enter()

    @property
    def landing(self) -> bool:
        """Once above the place."""
        return self._way is None

    def update(self) -> None:
        """Fly there, then sink."""
        if self._way is None:
            self._sink.update()
            return
        self._way.update()
        if self._way.track.passed(self.vehicle.now_s):
            self._way = None
            self._sink.enter()

    def finished(self) -> bool:
        """On the ground."""
        return self._way is None and self.vehicle.landed
