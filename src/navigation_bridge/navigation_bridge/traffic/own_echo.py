"""Recognises reports that are about one's own vehicles: the echo of their transponder. No ROS.

An echo is where the vehicle is, or was just before, and moves as it does, for as long as it is
watched. A neighbour is none: a vehicle that hovers beside one that moves falls behind within
seconds, and beside one that stands it is farther away than an echo's error. Until an echo is
recognised it is traffic like any other.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from navigation_core.tasks.traffic.volumes import Array

__all__ = ["EchoWatch", "OwnTrack"]

# How long and how often it must agree, and how old it may be beyond its stated age.
_WATCHED_S, _REPORTS, _LATENCY_S = 10.0, 8, 1.5
# By how much each report, and all of them in the mean, may be beside the vehicle's own path.
_EACH_M, _MEAN_M = 8.0, 4.0
# By how much the velocities may differ.
_VELOCITY_M_S = 2.0
# Altitudes of another reference differ by a constant. It is believed after such a change of height.
_RISE_M, _CLIMBED_M = 4.0, 10.0
_HISTORY_S = 40.0
_STEP_S = 0.1


class OwnTrack:
    """Where one's own vehicle was in the last seconds."""

    def __init__(self) -> None:
        """Begin without a position."""
        self._moments: deque[tuple[float, Array, Array]] = deque()

    def note(self, position_m: Array, velocity_m_s: Array, now: float) -> None:
        """Take its position and velocity in the traffic frame, both of shape (3,)."""
        self._moments.append((now, position_m, velocity_m_s))
        while now - self._moments[0][0] > _HISTORY_S:
            self._moments.popleft()

    @property
    def position_m(self) -> Array | None:
        """Where it is, shape (3,); None while that is unknown."""
        return self._moments[-1][1] if self._moments else None

    def nearest(self, position_m: Array, time_s: float) -> tuple[Array, Array] | None:
        """Return by how much a position and the velocity there differ from those at a time.

        Args:
            position_m: shape (3,).
            time_s: the time that is stated; it may have been a little earlier.

        Returns:
            The difference of positions, and the vehicle's velocity; None if that is not known.
        """
        if not self._moments or time_s - self._moments[-1][0] > _LATENCY_S:
            return None
        times_s = np.array([moment[0] for moment in self._moments])
        if time_s - _LATENCY_S < times_s[0]:
            return None
        wanted = np.arange(time_s - _LATENCY_S, time_s + _STEP_S, _STEP_S)
        positions = np.stack([moment[1] for moment in self._moments])
        velocities = np.stack([moment[2] for moment in self._moments])
        path, speeds = (
            np.stack([np.interp(wanted, times_s, column) for column in table.T], axis=1)
            for table in (positions, velocities)
        )
        gaps = position_m - path
        row = int(np.hypot(gaps[:, 0], gaps[:, 1]).argmin())
        return gaps[row], speeds[row]


@dataclass
class EchoWatch:
    """Compares the reports about one target with one's own vehicle.

    Attributes:
        is_echo: whether they are about that vehicle.
    """

    is_echo: bool = False
    _since_s: float = math.inf
    _gaps: list[Array] = field(default_factory=list)
    _heights_m: list[float] = field(default_factory=list)

    def watch(
        self, own: OwnTrack, position_m: Array, velocity_m_s: Array | None, time_s: float
    ) -> None:
        """Take a report; one that does not agree begins the watch again.

        Args:
            own: the vehicle.
            position_m: that is reported, in the traffic frame, shape (3,).
            velocity_m_s: the same; None if there is none.
            time_s: when the target was there.
        """
        found = own.nearest(position_m, time_s)
        if found is None:
            return
        gap, own_velocity = found
        agrees = float(np.hypot(gap[0], gap[1])) <= _EACH_M
        if velocity_m_s is not None:
            difference = velocity_m_s[:2] - own_velocity[:2]
            agrees = agrees and float(np.linalg.norm(difference)) <= _VELOCITY_M_S
        if self._gaps and agrees:
            agrees = abs(float(gap[2] - np.mean([one[2] for one in self._gaps]))) <= _RISE_M
        if not agrees:
            self.is_echo, self._since_s = False, math.inf
            self._gaps.clear()
            self._heights_m.clear()
            return
        self._since_s = min(self._since_s, time_s)
        self._gaps.append(gap)
        self._heights_m.append(float(position_m[2]))
        del self._gaps[: -4 * _REPORTS], self._heights_m[: -4 * _REPORTS]
        if self.is_echo or len(self._gaps) < _REPORTS or time_s - self._since_s < _WATCHED_S:
            return
        mean = np.mean(self._gaps, axis=0)
        climbed_m = max(self._heights_m) - min(self._heights_m)
        level_m = float(np.hypot(mean[0], mean[1]))
        is_high = abs(float(mean[2])) <= _RISE_M or climbed_m >= _CLIMBED_M
        self.is_echo = level_m <= _MEAN_M and is_high
