"""Estimates consumption in use, and the battery that remains after a flight.

Time empties a battery, not distance: a copter needs nearly as much to hover as to fly, and a rover
that stands needs next to nothing. So the estimate is a fraction of the battery for each second
under way (in the air, or driving). It begins with the configured endurance and approaches the
measured one as measurements come in.

Gauges are not trusted blindly. A fraction that falls faster than any battery can be emptied
is a jump (a voltage that sags at take-off; PX4's simulated battery falls to 50 % within half a
minute of arming and then stands still) and is not taken for consumption; nor does a gauge that
stands still make the endurance endless.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_WINDOW_S = 10.0
# A battery that is emptied in less than two minutes does not fly anything home.
_RATE_MAX_PER_S = 1.0 / 120.0
# A gauge that rises by more than this shows another battery, or a charged one.
_SWAPPED = 0.05
# The configured endurance counts as much as this time of measurements.
_PRIOR_S = 120.0
_MEMORY_S = 600.0
_LEAST_SHARE = 1.0 / 3.0


@dataclass(frozen=True)
class Prediction:
    """The battery that remains after a flight, as fractions that may be negative.

    Attributes:
        now: what is there.
        at_end: what is left at the end of the goal.
        back: what is left when it has come back and landed.
        goal_s: time of the goal.
        back_s: time of the return.
        rate_per_s: consumption that was reckoned with.
        measured: whether that was measured for a while, not only configured.
    """

    now: float
    at_end: float
    back: float
    goal_s: float
    back_s: float
    rate_per_s: float
    measured: bool

    def describe(self) -> str:
        """Describe it with all numbers."""
        source = "measured" if self.measured else "assumed from battery_endurance_s"
        return (
            f"the battery is at {100 * self.now:.0f} %; at {6000 * self.rate_per_s:.1f} % a "
            f"minute ({source}) {self.goal_s:.0f} s for the goal leave "
            f"{100 * max(self.at_end, 0.0):.0f} % and {self.back_s:.0f} s for the return "
            f"{100 * max(self.back, 0.0):.0f} %"
        )


class ConsumptionEstimator:
    """Learns how fast the battery empties under way.

    Attributes:
        endurance_s: how long a full battery lasts, as far as nothing is measured.
    """

    def __init__(self, endurance_s: float) -> None:
        """Begin with the configured endurance of a full battery."""
        self.endurance_s = endurance_s
        self._used = 0.0
        self._measured_s = 0.0
        self._remaining: float | None = None
        self._window: tuple[float, float] | None = None

    @property
    def remaining(self) -> float | None:
        """The last reported fraction, None while it is unknown."""
        return self._remaining

    @property
    def rate_per_s(self) -> float:
        """Fraction of the battery that a second under way takes."""
        prior = 1.0 / self.endurance_s
        rate = (_PRIOR_S * prior + self._used) / (_PRIOR_S + self._measured_s)
        return max(rate, _LEAST_SHARE * prior)

    @property
    def measured_rate_per_s(self) -> float | None:
        """The same by measurements alone; None before two minutes of them."""
        if self._measured_s < _PRIOR_S or self._used <= 0.0:
            return None
        return self._used / self._measured_s

    def observe(self, time_s: float, remaining: float | None, under_way: bool) -> None:
        """Process what the battery says.

        Args:
            time_s: when.
            remaining: fraction from 0 to 1; None, NaN or anything else when it is not known.
            under_way: whether the vehicle flies or drives.
        """
        if remaining is None or not 0.0 <= remaining <= 1.0:
            self._remaining = self._window = None
            return
        last, self._remaining = self._remaining, remaining
        if last is not None and remaining > last + _SWAPPED:
            self._used = self._measured_s = 0.0
            self._window = None
        if not under_way:
            self._window = None
        elif self._window is None:
            self._window = (time_s, remaining)
        elif time_s - self._window[0] >= _WINDOW_S:
            self._close(self._window, time_s, remaining)
            self._window = (time_s, remaining)

    def _close(self, window: tuple[float, float], time_s: float, remaining: float) -> None:
        elapsed_s, used = time_s - window[0], window[1] - remaining
        # After a silence nobody knows what happened in between.
        if elapsed_s > 3.0 * _WINDOW_S or used > _RATE_MAX_PER_S * elapsed_s:
            return
        self._used = max(self._used + used, 0.0)
        self._measured_s += elapsed_s
        if self._measured_s > _MEMORY_S:
            self._used *= _MEMORY_S / self._measured_s
            self._measured_s = _MEMORY_S

    def predict(self, goal_s: float, back_s: float) -> Prediction | None:
        """Return what will be left, or None while the battery is not known.

        Args:
            goal_s: time to the end of the goal.
            back_s: time from there back to the launch point, landing included.
        """
        if self._remaining is None or not math.isfinite(goal_s + back_s):
            return None
        rate = self.rate_per_s
        at_end = self._remaining - rate * goal_s
        return Prediction(
            self._remaining,
            at_end,
            at_end - rate * back_s,
            goal_s,
            back_s,
            rate,
            self._measured_s >= _PRIOR_S,
        )
