"""Lines that come near obstacles, in NumPy: what the compiled kernel is compared with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from navigation_core.mapping.obstacle_outlines import in_boxes
from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["are_clear", "hits"]

Indices = NDArray[np.intp]

# A line that rises less than this is level; one that is shorter than the other is a point.
_LEVEL_M, _POINT_M = 1e-9, 1e-9
_SIGNS_X = np.array([[1.0], [1.0], [-1.0], [-1.0]])
_SIGNS_Y = np.array([[1.0], [-1.0], [1.0], [-1.0]])


def are_clear(
    obstacles: Obstacles, starts: Array, ends: Array, clearance_m: float
) -> NDArray[np.bool_]:
    """Return which lines keep a clearance to all obstacles."""
    clear = np.ones(len(starts), dtype=np.bool_)
    clear[hits(obstacles, starts, ends, clearance_m)[0]] = False
    return clear


def hits(
    obstacles: Obstacles, starts: Array, ends: Array, clearance_m: float
) -> tuple[Indices, Indices]:
    """Return the rows of lines and of the obstacles that they come too near to, all pairs tried."""
    count = len(obstacles)
    line = np.repeat(np.arange(len(starts)), count)
    obstacle = np.tile(np.arange(count), len(starts))
    hit = _hits(obstacles, starts[line], ends[line], obstacle, clearance_m)
    return line[hit], obstacle[hit]


def _hits(
    obstacles: Obstacles, starts: Array, ends: Array, which: Indices, clearance_m: float
) -> NDArray[np.bool_]:
    """Whether lines come nearer than a clearance to an obstacle each, shape (K,)."""
    hit, enter, leave = _beside(obstacles, starts, ends, which, clearance_m)
    posts = obstacles.posts
    count = len(posts)
    for table, chosen, nearest_m in (
        (posts, hit & (which < count), _lines_to_posts_m),
        (obstacles.boxes, hit & (which >= count), _lines_to_boxes_m),
    ):
        if chosen.any():
            rows = table[which[chosen] - (0 if table is posts else count)]
            start, along = starts[chosen, :2], (ends - starts)[chosen, :2]
            gap_m = nearest_m(start, along, enter[chosen], leave[chosen], rows)
            hit[chosen] = ~(gap_m >= clearance_m)
    return hit


def _beside(
    obstacles: Obstacles, starts: Array, ends: Array, which: Indices, clearance_m: float
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Return the part of each line that is not above or below an obstacle each.

    Returns:
        Whether there is one, and where it begins and ends, as shares of the line.
    """
    posts, boxes = obstacles.posts, obstacles.boxes
    low = np.concatenate([posts[:, 3], boxes[:, 5]])[which] - clearance_m
    high = np.concatenate([posts[:, 4], boxes[:, 6]])[which] + clearance_m
    begin, rise = starts[:, 2], ends[:, 2] - starts[:, 2]
    level = np.abs(rise) < _LEVEL_M
    beside = np.asarray((begin > low) & (begin < high))
    if level.all():
        return beside, np.zeros(len(begin)), np.ones(len(begin))
    safe = np.where(level, 1.0, rise)
    first, last = (low - begin) / safe, (high - begin) / safe
    enter = np.where(level, 0.0, np.maximum(np.minimum(first, last), 0.0))
    leave = np.where(level, 1.0, np.minimum(np.maximum(first, last), 1.0))
    return np.where(level, beside, ~(enter >= leave)), enter, leave


def _lines_to_posts_m(
    starts: Array, along: Array, enter: Array, leave: Array, posts: Array
) -> Array:
    """Distances of parts of lines to one cylinder each, in the plane; shape (K,)."""
    offset = posts[:, :2] - starts
    share = np.minimum(np.maximum(_nearest_share(offset, along), enter), leave)
    gap = offset - share[:, None] * along
    return np.asarray(np.maximum(np.hypot(gap[:, 0], gap[:, 1]) - posts[:, 2], 0.0))


def _lines_to_boxes_m(
    starts: Array, along: Array, enter: Array, leave: Array, boxes: Array
) -> Array:
    """Distances of parts of lines to one box each, in the plane; shape (K,)."""
    offset = starts - boxes[:, :2]
    a_x, a_y = in_boxes(offset + enter[:, None] * along, boxes)
    b_x, b_y = in_boxes(offset + leave[:, None] * along, boxes)
    half_x, half_y = boxes[:, 2], boxes[:, 3]
    line_x, line_y = b_x - a_x, b_y - a_y
    # Apart, the nearest two points are an end of the line or a corner of the box.
    nearest = np.minimum(_outside(a_x, a_y, half_x, half_y), _outside(b_x, b_y, half_x, half_y))
    nearest[_crosses(a_x, line_x, half_x, a_y, line_y, half_y)] = 0.0
    corner_x = _SIGNS_X * half_x - a_x
    corner_y = _SIGNS_Y * half_y - a_y
    length2 = np.maximum(line_x * line_x + line_y * line_y, _POINT_M * _POINT_M)
    share = (corner_x * line_x + corner_y * line_y) / length2
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    gaps = np.hypot(corner_x - share * line_x, corner_y - share * line_y)
    return np.asarray(np.minimum(nearest, gaps.min(axis=0)))


def _nearest_share(offset: Array, along: Array) -> Array:
    """Which share of vectors comes nearest to points at offsets from their tails."""
    # Written out: a sum over an axis of two takes several times as long.
    east, north = along[..., 0], along[..., 1]
    length2 = np.maximum(east * east + north * north, _POINT_M * _POINT_M)
    return np.asarray((offset[..., 0] * east + offset[..., 1] * north) / length2)


def _outside(x: Array, y: Array, half_x: Array, half_y: Array) -> Array:
    over_x, over_y = np.maximum(np.abs(x) - half_x, 0.0), np.maximum(np.abs(y) - half_y, 0.0)
    return np.asarray(np.hypot(over_x, over_y))


def _crosses(
    x: Array, line_x: Array, half_x: Array, y: Array, line_y: Array, half_y: Array
) -> NDArray[np.bool_]:
    """Whether lines go through boxes about the origin, by the slab method."""
    enter_x, leave_x = _in_slab(x, line_x, half_x)
    enter_y, leave_y = _in_slab(y, line_y, half_y)
    enter, leave = np.maximum(enter_x, enter_y), np.minimum(leave_x, leave_y)
    return np.asarray((enter <= leave) & (leave >= 0.0) & (enter <= 1.0))


def _in_slab(start: Array, line: Array, half: Array) -> tuple[Array, Array]:
    """Shares of lines at which they enter and leave a slab about the origin."""
    safe = np.where(np.abs(line) < 1e-12, 1e-12, line)
    first, second = (-half - start) / safe, (half - start) / safe
    return np.minimum(first, second), np.maximum(first, second)
