"""Obstacles as a grid, for those who want a map that is flat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.mapping.obstacles import Obstacles

__all__ = ["OCCUPIED", "UNKNOWN", "GridWindow", "occupancy"]

Cells: TypeAlias = NDArray[np.int8]

OCCUPIED, UNKNOWN = 100, -1
# Posts of sensed obstacles reach a few cells; there are thousands of them.
_SMALL_CELLS = 6


@dataclass(frozen=True)
class GridWindow:
    """A square of cells, aligned with multiples of their side.

    Attributes:
        west_cell: index of the westernmost cell; its western edge is this times the side.
        south_cell: the same of the southernmost.
        count: cells along a side.
        cell_m: side of a cell.
    """

    west_cell: int
    south_cell: int
    count: int
    cell_m: float

    @classmethod
    def about(cls, east_m: float, north_m: float, size_m: float, cell_m: float) -> GridWindow:
        """Return the window about a place in the map."""
        count = max(round(size_m / cell_m), 1)
        west, south = (int(np.floor(at_m / cell_m)) - count // 2 for at_m in (east_m, north_m))
        return cls(west, south, count, cell_m)


def occupancy(obstacles: Obstacles, window: GridWindow) -> Cells:
    """Return which cells of a window hold an obstacle.

    Args:
        obstacles: those at the height that counts.
        window: of the grid.

    Returns:
        Shape (count, count), rows from south to north: `OCCUPIED` where the middle of the cell
        is in an obstacle or an obstacle's middle is in the cell, else `UNKNOWN`: an obstacle map
        keeps what was hit, and not what was seen to be free.
    """
    cells = np.full((window.count, window.count), UNKNOWN, dtype=np.int8)
    reaches = (obstacles.posts[:, 2] / window.cell_m).astype(np.intp) + 1
    for reach in np.unique(reaches[reaches <= _SMALL_CELLS]):
        _fill_small(cells, window, obstacles.posts[reaches == reach], int(reach))
    for row in obstacles.posts[reaches > _SMALL_CELLS]:
        touched, away = _around(row[:2], row[2], window)
        _fill(cells, window, touched[np.hypot(away[:, 0], away[:, 1]) < row[2]])
    for row in obstacles.boxes:
        # A wall thinner than a cell still fills the cells that it stands in.
        half, yaw = np.maximum(row[2:4], 0.5 * window.cell_m), row[4]
        touched, away = _around(row[:2], float(np.hypot(*half)), window)
        along = away[:, 0] * np.cos(yaw) + away[:, 1] * np.sin(yaw)
        across = away[:, 1] * np.cos(yaw) - away[:, 0] * np.sin(yaw)
        _fill(cells, window, touched[(np.abs(along) <= half[0]) & (np.abs(across) <= half[1])])
    return cells


def _fill_small(cells: Cells, window: GridWindow, posts: NDArray[np.float64], reach: int) -> None:
    """Mark many small posts, all at once for each offset."""
    centres = posts[:, :2]
    first = np.floor(centres / window.cell_m).astype(np.intp)
    _fill(cells, window, first)
    for east in range(-reach, reach + 1):
        for north in range(-reach, reach + 1):
            touched = first + np.array([east, north])
            away = (touched + 0.5) * window.cell_m - centres
            _fill(cells, window, touched[np.hypot(away[:, 0], away[:, 1]) < posts[:, 2]])


def _around(
    centre: NDArray[np.float64], reach_m: float, window: GridWindow
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the cells of a window near a place, (N, 2), and how far off their middles are."""
    corner = np.array([window.west_cell, window.south_cell])
    low = np.maximum(np.floor((centre - reach_m) / window.cell_m), corner)
    high = np.minimum(np.floor((centre + reach_m) / window.cell_m), corner + window.count - 1)
    east, north = (np.arange(low[i], high[i] + 1.0) for i in (0, 1))
    grid = np.stack(np.meshgrid(east, north, indexing="ij"), axis=-1).reshape(-1, 2)
    return grid.astype(np.intp), np.asarray((grid + 0.5) * window.cell_m - centre)


def _fill(cells: Cells, window: GridWindow, touched: NDArray[np.intp]) -> None:
    """Mark cells (N, 2: east, north) as occupied; those outside the window are left out."""
    east, north = touched[:, 0] - window.west_cell, touched[:, 1] - window.south_cell
    inside = (east >= 0) & (east < window.count) & (north >= 0) & (north < window.count)
    cells[north[inside], east[inside]] = OCCUPIED
