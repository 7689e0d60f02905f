"""Vehicles that fly into each other.

Part of `simulation` (the same layer): looks at the environments of all kinds of vehicles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.environment import (
    FASTEST_M_S,
    VEHICLE_HALF_HEIGHT_M,
    VEHICLE_RADIUS_M,
    Environment,
)

Array = NDArray[np.float64]


class Meeting(NamedTuple):
    """A vehicle has flown into another.

    Attributes:
        row: its place in the simulation.
        other: the place of the other.
        speed_m_s: how fast they were to each other.
    """

    row: int
    other: int
    speed_m_s: float


class Encounters:
    """Finds vehicles that touch; who stands on the ground beside another does not hit it.

    Args:
        environments: of all kinds, with the places of their vehicles in the simulation.
        dt_s: length of a tick.
    """

    def __init__(
        self, environments: Sequence[tuple[Sequence[int], Environment]], dt_s: float
    ) -> None:
        self._environments = environments
        self._dt_s = dt_s
        self._check_tick = 0
        self._count = sum(len(rows) for rows, _ in environments)

    def positions(self) -> Array:
        """The positions of all vehicles in the world, shape (N, 3), NED metres."""
        return self._table(Environment.positions, 3)

    def step(self, tick: int) -> list[Meeting]:
        """Return the pairs of vehicles that have collided in this tick, in both orders."""
        if tick < self._check_tick or self._count < 2:
            return []
        places = self.positions()
        level_m = np.hypot(*(places[:, None, :2] - places[:, :2]).transpose(2, 0, 1))
        upright_m = np.abs(places[:, None, 2] - places[:, 2])
        gaps = np.hypot(
            np.maximum(level_m - 2.0 * VEHICLE_RADIUS_M, 0.0),
            np.maximum(upright_m - 2.0 * VEHICLE_HALF_HEIGHT_M, 0.0),
        )
        gaps[np.diag_indices(self._count)] = math.inf
        soonest_s = float(gaps.min()) / (2.0 * FASTEST_M_S)
        self._check_tick = tick + max(1, int(soonest_s / self._dt_s))
        touching = gaps <= 0.0
        if not touching.any():
            return []
        stands = self._table(Environment.stands, 1)[:, 0] > 0.5
        out = self._table(lambda environment: environment.collided[:, None].astype(float), 1) > 0.5
        touching &= ~(stands[:, None] & stands)
        touching &= ~(out & out.T)
        velocity = self._table(Environment.velocities, 3)
        return [
            Meeting(int(a), int(b), float(np.linalg.norm(velocity[a] - velocity[b])))
            for a, b in zip(*np.nonzero(touching), strict=True)
        ]

    def _table(self, of: Callable[[Environment], Array], columns: int) -> Array:
        table = np.empty((self._count, columns))
        for rows, environment in self._environments:
            table[rows] = of(environment)
        return table
