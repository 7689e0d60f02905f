"""A window of upright columns that moves with the vehicle, and the evidence in each.

The window is a square grid in the map frame. A column keeps its place in the world and its number
while the window rolls: the number wraps round, so that rolling only forgets the columns that have
left. Only columns with evidence take memory. With arrays for all of a large window, the first hit
in a part of it waited until the kernel had cleared a large page of memory, 5 ms for each.
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


# A column is one row. It begins with the numbers of its post: east, north, radius, bottom, top; its
# lowest and its highest hit follow. Once is not enough to say where it ends: the first ray beside
# it is kept as a possible bottom or top. Last come its evidence, and whether it is full.
_EAST, _NORTH, _RADIUS, _BOTTOM, _TOP = range(5)
_LOW, _HIGH, _MAYBE_BOTTOM, _MAYBE_TOP, _EVIDENCE, _FULL, _ROW = range(5, 12)
_POST, _ENDS = slice(_EAST, _TOP + 1), slice(_BOTTOM, _TOP + 1)
# That of a column without a hit; each hit ends it.
_NEW = np.zeros(_ROW)
_NEW[[_BOTTOM, _LOW, _MAYBE_TOP]], _NEW[[_TOP, _HIGH, _MAYBE_BOTTOM]] = np.inf, -np.inf


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
        self._first = -(self._count // 2), -(self._count // 2)
        # The columns with any evidence, ascending, and the row of each.
        self._known = np.empty(0, dtype=np.intp)
        self._rows = np.empty((0, _ROW))

    def clear(self) -> None:
        """Forget everything."""
        self._keep(np.zeros(len(self._known), dtype=np.bool_))

    def recentre(self, east_m: float, north_m: float) -> None:
        """Roll the window to be about a point, and forget the columns that leave it."""
        half = self._count // 2
        first = math.floor(east_m / self.cell_m) - half, math.floor(north_m / self.cell_m) - half
        if first == self._first:
            return
        self._first = first
        (west, east), (south, north) = (
            (at * self.cell_m, (at + self._count) * self.cell_m) for at in first
        )
        easts, norths = self.middles_m()
        inside = (easts > west) & (easts < east) & (norths > south) & (norths < north)
        if not inside.all():
            self._keep(inside)

    def find(self, east_m: Array, north_m: Array) -> tuple[Indices, Mask]:
        """Return the columns of points (N,), and which of the points have one."""
        east, north = self._cells(east_m), self._cells(north_m)
        inside = (east >= self._first[0]) & (east < self._first[0] + self._count)
        inside &= (north >= self._first[1]) & (north < self._first[1] + self._count)
        return (east % self._count) * self._count + north % self._count, inside

    def middles_m(self) -> tuple[Array, Array]:
        """Return east and north of the middles of the columns with evidence, each (N,)."""
        return self._rows[:, _EAST], self._rows[:, _NORTH]

    def ends_m(self, columns: Indices) -> tuple[Array, Array]:
        """Return bottoms and tops of columns, each (N,); infinite of those without evidence."""
        rows, is_known = self._find_rows(columns)
        ends = np.tile([-np.inf, np.inf], (len(columns), 1))
        ends[is_known] = self._rows[rows[is_known], _ENDS]
        return ends[:, 0], ends[:, 1]

    def posts(self) -> Array:
        """Return the full columns as posts: east, north, radius, bottom, top."""
        return self._rows[self._rows[:, _FULL] > 0.0, _POST]

    def hit(self, columns: Indices, heights_m: Array, shares: Array, extent_m: float) -> Indices:
        """Process hits.

        Args:
            columns: shape (N,), each as often as it was hit.
            heights_m: map z of the hits, shape (N,).
            shares: how much of a hit each is, shape (N,).
            extent_m: how far what was hit is taken to reach beyond each hit, upwards and
                downwards, until something else is known; infinity if nothing is.

        Returns:
            Their rows, each once, for :meth:`pass_by`.
        """
        if not len(columns):
            return columns
        order = columns.argsort()
        columns, heights_m = columns[order], heights_m[order]
        is_first = np.ones(len(columns), dtype=np.bool_)
        np.not_equal(columns[1:], columns[:-1], out=is_first[1:])
        first = is_first.nonzero()[0]
        hit = self._know(columns[first])
        low, high = np.minimum.reduceat(heights_m, first), np.maximum.reduceat(heights_m, first)
        share = np.maximum.reduceat(shares[order], first)
        rows = self._rows[hit]
        below, above = low < rows[:, _BOTTOM], high > rows[:, _TOP]
        rows[:, _BOTTOM] = np.where(below, self._down(low - extent_m), rows[:, _BOTTOM])
        rows[:, _TOP] = np.where(above, self._up(high + extent_m), rows[:, _TOP])
        rows[below | (low < rows[:, _MAYBE_BOTTOM]), _MAYBE_BOTTOM] = -np.inf
        rows[above | (high > rows[:, _MAYBE_TOP]), _MAYBE_TOP] = np.inf
        rows[:, _LOW] = np.minimum(low, rows[:, _LOW])
        rows[:, _HIGH] = np.maximum(high, rows[:, _HIGH])
        rows[:, _EVIDENCE] = np.minimum(rows[:, _EVIDENCE] + share, _EVIDENCE_MAX)
        rows[rows[:, _EVIDENCE] >= _FULL_AT, _FULL] = 1.0
        self._set(hit, rows)
        return hit

    def pass_by(self, columns: Indices, heights_m: Array, seen: Mask, hit: Indices) -> None:
        """Process rays that have gone through columns.

        One that goes over says that the top is no higher than it: what was hit may reach up to
        there. One that goes under says that it stands on nothing. Few things hang in the air,
        and the rays of a vehicle that pitches go under everything that has moved away since it
        was hit; so it is taken to begin just below its lowest hit.

        Args:
            columns: rows of columns, as in :meth:`middles_m`, shape (N,), each at most once.
            heights_m: map z of the rays there, shape (N, K).
            seen: which of these rays there are, shape (N, K).
            hit: rows that the same scan has hit, which holds against rays beside the hit.
        """
        if not len(columns):
            return
        rows = self._rows[columns]
        low, high = rows[:, _LOW], rows[:, _HIGH]
        over = seen & (heights_m > high[:, None] + _SAME_HEIGHT_M)
        under = seen & (heights_m < low[:, None] - _SAME_HEIGHT_M)
        over_m = self._up(np.where(over, heights_m, np.inf).min(axis=1))
        under_m = self._down(np.where(under, heights_m, -np.inf).max(axis=1))
        rows[:, _TOP] = np.minimum(rows[:, _TOP], np.maximum(over_m, rows[:, _MAYBE_TOP]))
        hangs = np.isfinite(np.minimum(under_m, rows[:, _MAYBE_BOTTOM]))
        hanging_m = self._down(low - _SAME_HEIGHT_M)
        rows[hangs, _BOTTOM] = np.maximum(rows[hangs, _BOTTOM], hanging_m[hangs])
        rows[:, _MAYBE_TOP] = np.minimum(rows[:, _MAYBE_TOP], over_m)
        rows[:, _MAYBE_BOTTOM] = np.maximum(rows[:, _MAYBE_BOTTOM], under_m)
        is_hit = np.zeros(len(self._rows), dtype=np.bool_)
        is_hit[hit] = True
        through = (seen & ~over & ~under).any(axis=1) & ~is_hit[columns]
        rows[through, _EVIDENCE] = np.maximum(rows[through, _EVIDENCE] - _MISS, 0.0)
        rows[through & (rows[:, _EVIDENCE] <= _FREE_AT), _FULL] = 0.0
        self._set(columns, rows)
        if not rows[:, _EVIDENCE].all():
            self._keep(self._rows[:, _EVIDENCE] > 0.0)

    def _find_rows(self, columns: Indices) -> tuple[Indices, Mask]:
        """Return the rows of columns, or where they would be, and which of them have one."""
        rows = self._known.searchsorted(columns)
        is_known = rows < len(self._known)
        is_known[is_known] = self._known[rows[is_known]] == columns[is_known]
        return rows, is_known

    def _know(self, columns: Indices) -> Indices:
        """Return the rows of columns, ascending, each once; new ones are to be hit at once."""
        rows, is_known = self._find_rows(columns)
        if is_known.all():
            return rows
        new, before = columns[~is_known], rows[~is_known]
        west, south = self._first
        east = (new // self._count - west) % self._count + west
        north = (new % self._count - south) % self._count + south
        table = np.tile(_NEW, (len(new), 1))
        table[:, _EAST], table[:, _NORTH] = (east + 0.5) * self.cell_m, (north + 0.5) * self.cell_m
        table[:, _RADIUS] = self.cell_m * math.sqrt(0.5)
        self._known = np.insert(self._known, before, new)
        self._rows = np.insert(self._rows, before, table, axis=0)
        return rows + np.cumsum(~is_known) - ~is_known

    def _keep(self, which: Mask) -> None:
        """Forget all rows but some."""
        self.version += bool(self._rows[~which, _FULL].any())
        self._known, self._rows = self._known[which], self._rows[which]

    def _set(self, columns: Indices, rows: Array) -> None:
        """Take over rows, and notice whether posts have changed."""
        before, full = self._rows[columns], rows[:, _FULL] > 0.0
        changed = before[:, _FULL] != rows[:, _FULL]
        changed |= full & (before[:, _ENDS] != rows[:, _ENDS]).any(axis=1)
        self.version += bool(changed.any())
        self._rows[columns] = rows

    # Ends go in steps of a cell, so that noise in a height is not news every time.
    def _up(self, heights_m: Array) -> Array:
        return np.asarray(np.ceil(heights_m / self.cell_m) * self.cell_m)

    def _down(self, heights_m: Array) -> Array:
        return np.asarray(np.floor(heights_m / self.cell_m) * self.cell_m)

    def _cells(self, at_m: Array) -> NDArray[np.intp]:
        return np.asarray(np.floor(at_m / self.cell_m), dtype=np.intp)
