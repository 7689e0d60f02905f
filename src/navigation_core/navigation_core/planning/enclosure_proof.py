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

from navigation_core.mapping.obstacle_outlines import in_boxes, outside
from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["is_walled_in"]

_CELL_M = 0.4
# Posts of about one size are looked up together, and taken to be as thin as the thinnest.
_SIZES_M = 0.25
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
    low, high = heights_m
    walls = _spanning(obstacles, low, high)
    return any(
        _is_enclosed(end, other, walls, clearance_m)
        for end, other in ((goal_enu_m, start_enu_m), (start_enu_m, goal_enu_m))
    )


def _is_enclosed(end: Array, other: Array, walls: Obstacles, clearance_m: float) -> bool:
    # Where a cell's middle has less than this, none of its points has the clearance.
    limit_m = clearance_m - _CELL_M * math.sqrt(0.5)
    corner = (end[0] - _HALF_M, end[1] - _HALF_M, end[2])
    opposite = (end[0] + _HALF_M, end[1] + _HALF_M, end[2])
    near = walls.near(corner, opposite, clearance_m)
    if len(near) < 2 or limit_m <= 0.0:
        return False
    count = round(_HALF_M / _CELL_M)
    steps = _CELL_M * np.arange(-count, count + 1)
    middles = np.stack(np.meshgrid(end[0] + steps, end[1] + steps, indexing="ij"), axis=-1)
    shut = _shut(middles.reshape(-1, 2), near, limit_m)
    open_ = ~shut.reshape(len(steps), -1)
    patches, _ = scipy.ndimage.label(open_, _EIGHT_NEIGHBOURS)
    patch = patches[count, count]
    if patch == 0:
        return False
    rim = np.concatenate([patches[0], patches[-1], patches[:, 0], patches[:, -1]])
    if (rim == patch).any():
        return False
    row, column = (round(float(other[k] - end[k]) / _CELL_M) + count for k in (0, 1))
    inside = 0 <= row < len(steps) and 0 <= column < len(steps)
    return not (inside and patches[row, column] == patch)


def _spanning(obstacles: Obstacles, low_m: float, high_m: float) -> Obstacles:
    """Return those that reach from one height to the other, or farther."""
    posts, boxes = obstacles.posts, obstacles.boxes
    return Obstacles(
        posts[(posts[:, 3] <= low_m) & (posts[:, 4] >= high_m)],
        boxes[(boxes[:, 5] <= low_m) & (boxes[:, 6] >= high_m)],
    )


def _shut(points: Array, walls: Obstacles, limit_m: float) -> NDArray[np.bool_]:
    """Whether points at a height that all walls span are surely nearer to one than a limit."""
    shut = np.zeros(len(points), dtype=np.bool_)
    for box in walls.boxes:
        offsets = points - box[:2]
        # A cell more than the reach, as the sum may be rounded.
        reach_m = math.hypot(box[2], box[3]) + limit_m + _CELL_M
        near = np.flatnonzero(np.abs(offsets).max(axis=1) < reach_m)
        turned = np.stack(in_boxes(offsets[near], box[None]), axis=-1)
        shut[near] |= outside(turned, box[2:4]) < limit_m
    sizes = np.floor(walls.posts[:, 2] / _SIZES_M)
    for size in np.unique(sizes):
        alike = walls.posts[sizes == size]
        reach_m = limit_m + float(alike[:, 2].min())
        away_m, _ = scipy.spatial.cKDTree(alike[:, :2]).query(points, distance_upper_bound=reach_m)
        shut |= away_m < reach_m
    return shut
