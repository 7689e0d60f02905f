"""The yaw along a trajectory that another program has planned."""

from __future__ import annotations

import itertools
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from navigation_core.geometry import wrap_angle
from navigation_core.trajectories.timed_point import TimedPoint

__all__ = ["TimedYaw"]


@dataclass(frozen=True)
class TimedYaw:
    """Yaws at times, turned between the shorter way: steadily, or with the rates that are given.

    Attributes:
        times_s: rising.
        yaws_enu_rad: at these times.
        rates_rad_s: at these times, counter-clockwise; empty for steady ones between them.
    """

    times_s: tuple[float, ...]
    yaws_enu_rad: tuple[float, ...]
    rates_rad_s: tuple[float, ...] = ()

    @classmethod
    def of(cls, points: Sequence[TimedPoint]) -> TimedYaw | None:
        """Return the yaw through points; None if they give none."""
        yaws = tuple(point.yaw_enu_rad for point in points if point.yaw_enu_rad is not None)
        if not yaws:
            return None
        rates = tuple(point.yaw_rate_rad_s for point in points)
        # Messages have a rate in any case: it is given if it is not zero throughout.
        return cls(tuple(point.time_s for point in points), yaws, rates if any(rates) else ())

    def at(self, time_s: float) -> float:
        """Return the yaw at a time; before the first and after the last, theirs."""
        after = bisect_right(self.times_s, time_s)
        if after in (0, len(self.times_s)):
            return self.yaws_enu_rad[min(after, len(self.times_s) - 1)]
        begin_s, end_s = self.times_s[after - 1 : after + 1]
        lasts_s, share = end_s - begin_s, (time_s - begin_s) / (end_s - begin_s)
        yaw = self.yaws_enu_rad[after - 1]
        turn = wrap_angle(self.yaws_enu_rad[after] - yaw)
        if not self.rates_rad_s:
            return wrap_angle(yaw + turn * share)
        first, last = self.rates_rad_s[after - 1 : after + 1]
        begins, ends = first * lasts_s, last * lasts_s
        # The cubic with these ends and rates.
        second, third = 3.0 * turn - 2.0 * begins - ends, begins + ends - 2.0 * turn
        return wrap_angle(yaw + share * (begins + share * (second + share * third)))

    def greatest_rates(self) -> Iterator[float]:
        """Return the greatest rate, in rad/s, up to each point but the first."""
        rates = self.rates_rad_s or (0.0,) * len(self.times_s)
        for (y_0, y_1), (t_0, t_1), (first, last) in zip(
            itertools.pairwise(self.yaws_enu_rad),
            itertools.pairwise(self.times_s),
            itertools.pairwise(rates),
            strict=True,
        ):
            mean = wrap_angle(y_1 - y_0) / (t_1 - t_0)
            if not self.rates_rad_s:
                yield abs(mean)
                continue
            # The rate is a parabola of the share; it is greatest at its ends or at its vertex.
            slope, curve = 6.0 * mean - 4.0 * first - 2.0 * last, 3.0 * (first + last - 2.0 * mean)
            share = min(max(-0.5 * slope / curve, 0.0), 1.0) if curve else 0.0
            yield max(abs(first), abs(last), abs(first + share * (slope + share * curve)))
