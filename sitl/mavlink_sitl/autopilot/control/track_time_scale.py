"""The pace of the time along a track: slower while a mission is paused.

Shaped as in ArduPilot's AC_WPNav: the speed that the parameters allow becomes zero within the
acceleration and jerk of the position controller, and what the track does is scaled with it.
"""

from __future__ import annotations

import math

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.exchange import Limits

_SCALAR = Ops()


class TrackTimeScale:
    """The share of its speed with which one track is flown."""

    def __init__(self, limits: Limits) -> None:
        """At full speed."""
        self._limits = limits
        self._speed_m_s = limits.speed_xy_m_s
        self.acceleration_m_s2 = 0.0
        """Of the speed that is allowed"""

    @property
    def share(self) -> float:
        """1 at full speed, 0 at a stand."""
        return self._speed_m_s / self._limits.speed_xy_m_s

    @property
    def steady(self) -> bool:
        """Whether it is at full speed."""
        return self.acceleration_m_s2 == 0.0 and self._speed_m_s == self._limits.speed_xy_m_s

    def advance(self, dt_s: float, paused: bool) -> None:
        """Let time pass."""
        limits = self._limits
        most, jerk = limits.acceleration_xy_m_s2, limits.jerk_xy_m_s3
        wanted = 0.0 if paused else limits.speed_xy_m_s
        self._speed_m_s = max(self._speed_m_s + self.acceleration_m_s2 * dt_s, 0.0)
        error = wanted - self._speed_m_s
        size = sqrt_approach(abs(error), jerk / most, jerk, _SCALAR)
        change = math.copysign(min(size, most, abs(error) / dt_s), error) - self.acceleration_m_s2
        self.acceleration_m_s2 += min(max(change, -jerk * dt_s), jerk * dt_s)
        if abs(error) < 1e-3 and abs(self.acceleration_m_s2) < 1e-2:
            self._speed_m_s, self.acceleration_m_s2 = wanted, 0.0
