"""Intruders: vehicles on the move that reserve nothing, so that they are avoided in time.

Nobody here leads them, and they give way to nobody. Where they will be is predicted: straight on
from the last report, less certain with time. Reservations are no use against them: they fly into
what is reserved, and who stops before their path may stand in it once they turn. So the motion of
a vehicle is compared with theirs, moment by moment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.traffic.volumes import Array, Indices, Separation

__all__ = ["HORIZON_S", "Intruder", "Intruders", "Passage"]

HORIZON_S = 20.0
"""So far ahead an intruder is predicted"""

TURNS_M_S2, CLIMBS_M_S = 0.5, 1.0
"""By how much an intruder may turn, or change its height, unseen"""

# A prediction gets no more doubtful than that: a new report comes long before.
_ASIDE_MAX_M, _RISE_MAX_M = 10.0, 6.0
# Of those that may come near, so many are looked at, the most urgent ones.
_MOST = 12
# What the least share counts beside the mean.
_LEAST_WEIGHT = 4.0


@dataclass(frozen=True, eq=False)
class Intruder:
    """How an intruder moves.

    Attributes:
        position_m: where it was reported, in the traffic frame, shape (3,).
        velocity_m_s: its velocity, shape (3,).
        time_s: when it was there.
        error_m: by how much the position may be wrong, level.
        rise_m: the same for the altitude.
    """

    position_m: Array
    velocity_m_s: Array
    time_s: float
    error_m: float
    rise_m: float


@dataclass(frozen=True, eq=False)
class Passage:
    """How near motions come to intruders, as shares of what is to be kept; 1 is enough.

    Attributes:
        shares: the least share of each motion, shape (K,).
        penalties: how bad each motion is, shape (K,): 0 if its share is never below the margin.
        worst: of each motion, which intruder comes nearest, shape (K,).
    """

    shares: Array
    penalties: Array
    worst: Indices


@dataclass(frozen=True, eq=False)
class Intruders:
    """The intruders that may come near one vehicle at one moment, as arrays.

    Attributes:
        names: of them.
        position_m: where they are, in the traffic frame, shape (M, 3).
        velocity_m_s: how they move, shape (M, 3).
        age_s: time since they were reported, shape (M,).
        level_m: what is to be kept from them, level, shape (M,).
        upright_m: the same in height, shape (M,).
    """

    names: tuple[str, ...]
    position_m: Array
    velocity_m_s: Array
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
            separation: to be kept beside their errors.
            room_m: by how much the vehicle strays from its path, level and in height.
            now: time in seconds.
        """
        reported = [one for _, one in intruders]
        age_s = np.array([now - one.time_s for one in reported])
        velocity = np.array([one.velocity_m_s for one in reported]).reshape(-1, 3)
        position = np.array([one.position_m for one in reported]).reshape(-1, 3)
        return cls(
            tuple(name for name, _ in intruders),
            position + velocity * age_s[:, None],
            velocity,
            age_s,
            np.array([one.error_m for one in reported]) + separation.horizontal_m + room_m[0],
            np.array([one.rise_m for one in reported]) + separation.vertical_m + room_m[1],
        )

    def __len__(self) -> int:
        """How many."""
        return len(self.names)

    def without_errors(self, separation: Separation) -> Intruders:
        """Return them as if their reports were exact: only the separation is to be kept."""
        count = len(self)
        return replace(
            self,
            level_m=np.full(count, separation.horizontal_m),
            upright_m=np.full(count, separation.vertical_m),
        )

    def near(self, here_m: Array, speed_m_s: float) -> Intruders:
        """Return those that may come near a vehicle within the horizon, the most urgent ones.

        Args:
            here_m: where it is, in the traffic frame, shape (3,).
            speed_m_s: how fast it can be.
        """
        away_m = np.linalg.norm(self.position_m - here_m, axis=1)
        away_m -= np.hypot(self.level_m + _ASIDE_MAX_M, self.upright_m + _RISE_MAX_M)
        time_s = away_m / (np.linalg.norm(self.velocity_m_s, axis=1) + speed_m_s)
        rows = np.flatnonzero(time_s < HORIZON_S)
        rows = rows[np.argsort(time_s[rows], kind="stable")[:_MOST]]
        return Intruders(
            tuple(self.names[row] for row in rows),
            self.position_m[rows],
            self.velocity_m_s[rows],
            self.age_s[rows],
            self.level_m[rows],
            self.upright_m[rows],
        )

    def passage(self, points_m: Array, after_s: Array, margin: float = 1.0) -> Passage:
        """Return how near motions come to them.

        Between the moments all move straight on, so that nobody is missed however fast.

        Args:
            points_m: where the vehicle is at each moment, shape (K, T, 3), traffic frame.
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
            penalty += _LEAST_WEIGHT * np.maximum(margin - lowest, 0.0) + lacks.mean(axis=1)
        return Passage(least, penalty, worst)

    def _shares(self, row: int, points_m: Array, after_s: Array) -> Array:
        """Return the least share of what is to be kept between each two moments, (K, T - 1)."""
        path = self.position_m[row] + self.velocity_m_s[row] * after_s[:, None]
        gap = points_m - path
        begin, step = gap[:, :-1], np.diff(gap, axis=1)
        length2 = np.maximum((step[..., :2] ** 2).sum(axis=2), 1e-12)
        part = np.clip(-(begin[..., :2] * step[..., :2]).sum(axis=2) / length2, 0.0, 1.0)
        nearest = begin + part[..., None] * step
        since_s = after_s[1:] + self.age_s[row]
        speed_m_s = float(np.linalg.norm(self.velocity_m_s[row]))
        aside_m = np.minimum(
            0.5 * TURNS_M_S2 * since_s * since_s, np.minimum(speed_m_s * since_s, _ASIDE_MAX_M)
        )
        rise_m = np.minimum(CLIMBS_M_S * since_s, _RISE_MAX_M)
        level = np.hypot(nearest[..., 0], nearest[..., 1]) / (self.level_m[row] + aside_m)
        upright = np.abs(nearest[..., 2]) / (self.upright_m[row] + rise_m)
        return np.asarray(np.maximum(level, upright))
