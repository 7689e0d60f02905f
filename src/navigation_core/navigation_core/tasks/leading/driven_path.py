"""The path of a trajectory for ground vehicles: a line with a speed and without a time.

A car or a boat cannot be where a trajectory says at a time: it has to turn round first, it slides,
and its firmware accelerates as it likes. So it is not asked to. It is where its place projects
onto the path, it heads for a point on the path ahead of that, and it is sent the speed that the
path allows there, from which it can brake for the corners ahead.
"""

from __future__ import annotations

import bisect
import math

import numpy as np

from navigation_core.geometry import ZERO, Vector3, add, distance, dot, scale, subtract
from navigation_core.trajectories.trajectory import Trajectory

# The path is sampled in such steps of time, and no more often than this.
_STEP_S = 0.1
_STEPS_MAX = 5000
# It is not looked for further ahead than this: the path may come back to where it was.
_WINDOW_M = 2.0
# Speeds and distances that differ by less than this are the same.
_SAME_M_S, _SAME_M = 0.01, 1e-6


class DrivenPath:
    """One trajectory's path; remembers how far along it the vehicle has come.

    Attributes:
        time_s: when the trajectory is where the vehicle has come to.
        aside_enu_m: how far beside the path the points ahead are, but for its end.
    """

    def __init__(self, trajectory: Trajectory, braking_m_s2: float, time_s: float = 0.0) -> None:
        """Begin at its beginning, or further on.

        Args:
            trajectory: gives the path, and the speeds of its corners.
            braking_m_s2: how hard the vehicle is meant to brake before them.
            time_s: when the trajectory is where the vehicle is.
        """
        duration_s = trajectory.duration_s
        count = min(max(math.ceil(duration_s / _STEP_S), 1), _STEPS_MAX)
        self._step_s = duration_s / count
        places = trajectory.samples(np.linspace(0.0, duration_s, count, endpoint=False))[0]
        points = [(x, y, z) for x, y, z in places.tolist()]
        self._points = [*points, trajectory.end_position_enu_m]
        self._lengths = [distance(a, b) for a, b in zip(points, self._points[1:], strict=True)]
        self._gone_m = [0.0]
        for length_m in self._lengths:
            self._gone_m.append(self._gone_m[-1] + length_m)
        self._allowed_m_s = self._speeds(braking_m_s2)
        self._index = min(int(time_s / self._step_s), count - 1) if self._step_s else 0
        self._share, self.aside_enu_m = 0.0, ZERO
        self._until_m = self._gone_m[-1]

    @property
    def time_s(self) -> float:
        """See the class."""
        return (self._index + self._share) * self._step_s

    @property
    def left_m(self) -> float:
        """Length of the path from there to its end."""
        return self._gone_m[-1] - self._here_m

    @property
    def speed_m_s(self) -> float:
        """The maximum speed that the path allows there; infinite if nothing limits it."""
        return self._allowed_m_s[min(self._index, len(self._allowed_m_s) - 1)]

    @property
    def _here_m(self) -> float:
        if self._index >= len(self._lengths):
            return self._gone_m[-1]
        return self._gone_m[self._index] + self._share * self._lengths[self._index]

    def advance(self, position_enu_m: Vector3) -> None:
        """Advance to where the path is nearest to a place: never back, and not far ahead.

        Nor beyond what may be looked ahead to: where the path turns back at a point, what continues
        from there is as near as what leads to it.
        """
        best, least_m = (self._index, self._share), math.inf
        until_m = self._here_m + _WINDOW_M
        for i in range(self._index, len(self._lengths)):
            if self._gone_m[i] > until_m or self._gone_m[i] >= self._until_m:
                break
            share, away_m = self._nearest(i, position_enu_m)
            if away_m < least_m - _SAME_M:
                best, least_m = (i, share), away_m
        self._index, self._share = best
        if self._share >= 1.0:
            self._index, self._share = self._index + 1, 0.0

    def _nearest(self, index: int, position_enu_m: Vector3) -> tuple[float, float]:
        """Return where a step is nearest to a place, as a share of it, and how near."""
        start, length_m = self._points[index], self._lengths[index]
        line = subtract(self._points[index + 1], start)
        share = 1.0
        if length_m > 0.0:
            share = dot(subtract(position_enu_m, start), line) / (length_m * length_m)
        share = min(max(share, self._share if index == self._index else 0.0), 1.0)
        return share, distance(add(start, scale(line, share)), position_enu_m)

    def limit(self, until_s: float) -> None:
        """Look no further ahead than where the trajectory is at a time, until the next call."""
        step = (
            min(max(math.ceil(until_s / self._step_s), 0), len(self._lengths))
            if (math.isfinite(until_s) and self._step_s > 0.0)
            else len(self._lengths)
        )
        self._until_m = self._gone_m[step]

    @property
    def ahead_m(self) -> float:
        """The largest look-ahead distance."""
        return max(self._until_m - self._here_m, 0.0)

    def ahead(self, distance_m: float) -> Vector3:
        """Return the point this far ahead along the path, or the farthest that may be looked at.

        Where the vehicle has come beyond that point, the point is behind it: one beside it would be
        headed for, and left, for as long as it drives.
        """
        wanted_m = min(self._here_m + distance_m, self._until_m)
        if wanted_m >= self._gone_m[-1]:
            return self._points[-1]
        index = bisect.bisect_right(self._gone_m, wanted_m) - 1
        start, line = self._points[index], subtract(self._points[index + 1], self._points[index])
        share = (wanted_m - self._gone_m[index]) / self._lengths[index]
        return add(add(start, self.aside_enu_m), scale(line, share))

    def _speeds(self, braking_m_s2: float) -> list[float]:
        """Return the speed that each step allows.

        Where the trajectory speeds up, it does so because it has to begin at rest, or come out
        of a corner: that binds nobody who is faster there. Its last brake does not count either,
        as how to come to rest is the business of who drives.
        """
        speeds = [length_m / self._step_s if self._step_s else 0.0 for length_m in self._lengths]
        last = len(speeds) - 1
        while last > 0 and speeds[last - 1] > speeds[last] + _SAME_M_S:
            last -= 1
        allowed_m_s, following = [math.inf] * len(speeds), math.inf
        for i in range(last - 1, -1, -1):
            following = math.sqrt(following**2 + 2.0 * braking_m_s2 * self._lengths[i])
            if i > 0 and speeds[i] <= speeds[i - 1] + _SAME_M_S:
                following = min(following, speeds[i])
            allowed_m_s[i] = following
        return allowed_m_s
