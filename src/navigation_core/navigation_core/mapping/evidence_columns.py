"""A window of upright columns that moves with the vehicle, and the evidence in each.

The window is a square grid in the map frame. A column keeps its place in the world and in the
arrays while the window rolls: its index wraps round, so that rolling moves nothing and only
forgets the rows that have left.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Columns", "Indices", "Mask"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]

# Evidence, in hits. Two hits make an obstacle: a single one is often dust, sun or a stray echo,
# and scanners send 5 to 40 scans a second, so the second is there within a metre of flight.
_FULL_AT = 2.0
# A ray through a column takes back half a hit, so that a column at the edge of something, which
# every other scan misses, stays. Five rays and no hit free the place of what has moved, half a
# second at 10 scans a second; one stray ray never frees anything.
_MISS = 0.5
_FREE_AT = 0.5
_EVIDENCE_MAX = 3.0
# A hit at one height counts as an obstacle this far above and below, too. The scanner of a vehicle
# that pitches and bobs looks at another height each time, and an obstacle that has moved away must
# be told apart from one that is lower than the ray.
_SAME_HEIGHT_M = 0.5


class Columns:
    """Evidence and heights of every column of the window; see the module.

    Attributes:
        cell_m: side of a column.
        version: changes when the full columns, or their tops and bottoms, have changed.
    """

    def __init__(self, size_m: float, cell_m: float) -> None:
        """Start with an empty window about the origin.

        Args:
            size_m: side of the window.
            cell_m: side of a column.
        """
        self.cell_m = cell_m
        self.version = 0
        self._count = max(round(size_m / cell_m), 1)
        self._first = np.full(2, -(self._count // 2))
        cells = self._count * self._count
        # The columns with any evidence, ascending: a large window is mostly empty.
        self._known = np.empty(0, dtype=np.intp)
        self._evidence = np.zeros(cells)
        self._full = np.zeros(cells, dtype=np.bool_)
        self._centres_m = np.zeros((cells, 2))
        # Lowest and highest hit, and where it ends. Once is not enough to say where it ends: the
        # first ray above it is kept as what may be its top.
        self._low, self._high = np.zeros(cells), np.zeros(cells)
        self._bottom, self._top = np.zeros(cells), np.zeros(cells)
        self._maybe_bottom, self._maybe_top = np.zeros(cells), np.zeros(cells)

    def clear(self) -> None:
        """Forget everything."""
        self._forget(self._known)

    def recentre(self, east_m: float, north_m: float) -> None:
        """Roll the window to be about a point, and forget the columns that leave it."""
        cells = math.floor(east_m / self.cell_m), math.floor(north_m / self.cell_m)
        half = self._count // 2
        first = np.array([cells[0] - half, cells[1] - half])
        if first[0] == self._first[0] and first[1] == self._first[1]:
            return
        self._first = first
        away = self._cells(self._centres_m[self._known]) - first
        self._forget(self._known[((away < 0) | (away >= self._count)).any(axis=1)])

    def find(self, points_m: Array) -> tuple[Indices, Mask]:
        """Return the columns of points (N, 2 or 3), and which of the points have one."""
        cells = self._cells(points_m[:, :2])
        away = cells - self._first
        inside = np.asarray(((away >= 0) & (away < self._count)).all(axis=1))
        wrapped = cells % self._count
        return np.asarray(wrapped[:, 0] * self._count + wrapped[:, 1]), inside

    def known(self) -> Indices:
        """Return the columns with any evidence, ascending."""
        return self._known

    def centres_m(self, columns: Indices) -> Array:
        """Return east and north of the middles of known columns, shape (N, 2)."""
        return np.asarray(self._centres_m[columns])

    def ends_m(self, columns: Indices) -> tuple[Array, Array]:
        """Return bottoms and tops of columns, which must be known; each of shape (N,)."""
        return self._bottom[columns], self._top[columns]

    def posts(self) -> Array:
        """Return the full columns as posts: east, north, radius, bottom, top."""
        full = self._known[self._full[self._known]]
        table = np.empty((len(full), 5))
        table[:, :2] = self.centres_m(full)
        table[:, 2] = self.cell_m * np.sqrt(0.5)
        table[:, 3], table[:, 4] = self._bottom[full], self._top[full]
        return table

    def hit(self, columns: Indices, heights_m: Array, shares: Array, extent_m: float) -> Indices:
        """Process hits.

        Args:
            columns: shape (N,), each as often as it was hit.
            heights_m: map z of the hits, shape (N,).
            shares: how much of a hit each is, shape (N,).
            extent_m: how far what was hit is taken to reach beyond each hit, upwards and
                downwards, until something else is known; infinity if nothing is.

        Returns:
            The columns, each once.
        """
        hit, group = np.unique(columns, return_inverse=True)
        low, high = np.full(len(hit), np.inf), np.full(len(hit), -np.inf)
        np.minimum.at(low, group, heights_m)
        np.maximum.at(high, group, heights_m)
        share = np.zeros(len(hit))
        np.maximum.at(share, group, shares)
        new = self._evidence[hit] == 0.0
        below, above = new | (low < self._bottom[hit]), new | (high > self._top[hit])
        bottom = np.where(below, self._down(low - extent_m), self._bottom[hit])
        top = np.where(above, self._up(high + extent_m), self._top[hit])
        below |= low < self._maybe_bottom[hit]
        above |= high > self._maybe_top[hit]
        self._maybe_bottom[hit] = np.where(below, -np.inf, self._maybe_bottom[hit])
        self._maybe_top[hit] = np.where(above, np.inf, self._maybe_top[hit])
        self._low[hit] = np.where(new, low, np.minimum(low, self._low[hit]))
        self._high[hit] = np.where(new, high, np.maximum(high, self._high[hit]))
        self._know(hit[new])
        self._evidence[hit] = np.minimum(self._evidence[hit] + share, _EVIDENCE_MAX)
        self._set_ends(hit, bottom, top)
        self._set_full(hit, self._full[hit] | (self._evidence[hit] >= _FULL_AT))
        return hit

    def pass_by(self, columns: Indices, heights_m: Array, seen: Mask, hit: Indices) -> None:
        """Process rays that have gone through columns.

        One that goes over says that the top is no higher than it: what was hit may reach up to
        there. One that goes under says that it stands on nothing. Few things hang in the air,
        and the rays of a vehicle that pitches go under everything that has moved away since it
        was hit; so it is taken to begin just below its lowest hit.

        Args:
            columns: shape (N,), each at most once, all known.
            heights_m: map z of the rays there, shape (N, K).
            seen: which of these rays there are, shape (N, K).
            hit: columns that the same scan has hit, which holds against rays beside the hit.
        """
        low, high = self._low[columns, None], self._high[columns, None]
        over = seen & (heights_m > high + _SAME_HEIGHT_M)
        under = seen & (heights_m < low - _SAME_HEIGHT_M)
        over_m = self._up(np.where(over, heights_m, np.inf).min(axis=1))
        under_m = self._down(np.where(under, heights_m, -np.inf).max(axis=1))
        top = np.minimum(self._top[columns], np.maximum(over_m, self._maybe_top[columns]))
        hangs = np.isfinite(np.minimum(under_m, self._maybe_bottom[columns]))
        hanging_m = self._down(low[:, 0] - _SAME_HEIGHT_M)
        bottom = np.maximum(self._bottom[columns], np.where(hangs, hanging_m, -np.inf))
        self._maybe_top[columns] = np.minimum(self._maybe_top[columns], over_m)
        self._maybe_bottom[columns] = np.maximum(self._maybe_bottom[columns], under_m)
        self._set_ends(columns, bottom, top)
        through = columns[(seen & ~over & ~under).any(axis=1)]
        through = np.setdiff1d(through, hit, assume_unique=True)
        self._evidence[through] = np.maximum(self._evidence[through] - _MISS, 0.0)
        self._set_full(through, self._full[through] & (self._evidence[through] > _FREE_AT))
        self._know_less()

    def _know(self, new: Indices) -> None:
        """Process columns that had no evidence, ascending."""
        self._known = np.insert(self._known, np.searchsorted(self._known, new), new)
        wrapped = np.stack([new // self._count, new % self._count], axis=1)
        cells = self._first + (wrapped - self._first) % self._count
        self._centres_m[new] = (cells + 0.5) * self.cell_m

    def _know_less(self) -> None:
        self._known = self._known[self._evidence[self._known] > 0.0]

    def _set_full(self, columns: Indices, full: Mask) -> None:
        self.version += bool((self._full[columns] != full).any())
        self._full[columns] = full

    def _set_ends(self, columns: Indices, bottom_m: Array, top_m: Array) -> None:
        changed = (self._bottom[columns] != bottom_m) | (self._top[columns] != top_m)
        self.version += bool((changed & self._full[columns]).any())
        self._bottom[columns], self._top[columns] = bottom_m, top_m

    def _forget(self, columns: Indices) -> None:
        self._set_full(columns, np.zeros(len(columns), dtype=np.bool_))
        self._evidence[columns] = 0.0
        self._know_less()

    # Ends go in steps of a cell, so that noise in a height is not news every time.
    def _up(self, heights_m: Array) -> Array:
        return np.asarray(np.ceil(heights_m / self.cell_m) * self.cell_m)

    def _down(self, heights_m: Array) -> Array:
        return np.asarray(np.floor(heights_m / self.cell_m) * self.cell_m)

    def _cells(self, points_m: Array) -> NDArray[np.intp]:
        return np.asarray(np.floor(points_m / self.cell_m), dtype=np.intp)
