"""A straight line from rest to rest within limits of speed, acceleration and jerk.

The speed may change during the flight; the rest of the line is then flown with the new one.

The firmware's waypoint navigation flies a leg without corners like this. Seven phases of
constant jerk, the textbook solution (for example Biagiotti and Melchiorri, "Trajectory
Planning for Automatic Machines and Robots", 3.4).
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable

Phase = tuple[float, float, float, float, float, float]
"""Begin, duration, and at its begin distance, speed and acceleration; jerk"""
SEARCHES = 30
"""For the greatest speed from which there is room to stop"""


class LineProfile:
    """Distance, speed and acceleration along a line over time.

    Args:
        length_m: how far, >= 0.
        speed_m_s: largest speed, > 0.
        acceleration_m_s2: largest acceleration, > 0.
        jerk_m_s3: jerk, > 0.
    """

    def __init__(
        self, length_m: float, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float
    ) -> None:
        self.length_m = length_m
        self._acceleration_m_s2, self._jerk_m_s3 = acceleration_m_s2, jerk_m_s3
        # Jerk phases as short as the acceleration limit, the speed limit or the way allows.
        ramp = min(
            acceleration_m_s2 / jerk_m_s3,
            math.sqrt(speed_m_s / jerk_m_s3),
            (length_m / (2.0 * jerk_m_s3)) ** (1.0 / 3.0),
        )
        peak = jerk_m_s3 * ramp
        steady = 0.0
        if peak > 0.0:
            # Length of acceleration at its peak: limited by speed, or by half of the way:
            # (peak/2) (ramp + steady) (2 ramp + steady) = length / 2.
            by_speed = speed_m_s / peak - ramp
            by_way = (-3.0 * ramp + math.sqrt(ramp * ramp + 4.0 * length_m / peak)) / 2.0
            steady = max(min(by_speed, by_way), 0.0)
        top = peak * (ramp + steady)
        climb = top * (2.0 * ramp + steady)
        cruise = max(length_m - climb, 0.0) / top if top > 0.0 else 0.0
        jerks = (jerk_m_s3, 0.0, -jerk_m_s3, 0.0, -jerk_m_s3, 0.0, jerk_m_s3)
        times = (ramp, steady, ramp, cruise, ramp, steady, ramp)
        self._phases: list[Phase] = []
        self.duration_s = 0.0
        self._add(zip(jerks, times, strict=True), 0.0, 0.0, 0.0)

    @property
    def speeds_up_until_s(self) -> float:
        """When the acceleration ends, of a line whose speed was not changed."""
        return self._phases[3][0]

    @property
    def brakes_from_s(self) -> float:
        """When the last deceleration begins."""
        return self._phases[-3][0]

    def _add(
        self, jerks: Iterable[tuple[float, float]], s: float, v: float, a: float
    ) -> tuple[float, float]:
        """Append phases of jerk and duration; distance and speed after them."""
        t = self.duration_s
        for jerk, span in jerks:
            self._phases.append((t, span, s, v, a, jerk))
            s += v * span + a * span**2 / 2.0 + jerk * span**3 / 6.0
            v += a * span + jerk * span**2 / 2.0
            a += jerk * span
            t += span
        self.duration_s = t
        return s, v

    def with_speed(self, speed_m_s: float, time_s: float) -> LineProfile | None:
        """The same line with another largest speed from a time on.

        Returns:
            It, or None where nothing can change any more: it brakes for its end already.
        """
        if time_s >= self.duration_s:
            return None
        s, v, a = self.at(time_s)
        if a < -1e-9:
            return None
        other = copy.copy(self)
        other._phases = [phase for phase in self._phases if phase[0] <= time_s]
        begin, _, *at_begin, jerk = other._phases[-1]
        s0, v0, a0 = at_begin
        other._phases[-1] = (begin, max(time_s, 0.0) - begin, s0, v0, a0, jerk)
        other.duration_s = max(time_s, 0.0)
        # The present acceleration ends first.
        s, v = other._add([(-self._jerk_m_s3, a / self._jerk_m_s3)], s, v, a)
        left = self.length_m - s
        if left < self._ramp(v, speed_m_s)[1] + self._ramp(speed_m_s, 0.0)[1]:
            speed_m_s = self._most(v, speed_m_s, left)
        phases, gone = self._ramp(v, speed_m_s)
        last, needed = self._ramp(speed_m_s, 0.0)
        cruise = left - gone - needed
        if cruise < 0.0:
            return None
        other._add([*phases, (0.0, cruise / speed_m_s), *last], s, v, 0.0)
        return other

    def _ramp(self, from_m_s: float, to_m_s: float) -> tuple[list[tuple[float, float]], float]:
        """The phases from one speed to another, and the distance they take."""
        change = to_m_s - from_m_s
        if abs(change) < 1e-9:
            return [], 0.0
        jerk = math.copysign(self._jerk_m_s3, change)
        ramp = min(
            self._acceleration_m_s2 / self._jerk_m_s3, math.sqrt(abs(change) / self._jerk_m_s3)
        )
        steady = max(abs(change) / (self._jerk_m_s3 * ramp) - ramp, 0.0)
        phases = [(jerk, ramp), (0.0, steady), (-jerk, ramp)]
        return phases, (from_m_s + to_m_s) / 2.0 * (2.0 * ramp + steady)

    def _most(self, from_m_s: float, to_m_s: float, left_m: float) -> float:
        """The speed nearest to a wanted one from which the rest is enough to stop."""
        near, far = from_m_s, to_m_s
        for _ in range(SEARCHES):
            middle = (near + far) / 2.0
            room = left_m - self._ramp(from_m_s, middle)[1] - self._ramp(middle, 0.0)[1]
            near, far = (middle, far) if room >= 0.0 else (near, middle)
        return near

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Distance, speed and acceleration `time_s` after the start."""
        if time_s >= self.duration_s:
            return self.length_m, 0.0, 0.0
        time_s = max(time_s, 0.0)
        for begin, span, s, v, a, jerk in self._phases:
            dt = time_s - begin
            if dt <= span:
                return (
                    s + v * dt + a * dt**2 / 2.0 + jerk * dt**3 / 6.0,
                    v + a * dt + jerk * dt**2 / 2.0,
                    a + jerk * dt,
                )
        return self.length_m, 0.0, 0.0
