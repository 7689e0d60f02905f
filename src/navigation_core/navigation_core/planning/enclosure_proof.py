"""A quick proof that no path exists, to avoid a long search for one.

The plane about each end is cut into cells. A cell in which no point can have the clearance is
shut; all others count as open, with their eight neighbours. When the open cells that hang
together with an end stay within the looked-at square and do not hold the other end, that end is
walled in. The proof is sound and not complete: that it fails says nothing.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.planar_shapes import PlanarShapes, places_of

__all__ = ["is_end_walled_in", "is_walled_in"]

_CELL_M = 0.4
_HALF_M = 20.0
_EIGHT_NEIGHBOURS = np.ones((3, 3))


def is_walled_in(
    start_enu_m: Array,
    goal_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float],
) -> bool:
    """Whether it is certain that obstacles leave no path, also over or under them.

    Args:
        start_enu_m: with the clearance, shape (3,).
        goal_enu_m: with the clearance, shape (3,).
        obstacles: the known obstacles.
        clearance_m: that a path must keep.
        heights_m: lowest and highest map z of all paths that may be looked for, both ends
            included.
    """
    return any(
        is_end_walled_in(end, other, obstacles, clearance_m, heights_m)
        for end, other in ((goal_enu_m, start_enu_m), (start_enu_m, goal_enu_m))
    )


def is_end_walled_in(
    end: Array,
    other: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float],
) -> bool:
    """Whether one end is walled in; see :func:`is_walled_in`."""
    walls = _spanning(obstacles, *heights_m)
    # Where a cell's middle has less than this, none of its points has the clearance.
    limit_m = clearance_m - _CELL_M * math.sqrt(0.5)
    corner = (end[0] - _HALF_M, end[1] - _HALF_M, end[2])
    opposite = (end[0] + _HALF_M, end[1] + _HALF_M, end[2])
    near = walls.near(corner, opposite, clearance_m)
    if len(near) < 2 or limit_m <= 0.0:
        return False
    count = round(_HALF_M / _CELL_M)
    side = 2 * count + 1
    open_ = ~_shut(end[:2] - _CELL_M * count, side, near, limit_m)
    patches, _ = scipy.ndimage.label(open_, _EIGHT_NEIGHBOURS)
    patch = patches[count, count]
    if patch == 0:
        return False
    rim = np.concatenate([patches[0], patches[-1], patches[:, 0], patches[:, -1]])
    if (rim == patch).any():
        return False
    row, column = (round(float(other[k] - end[k]) / _CELL_M) + count for k in (0, 1))
    inside = 0 <= row < side and 0 <= column < side
    return not (inside and patches[row, column] == patch)


def _spanning(obstacles: Obstacles, low_m: float, high_m: float) -> Obstacles:
    """Return those that reach from one height to the other, or farther."""
    posts, boxes = obstacles.posts, obstacles.boxes
    return Obstacles(
        posts[(posts[:, 3] <= low_m) & (posts[:, 4] >= high_m)],
        boxes[(boxes[:, 5] <= low_m) & (boxes[:, 6] >= high_m)],
    )


def _shut(corner_m: Array, side: int, walls: Obstacles, limit_m: float) -> NDArray[np.bool_]:
    """Whether the middles of cells are surely nearer to one of some walls than a limit.

    Only the cells around each wall are looked at.

    Args:
        corner_m: the middle of the first cell.
        side: number of cells east and north.
        walls: obstacles that span all heights that count.
        limit_m: the distance.

    Returns:
        Shape (side, side).
    """
    shapes, last = PlanarShapes(walls), side - 1
    reach_m = shapes.extent_m + limit_m
    first = np.ceil((shapes.middle_m - reach_m - corner_m) / _CELL_M).clip(0, side).astype(np.intp)
    end = np.floor((shapes.middle_m + reach_m - corner_m) / _CELL_M).clip(-1, last).astype(np.intp)
    rows, columns = np.maximum(end - first + 1, 0).T
    owner, place = np.repeat(np.arange(len(shapes)), rows * columns), places_of(rows * columns)
    width = columns[owner]
    row = place // width
    cells = np.stack([first[owner, 0] + row, first[owner, 1] + place - row * width], axis=1)
    gap_m = shapes.gap_m(corner_m + _CELL_M * cells, owner)
    row, column = cells[gap_m < limit_m].T
    shut = np.zeros((side, side), dtype=np.bool_)
    shut[row, column] = True
    return shut
