"""Items that a copter's AUTO flies on curves: circles, splines; and the change of height."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.copter_tasks import CopterTask, FlyTo, holding
from mavlink_sitl.autopilot.plans import Cmd, PlanItem
from mavlink_sitl.autopilot.track import Vector
from mavlink_sitl.exchange import YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter_auto import CopterAuto

CIRCLE_RATE_RAD_S = math.radians(20.0)
"""CIRCLE_RATE"""
CIRCLE_RADIUS_M = 10.0
"""CIRCLE_RADIUS: for an item that gives none"""
HEIGHT_REACHED_M = 0.05
MOVING_M_S = 0.5
"""Slower, a curve leaves towards its end, whatever the direction"""
BEND_SHARE = 0.7
"""Of the acceleration, for the bends of a curve: the rest is for keeping on it"""
CREEP_M_S = 0.1


class Circle(CopterTask):
    """Round a place, a number of turns; first to the nearest point of the circle.

    Args:
        auto: the mode.
        item: the item: param1 turns, param3 radius (negative: against the clock).
        start: where the way begins, NED metres.
        centre: NED metres.
    """

    def __init__(self, auto: CopterAuto, item: PlanItem, start: Vector, centre: Vector) -> None:
        """See the class."""
        super().__init__(auto, item)
        self._centre = centre
        self._radius_m = abs(item.params[2]) or CIRCLE_RADIUS_M
        self._sense = -1.0 if item.params[2] < 0.0 else 1.0
        self._angle = math.atan2(start[1] - centre[1], start[0] - centre[0])
        self._way = FlyTo(auto, replace(item, command=Cmd.LOITER_UNLIM), start, self._point())
        self._turned_rad = 0.0
        self._last_s: float | None = None

    def _point(self) -> Vector:
        return (
            self._centre[0] + self._radius_m * math.cos(self._angle),
            self._centre[1] + self._radius_m * math.sin(self._angle),
            self._centre[2],
        )

    def update(self) -> None:
        """To the edge, then round."""
        copter = self.copter
        if self._last_s is None:
            self._way.update()
            if self._way.track.passed(copter.now_s):
                self._last_s = copter.now_s
            return
        rate = min(
            CIRCLE_RATE_RAD_S,
            copter.navigator.limits().speed_xy_m_s / self._radius_m,
            math.sqrt(copter.navigator.limits().acceleration_xy_m_s2 / self._radius_m),
        )
        step = rate * (copter.now_s - self._last_s)
        self._last_s = copter.now_s
        self._turned_rad += step
        self._angle += self._sense * step
        speed = self._sense * rate * self._radius_m
        self.auto.guide(
            replace(
                holding(self.auto, self._point()),
                velocity_north_m_s=-speed * math.sin(self._angle),
                velocity_east_m_s=speed * math.cos(self._angle),
                restart_xy=False,
                restart_z=False,
                yaw_mode=YawMode.ANGLE,  # towards the centre, as CIRCLE_OPTIONS has it
                yaw_rad=self._angle + math.pi,
            )
        )

    def finished(self) -> bool:
        """When all turns are done."""
        return self._turned_rad >= max(self.item.params[0], 0.0) * math.tau


class LoiterToAltitude(FlyTo):
    """To a place, and there to a height: ends as soon as that is passed or met."""

    _above: bool | None = None

    def __init__(self, auto: CopterAuto, item: PlanItem, start: Vector, target: Vector) -> None:
        """See the class."""
        super().__init__(auto, item, start, target)
        self.stay_s = math.inf

    def finished(self) -> bool:
        """There, and at the height."""
        if not self.track.passed(self.copter.now_s):
            return False
        above_m = self.target[2] - self.copter.motion.down_m
        passed = self._above is not None and self._above != (above_m > 0.0)
        self._above = above_m > 0.0
        return passed or abs(above_m) < HEIGHT_REACHED_M


class Spline(CopterTask):
    """Along a cubic Hermite curve, so that splines in a row are flown without a corner.

    The curve leaves in the direction of the flight and arrives in that of the way from `start`
    to the place after this one, as ArduCopter's splines do.

    Args:
        auto: the mode.
        item: the item; param1 is the time to stay.
        start: where the curve begins, NED metres.
        target: where it ends.
        following: the place after this one, if the vehicle is not to stop here.
    """

    def __init__(
        self,
        auto: CopterAuto,
        item: PlanItem,
        start: Vector,
        target: Vector,
        following: Vector | None,
    ) -> None:
        """See the class."""
        super().__init__(auto, item)
        self.target = target
        self._start = start
        self._stay_s = max(item.params[0], 0.0)
        self._moves_on = following is not None and self._stay_s == 0.0
        chord = _minus(target, start)
        reach_m = math.hypot(*chord)
        velocity = self.copter.motion[3:6]
        self._speed_m_s = math.hypot(*velocity)
        leaving = velocity if self._speed_m_s > MOVING_M_S else chord
        arriving = chord
        if following is not None and self._moves_on:
            arriving = _minus(following, start)
        self._leaving = _of_length(leaving, reach_m)
        self._arriving = _of_length(arriving, reach_m)
        self._along = 0.0
        self._began = False
        self._last_s = self.copter.now_s
        self._arrived_s: float | None = None

    def _at(self, u: float) -> tuple[Vector, Vector]:
        """Position and its derivative by u, which goes from 0 to 1."""
        a, b = u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u)
        h, k = u * (1.0 - u) ** 2, u * u * (u - 1.0)
        dh, dk = (1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)
        place, slope = [], []
        for axis in range(3):
            start, chord = self._start[axis], self.target[axis] - self._start[axis]
            m0, m1 = self._leaving[axis], self._arriving[axis]
            place.append(start + chord * a + m0 * h + m1 * k)
            slope.append(chord * b + m0 * dh + m1 * dk)
        return (place[0], place[1], place[2]), (slope[0], slope[1], slope[2])

    def _speed(self, dt: float, slope: Vector, bend_1_m: float) -> float:
        """As fast as limits, the bend and the place to stop at allow."""
        limits = self.copter.navigator.limits()
        most = limits.speed_xy_m_s
        steepness = abs(slope[2]) / max(math.hypot(*slope), 1e-6)
        climb = limits.speed_down_m_s if slope[2] > 0.0 else limits.speed_up_m_s
        most = min(most, climb / max(steepness, 1e-6))
        acceleration = BEND_SHARE * limits.acceleration_xy_m_s2
        most = min(most, math.sqrt(acceleration / max(bend_1_m, 1e-6)))
        if not self._moves_on:
            left_m = math.dist(self._at(self._along)[0], self.target)
            most = min(most, math.sqrt(2.0 * acceleration * left_m) + CREEP_M_S)
        return min(self._speed_m_s + acceleration * dt, most)

    def update(self) -> None:
        """Move the reference on along the curve."""
        copter = self.copter
        dt, self._last_s = copter.now_s - self._last_s, copter.now_s
        if not copter.armed or copter.landed:
            return
        _, slope = self._at(self._along)
        ahead = self._at(min(self._along + 0.02, 1.0))[1]
        length = max(math.hypot(*slope), 1e-3)
        turn = math.dist(_of_length(slope, 1.0), _of_length(ahead, 1.0))
        self._speed_m_s = self._speed(dt, slope, turn / (0.02 * length))
        self._along = min(self._along + self._speed_m_s * dt / length, 1.0)
        place, slope = self._at(self._along)
        moving = self._moves_on or self._along < 1.0
        velocity = _of_length(slope, self._speed_m_s) if moving else (0.0, 0.0, 0.0)
        self.auto.guide(
            replace(
                holding(self.auto, place),
                velocity_north_m_s=velocity[0],
                velocity_east_m_s=velocity[1],
                velocity_down_m_s=velocity[2],
                restart_xy=not self._began,
                restart_z=not self._began,
                yaw_mode=YawMode.LOOK_AHEAD,
            )
        )
        self._began = True

    def finished(self) -> bool:
        """At the end of the curve, for long enough."""
        copter = self.copter
        if self._along < 1.0:
            return False
        if self._moves_on:
            return True
        if self._arrived_s is None:
            radius_m = copter.parameters["WPNAV_RADIUS"] / 100.0
            if math.dist(copter.motion[:3], self.target) > radius_m:
                return False
            self._arrived_s = copter.now_s
        return copter.now_s - self._arrived_s >= self._stay_s


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _of_length(vector: tuple[float, ...], length: float) -> Vector:
    scale = length / max(math.hypot(*vector), 1e-6)
    return vector[0] * scale, vector[1] * scale, vector[2] * scale
