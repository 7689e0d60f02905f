"""Intruders: moving vehicles that reserve nothing, and are avoided in space and time.

No server controls them, and they give way to no one. Their positions are predicted from the last
report, with an error that grows with time: straight on, and along the arc if they turn. The worse
prediction counts. Reservations do not help against them: they fly into reserved volumes, and a
vehicle that stops beside their path may be on it after they turn. So a vehicle's motion is compared
with theirs at each moment.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.tasks.traffic.volumes import Array, Indices, Separation

__all__ = ["HORIZON_S", "STRAIGHT", "Intruder", "Intruders", "Passage", "Turn", "TurnWatch"]

HORIZON_S = 20.0
"""Time for which the motion of an intruder is predicted"""

TURNS_M_S2, CLIMBS_M_S = 0.5, 1.0
"""Lateral acceleration and vertical speed of an intruder that its reports need not show"""

# Maximum errors of a prediction: a new report comes long before they are larger.
_ASIDE_MAX_M, _RISE_MAX_M = 10.0, 6.0
# An intruder that turns is predicted to end its turn now, and to continue it for twice the time for
# which it was seen to turn.
_TURNS_ON: Array = np.array([0.0, 2.0])
# Maximum number of intruders that are compared, the most urgent ones.
_COMPARED_MAX = 12
# Weight in the penalty of the squared deficit at the closest approach, beside the mean deficit. The
# square makes the nearest of several intruders count most.
_LEAST_WEIGHT = 4.0

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


@dataclass(frozen=True, eq=False)
class Intruder:
    """How an intruder moves.

    Attributes:
        position_m: its reported position, traffic frame, shape (3,).
        velocity_m_s: its velocity, shape (3,).
        time_s: time of that position.
        error_m: error of the position, horizontal.
        rise_m: error of the altitude.
        turn: its turn rate, and for how long it was seen.
    """

    position_m: Array
    velocity_m_s: Array
    time_s: float
    error_m: float
    rise_m: float
    turn: Turn = STRAIGHT

    def paths(self, since_s: Array) -> Array:
        """Return its positions on each of its predicted paths, (H, T, 3).

        It goes straight on. If it turns, the second path continues the turn for some time first.

        Args:
            since_s: the moments, counted from its report, shape (T,).
        """
        rate, observed_s = self.turn
        turns_s = np.minimum(since_s, observed_s * _TURNS_ON[: 1 if rate == 0.0 else None, None])
        half_rad = 0.5 * rate * turns_s
        # The chord of the arc, and straight on from its end.
        along = turns_s * np.sinc(half_rad / np.pi) * np.exp(1j * half_rad)
        along += (since_s - turns_s) * np.exp(2j * half_rad)
        east, north, up = self.velocity_m_s
        moved = along * complex(east, north)
        height = np.broadcast_to(up * since_s, moved.shape)
        return np.asarray(self.position_m + np.stack([moved.real, moved.imag, height], axis=2))


@dataclass(frozen=True, eq=False)
class Passage:
    """Distances of motions to intruders, as shares of the required distance; 1 is enough.

    Attributes:
        shares: the least share of each motion, shape (K,).
        penalties: penalty of each motion, shape (K,): 0 if its share is never below the margin.
        worst: row of the intruder that comes nearest to each motion, shape (K,).
    """

    shares: Array
    penalties: Array
    worst: Indices


@dataclass(frozen=True, eq=False)
class Intruders:
    """The intruders that may come near one vehicle at one moment, as arrays.

    Attributes:
        names: their names.
        reported: their last reports.
        age_s: age of the reports, shape (M,).
        level_m: required horizontal distance to each, shape (M,).
        upright_m: required vertical distance to each, shape (M,).
    """

    names: tuple[str, ...]
    reported: tuple[Intruder, ...]
    age_s: Array
    level_m: Array
    upright_m: Array

    @classmethod
    def of(
        cls,
        intruders: Sequence[tuple[str, Intruder]],
        separation: Separation,
        room_m: tuple[float, float],
        now: float,
    ) -> Intruders:
        """Return them as they are at one moment.

        Args:
            intruders: with their names.
            separation: required beyond the errors of their reports.
            room_m: tracking error of the vehicle, horizontal and vertical.
            now: time in seconds.
        """
        reported = tuple(one for _, one in intruders)
        return cls(
            tuple(name for name, _ in intruders),
            reported,
            np.array([now - one.time_s for one in reported]),
            np.array([one.error_m for one in reported]) + separation.horizontal_m + room_m[0],
            np.array([one.rise_m for one in reported]) + separation.vertical_m + room_m[1],
        )

    def __len__(self) -> int:
        """How many."""
        return len(self.names)

    def without_errors(self, separation: Separation) -> Intruders:
        """Return them as if their reports were exact, so that only the separation is required."""
        count = len(self)
        return replace(
            self,
            level_m=np.full(count, separation.horizontal_m),
            upright_m=np.full(count, separation.vertical_m),
        )

    def near(self, here_m: Array, speed_m_s: float) -> Intruders:
        """Return those that may come near a vehicle within the horizon, the most urgent ones.

        Args:
            here_m: its position, in the traffic frame, shape (3,).
            speed_m_s: its maximum speed.
        """
        position_m = np.array([one.position_m for one in self.reported]).reshape(-1, 3)
        velocity = np.array([one.velocity_m_s for one in self.reported]).reshape(-1, 3)
        its_speed_m_s = np.linalg.norm(velocity, axis=1)
        away_m = np.linalg.norm(position_m - here_m, axis=1) - its_speed_m_s * self.age_s
        away_m -= np.hypot(self.level_m + _ASIDE_MAX_M, self.upright_m + _RISE_MAX_M)
        time_s = away_m / (its_speed_m_s + speed_m_s)
        rows = np.flatnonzero(time_s < HORIZON_S)
        rows = rows[np.argsort(time_s[rows], kind="stable")[:_COMPARED_MAX]]
        return Intruders(
            tuple(self.names[row] for row in rows),
            tuple(self.reported[row] for row in rows),
            self.age_s[rows],
            self.level_m[rows],
            self.upright_m[rows],
        )

    def passage(self, points_m: Array, after_s: Array, margin: float = 1.0) -> Passage:
        """Return the distances of motions to them.

        Between the moments all move on straight lines, so that a fast one is not missed.

        Args:
            points_m: the vehicle's position at each moment, shape (K, T, 3), traffic frame.
            after_s: the moments from now on, shape (T,), T > 1.
            margin: the share that is enough.
        """
        count = len(points_m)
        least, penalty = np.full(count, np.inf), np.zeros(count)
        worst = np.zeros(count, dtype=np.intp)
        for row in range(len(self)):
            share = self._shares(row, points_m, after_s)
            lowest = share.min(axis=1)
            worst[lowest < least] = row
            least = np.minimum(least, lowest)
            lacks = np.maximum(margin - share, 0.0)
            penalty += _LEAST_WEIGHT * np.maximum(margin - lowest, 0.0) ** 2 + lacks.mean(axis=1)
        return Passage(least, penalty, worst)

    def _shares(self, row: int, points_m: Array, after_s: Array) -> Array:
        """Return the least share of the required distance between each two moments, (K, T - 1).

        The worst of the intruder's predicted paths counts.
        """
        intruder, age_s = self.reported[row], self.age_s[row]
        gap = points_m[:, None] - intruder.paths(after_s + age_s)
        begin, step = gap[:, :, :-1], np.diff(gap, axis=2)
        length2 = np.maximum((step[..., :2] ** 2).sum(axis=3), 1e-12)
        part = np.clip(-(begin[..., :2] * step[..., :2]).sum(axis=3) / length2, 0.0, 1.0)
        nearest = begin + part[..., None] * step
        since_s = after_s[1:] + age_s
        speed_m_s = float(np.linalg.norm(intruder.velocity_m_s))
        aside_m = np.minimum(
            0.5 * TURNS_M_S2 * since_s * since_s, np.minimum(speed_m_s * since_s, _ASIDE_MAX_M)
        )
        rise_m = np.minimum(CLIMBS_M_S * since_s, _RISE_MAX_M)
        level = np.hypot(nearest[..., 0], nearest[..., 1]) / (self.level_m[row] + aside_m)
        upright = np.abs(nearest[..., 2]) / (self.upright_m[row] + rise_m)
        return np.asarray(np.maximum(level, upright).min(axis=1))


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
