"""Curved items of AUTO for copters: circles and splines; and the change of altitude."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from mavlink_sitl.autopilot.ardupilot.copter.copter_tasks import CopterTask, FlyTo, LegAuto
from mavlink_sitl.autopilot.control.circle import Orbit, circle_radius_m, circle_rate_rad_s
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Vector

HEIGHT_REACHED_M = 0.05
MOVING_M_S = 0.5
"""Slower, a curve leaves towards its end, whatever the direction"""
BEND_SHARE = 0.7
"""Of the acceleration, for the bends of a curve: the rest is for keeping on it"""
BRAKE_SHARE = 0.6
"""Of that, for slowing down in time"""
CREEP_M_S = 0.1
POINTS = 60
"""Number of straight pieces of a curve"""


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


class Spline(CopterTask):
    """Along a cubic Hermite curve, so that splines in a row are flown without a corner.

    The curve leaves in the direction of the flight and arrives in that of the way from `start`
    to the place after this one, as ArduCopter's splines do.

    Args:
        item: the item; param1 is the time to stay.
        start: where the curve begins, NED metres.
        target: where it ends.
        following: the place after this one, if the vehicle is not to stop here.
    """

    def __init__(
        self,
        auto: LegAuto,
        item: PlanItem,
        start: Vector,
        target: Vector,
        following: Vector | None,
    ) -> None:
        super().__init__(auto, item)
        self.target = target
        self._stay_s = max(item.params[0], 0.0)
        self._moves_on = following is not None and self._stay_s == 0.0
        chord = _minus(target, start)
        velocity = self.vehicle.motion[3:6]
        self._speed_m_s = math.hypot(*velocity)
        leaving = velocity if self._speed_m_s > MOVING_M_S else chord
        arriving = chord
        if following is not None and self._moves_on:
            arriving = _minus(following, start)
        self._points = _hermite(start, target, leaving, arriving)
        self._speeds = self._speed_profile()
        self._at = 0.0
        self._velocity: Vector = (velocity[0], velocity[1], velocity[2])
        self._began = False
        self._last_s = self.vehicle.now_s
        self._arrived_s: float | None = None

    def _speed_profile(self) -> list[float]:
        """How fast it may be at each point, so that it can still slow down for what comes."""
        limits = self.vehicle.navigator.limits()
        acceleration = BEND_SHARE * limits.acceleration_xy_m_s2
        points, speeds = self._points, []
        for i in range(POINTS + 1):
            before, here, after = points[max(i - 1, 0)], points[i], points[min(i + 1, POINTS)]
            way = _minus(after, before)
            length = max(math.hypot(*way), 1e-6)
            climb = limits.speed_down_m_s if way[2] > 0.0 else limits.speed_up_m_s
            most = min(limits.speed_xy_m_s, climb * length / max(abs(way[2]), 1e-6))
            if 0 < i < POINTS:
                turn = math.dist(
                    _of_length(_minus(here, before), 1.0), _of_length(_minus(after, here), 1.0)
                )
                most = min(most, math.sqrt(acceleration * 0.5 * length / max(turn, 1e-6)))
            speeds.append(most)
        if not self._moves_on:
            speeds[-1] = 0.0
        for i in reversed(range(POINTS)):
            step = math.dist(points[i], points[i + 1])
            in_time = math.sqrt(speeds[i + 1] ** 2 + 2.0 * BRAKE_SHARE * acceleration * step)
            speeds[i] = min(speeds[i], in_time)
        return speeds

    def update(self) -> None:
        """Move the reference on along the curve."""
        copter = self.vehicle
        dt, self._last_s = copter.now_s - self._last_s, copter.now_s
        if not copter.armed or copter.landed:
            return
        limit = BEND_SHARE * copter.navigator.limits().acceleration_xy_m_s2
        index = min(int(self._at), POINTS - 1)
        part = self._at - index
        most = self._speeds[index] * (1.0 - part) + self._speeds[index + 1] * part
        self._speed_m_s = min(self._speed_m_s + limit * dt, max(most, CREEP_M_S))
        step = max(math.dist(self._points[index], self._points[index + 1]), 1e-3)
        self._at = min(self._at + self._speed_m_s * dt / step, float(POINTS))
        index = min(int(self._at), POINTS - 1)
        part = self._at - index
        here, after = self._points[index], self._points[index + 1]
        way = _minus(after, here)
        moving = self._moves_on or self._at < POINTS
        velocity = _of_length(way, self._speed_m_s if moving else 0.0)
        change = _minus(velocity, self._velocity) if dt > 0.0 and moving else (0.0, 0.0, 0.0)
        self._velocity = velocity
        acceleration = _of_length(change, min(math.hypot(*change) / max(dt, 1e-3), 2.0 * limit))
        place = (here[0] + way[0] * part, here[1] + way[1] * part, here[2] + way[2] * part)
        self.follow(place, velocity, acceleration, begins=not self._began)
        self._began = True

    def finished(self) -> bool:
        """At the end of the curve, for long enough."""
        copter = self.vehicle
        if self._at < POINTS:
            return False
        if self._moves_on:
            return True
        if self._arrived_s is None:
            radius_m = copter.parameters["WPNAV_RADIUS"] / 100.0
            if math.dist(copter.motion[:3], self.target) > radius_m:
                return False
            self._arrived_s = copter.now_s
        return copter.now_s - self._arrived_s >= self._stay_s


def _hermite(
    start: Vector, end: Vector, leaving: Sequence[float], arriving: Vector
) -> list[Vector]:
    """POINTS + 1 points of a curve with these directions at its ends."""
    chord = _minus(end, start)
    reach_m = math.hypot(*chord)
    m0, m1 = _of_length(leaving, reach_m), _of_length(arriving, reach_m)
    points = []
    for i in range(POINTS + 1):
        u = i / POINTS
        a, h, k = u * u * (3.0 - 2.0 * u), u * (1.0 - u) ** 2, u * u * (u - 1.0)
        n, e, d = (start[x] + chord[x] * a + m0[x] * h + m1[x] * k for x in range(3))
        points.append((n, e, d))
    return points


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _of_length(vector: Sequence[float], length: float) -> Vector:
    scale = length / max(math.hypot(*vector), 1e-6)
    return vector[0] * scale, vector[1] * scale, vector[2] * scale
