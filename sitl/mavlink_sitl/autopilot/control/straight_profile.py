"""A straight line from rest to rest within limits of speed, acceleration and jerk.

What the firmware's waypoint navigation does on a leg without corners. Seven phases of
constant jerk, the textbook solution (for example Biagiotti and Melchiorri, "Trajectory
Planning for Automatic Machines and Robots", 3.4).
"""

from __future__ import annotations

import math


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
        self._phases: list[tuple[float, float, float, float, float, float]] = []
        t = s = v = a = 0.0
        for jerk, span in zip(jerks, times, strict=True):
            self._phases.append((t, span, s, v, a, jerk))
            s += v * span + a * span**2 / 2.0 + jerk * span**3 / 6.0
            v += a * span + jerk * span**2 / 2.0
            a += jerk * span
            t += span
        self.duration_s = t

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
