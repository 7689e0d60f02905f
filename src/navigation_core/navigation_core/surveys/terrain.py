"""Heights of the ground from a grid, and the path that keeps a height above it.

Between four heights of the grid the ground is bilinear, so along a straight line it is a parabola
in each cell. The greatest distance from a straight path is therefore found exactly, and a path is
split there until it is near enough.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "HEIGHT_MIN_M",
    "Terrain",
    "TerrainError",
    "TerrainGrid",
    "slopes",
    "tolerance_m",
    "too_many_points",
]

# Below it the tolerance would be most of the height.
HEIGHT_MIN_M = 2.0
_TOLERANCE_SHARE, _TOLERANCE_MIN_M = 0.1, 1.0
# Positions count as inside the grid by this share of its resolution.
_ROUNDING = 1e-6
# Splits of a path nearer than this to another, over its length, are none.
_SAME_SHARE = 1e-9

_Array = NDArray[np.float64]


class TerrainError(ValueError):
    """The terrain cannot be followed; the text says why."""


@dataclass(frozen=True)
class TerrainGrid:
    """A grid as it was sent.

    Attributes:
        origin_enu_m: position of the first height, east and north.
        resolution_m: distance of two heights, east and north.
        width: number of heights in a row.
        heights_m: row by row from the south, each from the west; NaN where unknown.
    """

    origin_enu_m: tuple[float, float]
    resolution_m: float
    width: int
    heights_m: _Array = field(repr=False, compare=False)


def tolerance_m(height_m: float) -> float:
    """Return how far the path may be from a height above the ground."""
    return max(_TOLERANCE_MIN_M, _TOLERANCE_SHARE * height_m)


def too_many_points(points_max: int) -> str:
    """Return why a path is not planned."""
    return (
        f"The terrain takes more than {points_max} waypoints; give a smoother grid, a greater "
        "height or a smaller area."
    )


class Terrain:
    """The ground of a grid."""

    def __init__(self, grid: TerrainGrid) -> None:
        """Take the grid.

        Raises:
            TerrainError: it is no grid.
        """
        count, width, resolution_m = len(grid.heights_m), grid.width, grid.resolution_m
        if not (math.isfinite(resolution_m) and resolution_m > 0.0):
            raise TerrainError(
                f"The resolution of the terrain is {resolution_m:g} m; give more than 0 m."
            )
        if not all(map(math.isfinite, grid.origin_enu_m)):
            raise TerrainError("The origin of the terrain is not a number; give east and north.")
        if width < 2 or count < 2 * width or count % width:
            raise TerrainError(
                f"The terrain has {count} heights in rows of {width}; give at least two whole rows "
                "of at least two heights."
            )
        self._origin_m, self._resolution_m = np.array(grid.origin_enu_m), resolution_m
        self._heights_m = np.asarray(grid.heights_m, float).reshape(-1, width)
        self._last = np.array([width - 1, count // width - 1])

    def along(self, first_m: _Array, last_m: _Array, height_m: float, points_max: int) -> _Array:
        """Return a path that stays within the tolerance of a height above the ground.

        Args:
            first_m: its first point, east and north.
            last_m: its last point.
            height_m: above the ground.
            points_max: of the path.

        Returns:
            Points, shape (n, 3): east, north, up; n is at least 2.

        Raises:
            TerrainError: the grid does not cover it, or it takes too many points.
        """
        line = self._line(first_m, last_m)
        chosen = {0.0: line.height(0.0), 1.0: line.height(1.0)}
        waiting = [(0.0, 1.0)]
        while waiting:
            begin, end = waiting.pop()
            split, distance_m = line.farthest(begin, end, chosen[begin], chosen[end])
            near = min(split - begin, end - split) < _SAME_SHARE
            if distance_m <= tolerance_m(height_m) or near:
                continue
            chosen[split] = line.height(split)
            if len(chosen) > points_max:
                raise TerrainError(too_many_points(points_max))
            waiting += [(begin, split), (split, end)]
        shares = np.array(sorted(chosen))
        level_m = first_m + shares[:, None] * (last_m - first_m)
        return np.column_stack([level_m, [chosen[share] + height_m for share in sorted(chosen)]])

    def _line(self, first_m: _Array, last_m: _Array) -> _Line:
        """Return the ground below a straight line, cell by cell."""
        first, last = (
            (point_m - self._origin_m) / self._resolution_m for point_m in (first_m, last_m)
        )
        for point, point_m in ((first, first_m), (last, last_m)):
            if not bool(np.all((point >= -_ROUNDING) & (point <= self._last + _ROUNDING))):
                raise TerrainError(
                    f"The terrain does not cover the path at ({point_m[0]:.1f}, {point_m[1]:.1f}) "
                    "m; give a grid with room for the ways beside the area."
                )
        step = last - first
        shares = [np.array([0.0, 1.0])]
        for axis in (0, 1):
            low, high = sorted((first[axis], last[axis]))
            borders = np.arange(math.ceil(low), math.floor(high) + 1)
            if abs(step[axis]) > _ROUNDING:
                shares.append(np.clip((borders - first[axis]) / step[axis], 0.0, 1.0))
        at = np.unique(np.concatenate(shares))
        cells = first + (at[:-1] + at[1:])[:, None] / 2.0 * step
        corners = np.clip(np.floor(cells).astype(int), 0, self._last - 1)
        begin, middle, end = (
            self._bilinear(corners, first + share[:, None] * step)
            for share in (at[:-1], (at[:-1] + at[1:]) / 2.0, at[1:])
        )
        unknown = np.flatnonzero(~np.isfinite(begin + middle + end))
        if len(unknown):
            where_m = self._origin_m + self._resolution_m * cells[unknown[0]]
            raise TerrainError(
                f"The height of the terrain is unknown at ({where_m[0]:.1f}, {where_m[1]:.1f}) m, "
                "which the survey passes."
            )
        return _Line(at, begin, middle, end)

    def _bilinear(self, corners: NDArray[np.int_], places: _Array) -> _Array:
        """Return the heights in cells, which are given by their first corner."""
        column, row = corners.T
        right, up = (places - corners).T
        heights_m = self._heights_m
        low_m = (1.0 - right) * heights_m[row, column] + right * heights_m[row, column + 1]
        high_m = (1.0 - right) * heights_m[row + 1, column] + right * heights_m[row + 1, column + 1]
        return np.asarray((1.0 - up) * low_m + up * high_m)


class _Line:
    """The ground along a line: a parabola in each of its parts."""

    def __init__(self, at: _Array, begin_m: _Array, middle_m: _Array, end_m: _Array) -> None:
        """Take the shares of the line where cells meet, and three heights of each part."""
        self._at, self._wide = at, np.diff(at)
        self._square = 2.0 * (begin_m + end_m - 2.0 * middle_m)
        self._slope = end_m - begin_m - self._square
        self._begin_m, self._ends_m = begin_m, np.append(begin_m, end_m[-1])

    def height(self, share: float) -> float:
        """Return the height of the ground at a share of the line."""
        part = min(int(np.searchsorted(self._at, share, "right")) - 1, len(self._wide) - 1)
        inside = (share - self._at[part]) / self._wide[part]
        return float(
            self._begin_m[part] + inside * (self._slope[part] + inside * self._square[part])
        )

    def farthest(
        self, begin: float, end: float, begin_m: float, end_m: float
    ) -> tuple[float, float]:
        """Return where the ground is farthest from a chord between two shares, and how far."""
        rise = (end_m - begin_m) / (end - begin)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = (rise * self._wide - self._slope) / (2.0 * self._square)
        tops = np.flatnonzero((inside > 0.0) & (inside < 1.0))
        inside = inside[tops]
        tops_m = self._begin_m[tops] + inside * (self._slope[tops] + inside * self._square[tops])
        shares = np.append(self._at, self._at[tops] + inside * self._wide[tops])
        heights_m = np.append(self._ends_m, tops_m)
        between = (shares > begin) & (shares < end)
        if not between.any():
            return begin, 0.0
        shares, heights_m = shares[between], heights_m[between]
        distances_m = np.abs(heights_m - begin_m - rise * (shares - begin))
        index = int(distances_m.argmax())
        return float(shares[index]), float(distances_m[index])


def slopes(points_m: _Array) -> tuple[float, float]:
    """Return the steepest climb and descent of a path, as rise over level distance."""
    steps = [b - a for a, b in itertools.pairwise(points_m)]
    rises = [float(step[2]) / max(math.hypot(step[0], step[1]), _SAME_SHARE) for step in steps]
    return max(0.0, *rises), max(0.0, *(-rise for rise in rises))
