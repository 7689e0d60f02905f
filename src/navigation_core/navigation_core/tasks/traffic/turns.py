"""Turn rates of intruders, from the courses over ground that are reported one after the other."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from navigation_core.tasks.traffic.volumes import Array

__all__ = ["STRAIGHT", "Turn", "TurnWatch"]

Turn = tuple[float, float]
"""Turn rate in rad/s, to the left seen from above, and for how long it was observed in seconds"""

STRAIGHT: Turn = (0.0, 0.0)

# Below this speed the course is noise.
_SPEED_MIN_M_S = 1.0
# Maximum lateral acceleration of an intruder: a course that changes faster has jumped.
_ACCELERATION_MAX_M_S2 = 15.0
# Least time between two courses that are compared, and time for which courses are kept.
_GAP_S, _KEPT_S = 0.4, 20.0
# Time over which the turn rate is averaged, and the least time that it needs.
_BASE_S, _BASE_MIN_S = 1.8, 0.7
# After a longer silence the turn is unknown.
_SILENCE_S = 6.0
# It has turned for as long as its average turn rate equals the present one, within this share plus
# noise.
_SHARE, _NOISE_RAD_S = 0.3, 0.005


class TurnWatch:
    """Estimates the turn of one intruder."""

    def __init__(self) -> None:
        """Begin without a report."""
        self._courses: deque[tuple[float, float]] = deque()

    def watch(self, velocity_m_s: Array, time_s: float) -> Turn:
        """Take a velocity, shape (3,), east, north and up, and return the turn.

        Args:
            velocity_m_s: as it was reported.
            time_s: when it was measured.
        """
        courses = self._courses
        speed_m_s = math.hypot(velocity_m_s[0], velocity_m_s[1])
        if speed_m_s < _SPEED_MIN_M_S:
            courses.clear()
            return STRAIGHT
        if courses and time_s - courses[-1][0] > _SILENCE_S:
            courses.clear()
        if not courses or time_s - courses[-1][0] >= _GAP_S:
            course_rad = math.atan2(velocity_m_s[1], velocity_m_s[0])
            if courses:  # continuous across north
                course_rad = courses[-1][1] + math.remainder(course_rad - courses[-1][1], math.tau)
            courses.append((time_s, course_rad))
        while courses[-1][0] - courses[0][0] > _KEPT_S:
            courses.popleft()
        return self._turn(speed_m_s)

    def _turn(self, speed_m_s: float) -> Turn:
        times_s, courses_rad = np.array(self._courses).T
        ages_s = times_s[-1] - times_s[:-1]
        if not len(ages_s) or ages_s[0] < _BASE_MIN_S:
            return STRAIGHT
        rates = (courses_rad[-1] - courses_rad[:-1]) / ages_s
        base = max(int(np.searchsorted(-ages_s, -_BASE_S, side="right")) - 1, 0)
        rate = rates[base]
        differs = np.abs(rates[:base] - rate) > _SHARE * abs(rate) + _NOISE_RAD_S
        first = int(np.flatnonzero(differs)[-1]) + 1 if differs.any() else 0
        if abs(rates[first]) * speed_m_s > _ACCELERATION_MAX_M_S2:
            return STRAIGHT
        return float(rates[first]), float(ages_s[first])
