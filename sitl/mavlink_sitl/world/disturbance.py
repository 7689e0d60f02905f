"""A world's random disturbances: gusts of wind and GPS outages. Seeded.

Each vehicle draws from its own generators, so adding a vehicle changes nothing for the
others.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.world.model import GpsQuality, Wind


class Gusts:
    """Wind with gusts: a first-order Gauss-Markov process on each horizontal axis.

    Up and down it is half as strong. Between two draws the wind goes over evenly.

    Args:
        seed: of the gusts.
        step_s: time between two draws.
        rows: the vehicles' places in the simulation.
    """

    def __init__(self, wind: Wind, seed: int, o: Ops, step_s: float, rows: Sequence[int]) -> None:
        self.wind = wind
        self._o = o
        self._keep = math.exp(-step_s / wind.gust_time_s)
        self._kick = wind.gust_m_s * math.sqrt(1.0 - self._keep**2)
        self._generators = [random.Random(f"gusts:{seed}:{i}") for i in rows]
        self._gust = self._next = (o.full(0.0), o.full(0.0), o.full(0.0))

    def draw(self) -> None:
        """Choose where the wind goes next."""
        o = self._o
        draws = [[g.gauss(0.0, self._kick) for _ in range(3)] for g in self._generators]
        kicks = [o.pack([three[axis] for three in draws]) for axis in range(3)]
        self._gust = self._next
        n, e, d = self._gust
        self._next = (
            self._keep * n + kicks[0],
            self._keep * e + kicks[1],
            self._keep * d + 0.5 * kicks[2],
        )

    def velocity(self, part: float) -> tuple[Lane, Lane, Lane]:
        """The wind, NED m/s, when this part (0..1) of the time between two draws is over."""
        n, e, d = (g + (x - g) * part for g, x in zip(self._gust, self._next, strict=True))
        steady = self.wind.velocity_ned_m_s
        return steady[0] + n, steady[1] + e, steady[2] + d


class Dropouts:
    """Random losses of the GPS fix.

    Args:
        seed: of the times.
        rows: the vehicles' places in the simulation.
    """

    def __init__(self, quality: GpsQuality, seed: int, rows: Sequence[int]) -> None:
        self._quality = quality
        self._generators = [random.Random(f"gps:{seed}:{i}") for i in rows]
        self._next_s = [self._after(generator, 0.0) for generator in self._generators]
        self._until_s = [0.0] * len(rows)
        self._soonest_s = min(self._next_s)

    def _after(self, generator: random.Random, time_s: float) -> float:
        per_s = self._quality.dropouts_per_hour / 3600.0
        return time_s + generator.expovariate(per_s) if per_s else math.inf

    def changes(self, time_s: float) -> list[tuple[int, bool]]:
        """The vehicles that lose (False) or regain (True) their satellites now."""
        if time_s < self._soonest_s:
            return []
        found = []
        for i, due_s in enumerate(self._next_s):
            if time_s < due_s:
                continue
            lost = self._until_s[i] < due_s
            found.append((i, not lost))
            if lost:
                self._next_s[i] = self._until_s[i] = due_s + self._quality.dropout_s
            else:
                self._next_s[i] = self._after(self._generators[i], due_s)
        self._soonest_s = min(self._next_s)
        return found
