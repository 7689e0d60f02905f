"""Obstacles in their order from west to east, to find those near lines without looking at all."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Indices", "Sweep"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

# An obstacle that reaches farther than this from its middle is compared with every line: a long
# wall would widen all searches.
_LONG_REACH_M = 6.0
# With a greater share of all pairs left, it is quicker to look at all of them at once.
_SHARE_MAX = 0.25


class Sweep:
    """The order of some obstacles; see the module."""

    def __init__(self, east_m: Array, reach_m: Array) -> None:
        """Sort.

        Args:
            east_m: of the middles, shape (M,).
            reach_m: how far the outlines are from there at most, shape (M,).
        """
        short = reach_m <= _LONG_REACH_M
        order = np.argsort(np.where(short, east_m, np.inf), kind="stable")
        count = int(short.sum())
        self._short, self._long = order[:count], order[count:]
        self._east_m = east_m[self._short]
        self._reach_m = float(reach_m[short].max(initial=0.0))
        self._is_finite = bool(np.isfinite(east_m).all())

    def pairs(self, east_m: Array, within_m: Array) -> tuple[Indices, Indices] | None:
        """Return the pairs of a line and an obstacle that may be within a distance, eastwards.

        Args:
            east_m: of the middles of the lines, shape (N,).
            within_m: distance from there, shape (N,).

        Returns:
            Rows of the lines and of the obstacles; None if these are not much fewer than all.
        """
        within_m = within_m + self._reach_m
        first = np.searchsorted(self._east_m, east_m - within_m)
        counts = np.searchsorted(self._east_m, east_m + within_m, side="right") - first
        total, lines, long = int(counts.sum()), len(east_m), len(self._long)
        every = lines * (len(self._short) + long)
        if not self._is_finite or total + lines * long > _SHARE_MAX * every:
            return None
        if not np.isfinite(east_m).all():
            return None
        line = np.repeat(np.arange(lines), counts)
        before = np.cumsum(counts) - counts
        obstacle = self._short[np.arange(total) + np.repeat(first - before, counts)]
        if not long:
            return line, obstacle
        beside = np.repeat(np.arange(lines), long), np.tile(self._long, lines)
        return np.concatenate([line, beside[0]]), np.concatenate([obstacle, beside[1]])
