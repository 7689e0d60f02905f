"""Volumes as rows of points, and whether they keep apart.

A volume is a set of points with room about each: whoever owns it may be there. The shape of
separation is an upright cylinder: two points keep apart if they are far enough beside each other,
or far enough above. All positions are in the traffic frame, which the vehicles of one server
share: metres east and north of one place, and altitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["NOWHERE", "Array", "Mask", "Separation", "Volume", "blocks_near", "densified", "joined"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]

# Largest distance between two points of a line that follow one another, level and upright.
GAP_M, RISE_GAP_M = 1.0, 0.5
# Number of consecutive points in a block, and of pairs of blocks that are compared at once.
BLOCK, _TOGETHER = 16, 256


@dataclass(frozen=True)
class Separation:
    """The distances that vehicles keep.

    Attributes:
        horizontal_m: least distance beside each other.
        vertical_m: or else, least difference of altitudes.
        parked_m: least distance from one that is disarmed, on the ground.
    """

    horizontal_m: float = 5.0
    vertical_m: float = 3.0
    parked_m: float = 2.0


@dataclass(frozen=True, eq=False)
class Volume:
    """Where a vehicle may be.

    Attributes:
        table: shape (5, N): the coordinates of its points in the traffic frame, the room about each
            of them, level, and the room above and below.
    """

    table: Array

    @classmethod
    def along(cls, points_m: Array, radius_m: Array | float, rise_m: Array | float) -> Volume:
        """Return the volume about points (N, 3) with room (N,) about each, or equal room."""
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 3)
        table = np.empty((5, len(points)))
        table[:3], table[3], table[4] = points.T, radius_m, rise_m
        return cls(table)

    @property
    def points_m(self) -> Array:
        """Its points, shape (N, 3)."""
        return self.table[:3].T

    @property
    def radius_m(self) -> Array:
        """The room about each point, level, shape (N,)."""
        return np.asarray(self.table[3])

    @property
    def rise_m(self) -> Array:
        """The room above and below each point, shape (N,)."""
        return np.asarray(self.table[4])

    def parked(self, separation: Separation) -> Volume:
        """Return the volume of one that is disarmed on the ground: less is kept from it."""
        radius_m = self.radius_m + (separation.parked_m - separation.horizontal_m)
        rise_m = self.rise_m + (separation.parked_m - separation.vertical_m)
        return Volume.along(self.points_m, radius_m, rise_m)

    def __len__(self) -> int:
        """How many points."""
        return int(self.table.shape[1])

    @cached_property
    def blocks(self) -> tuple[Array, Array]:
        """The corners of upright cuboids about each few of its points, both of shape (3, B)."""
        points, room = self.table[:3], self.table[[3, 3, 4]]
        starts = np.arange(0, len(self), BLOCK)
        low = np.minimum.reduceat(points - room, starts, axis=1)
        return low, np.maximum.reduceat(points + room, starts, axis=1)

    @cached_property
    def _by_block(self) -> Array:
        """The table by blocks, shape (5, B, BLOCK); NaN where the last one has fewer points."""
        count = -(-len(self) // BLOCK)
        table = np.full((5, count * BLOCK), np.nan)
        table[:, : len(self)] = self.table
        return table.reshape(5, count, BLOCK)

    @cached_property
    def corners(self) -> tuple[list[float], list[float]]:
        """The least and the greatest corner of an upright cuboid about all of it."""
        if not len(self):
            return [np.inf] * 3, [-np.inf] * 3
        x0, y0, z0 = self.table[:3].min(axis=1).tolist()
        x1, y1, z1, radius_m, rise_m = self.table.max(axis=1).tolist()
        low = [x0 - radius_m, y0 - radius_m, z0 - rise_m]
        return low, [x1 + radius_m, y1 + radius_m, z1 + rise_m]

    def near(self, others: Sequence[Volume], separation: Separation) -> list[int]:
        """Return which volumes may come nearer to it than the separation, by their cuboids."""
        (x0, y0, z0), (x1, y1, z1) = self.corners
        level_m, upright_m = separation.horizontal_m, separation.vertical_m
        x0, y0, z0 = x0 - level_m, y0 - level_m, z0 - upright_m
        x1, y1, z1 = x1 + level_m, y1 + level_m, z1 + upright_m
        found = []
        for row, other in enumerate(others):
            low, high = other.corners
            if (
                low[0] < x1
                and x0 < high[0]
                and low[1] < y1
                and y0 < high[1]
                and low[2] < z1
                and z0 < high[2]
            ):
                found.append(row)
        return found

    def meets(self, other: Volume, separation: Separation) -> Mask:
        """Return which of its points come too near to another volume, shape (N,)."""
        flags = np.zeros(len(self), dtype=np.bool_)
        flags[self.pairs(other, separation)[0]] = True
        return flags

    def pairs(self, other: Volume, separation: Separation) -> tuple[Indices, Indices]:
        """Return the points of two volumes that are too near to each other, both of shape (K,)."""
        if not self.near([other], separation):
            return _NONE, _NONE
        mine, theirs = np.nonzero(blocks_near(self.blocks, other.blocks, separation))
        found = [
            self._pairs_of(mine[k : k + _TOGETHER], theirs[k : k + _TOGETHER], other, separation)
            for k in range(0, len(mine), _TOGETHER)
        ]
        if not found:
            return _NONE, _NONE
        return np.concatenate([one[0] for one in found]), np.concatenate([one[1] for one in found])

    def _pairs_of(
        self, mine: Indices, theirs: Indices, other: Volume, separation: Separation
    ) -> tuple[Indices, Indices]:
        """Return the pairs of the points of pairs of blocks."""
        a, b = self._by_block[:, mine, :, None], other._by_block[:, theirs, None]
        # In place: most of the time goes into new memory.
        east, north, up_m = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        east *= east
        north *= north
        beside_m2 = np.add(east, north, out=east)
        kept = np.add(a[3], b[3] + separation.horizontal_m, out=north)
        kept *= kept
        near = beside_m2 < kept
        near &= np.abs(up_m, out=up_m) < np.add(a[4], b[4] + separation.vertical_m, out=kept)
        pair, row, column = np.nonzero(near)
        return mine[pair] * BLOCK + row, theirs[pair] * BLOCK + column

    def nearness(
        self, other: Volume, mine: Indices, theirs: Indices, separation: Separation
    ) -> Array:
        """Return the distance of pairs of points that are too near, as a share of what is kept."""
        gaps = np.abs(self.points_m[mine] - other.points_m[theirs])
        beside_m = self.radius_m[mine] + other.radius_m[theirs] + separation.horizontal_m
        above_m = self.rise_m[mine] + other.rise_m[theirs] + separation.vertical_m
        level_m = np.hypot(gaps[:, 0], gaps[:, 1])
        return np.asarray(np.maximum(level_m / beside_m, gaps[:, 2] / above_m))

    @cached_property
    def _rest_corners(self) -> tuple[Array, Array]:
        """The corners of cuboids about what is left from each point on, both of shape (3, N)."""
        points, room = self.table[:3], self.table[[3, 3, 4]]
        low = np.minimum.accumulate((points - room)[:, ::-1], axis=1)[:, ::-1]
        return low, np.maximum.accumulate((points + room)[:, ::-1], axis=1)[:, ::-1]

    def part(self, first: int, end: int | None = None) -> Volume:
        """Return some of its points in a row."""
        return Volume(self.table[:, first:end])

    def rest(self, first: int) -> Volume:
        """Return all points from one on, which is quick to do again from the next."""
        rest = self.part(first)
        if first < len(self):
            low, high = self._rest_corners
            rest.__dict__["corners"] = low[:, first].tolist(), high[:, first].tolist()
        return rest


_NONE: Indices = np.empty(0, dtype=np.intp)
NOWHERE = Volume(np.empty((5, 0)))


def blocks_near(
    first: tuple[Array, Array], second: tuple[Array, Array], separation: Separation
) -> Mask:
    """Return which blocks may come nearer to which than the separation, shape (B, C)."""
    (low, high), (other_low, other_high) = first, second
    near = np.ones((low.shape[1], other_low.shape[1]), dtype=np.bool_)
    reach_m = (separation.horizontal_m, separation.horizontal_m, separation.vertical_m)
    for axis, room_m in enumerate(reach_m):
        near &= high[axis, :, None] > other_low[axis] - room_m
        near &= low[axis, :, None] < other_high[axis] + room_m
    return near


def joined(*volumes: Volume) -> Volume:
    """Return what is in any of some volumes."""
    if len(volumes) < 2:
        return volumes[0] if volumes else NOWHERE
    return Volume(np.concatenate([one.table for one in volumes], axis=1))


def densified(points_m: Array, times_s: Array, gaps: float = 1.0) -> tuple[Array, Array]:
    """Return a line of points, and their times, with others between that are far apart.

    Args:
        points_m: shape (N, 3).
        times_s: shape (N,).
        gaps: how far apart they may be, as multiples of GAP_M and RISE_GAP_M.
    """
    steps = np.diff(points_m, axis=0)
    level = np.hypot(steps[:, 0], steps[:, 1]) / GAP_M
    parts = np.ceil(np.maximum(level, np.abs(steps[:, 2]) / RISE_GAP_M) / gaps).astype(np.int64)
    ends = np.cumsum(np.maximum(parts, 1))
    if not len(ends):
        return points_m, times_s
    places = np.concatenate([[0], ends])
    wanted = np.arange(places[-1] + 1)
    columns = [np.interp(wanted, places, column) for column in (*points_m.T, times_s)]
    return np.stack(columns[:3], axis=1), columns[3]
