"""Distances of lines to the outlines of cylinders and boxes, in the plane.

Posts and boxes are rows of the tables of :class:`~navigation_core.mapping.obstacles.Obstacles`.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["in_boxes", "lines_to_boxes_m", "lines_to_posts_m", "outside"]

Array: TypeAlias = NDArray[np.float64]

# A line that is shorter than this is a point.
_POINT_M = 1e-9
_SIGNS_X = np.array([[1.0], [1.0], [-1.0], [-1.0]])
_SIGNS_Y = np.array([[1.0], [-1.0], [1.0], [-1.0]])


def in_boxes(vectors: Array, boxes: Array) -> tuple[Array, Array]:
    """Turn vectors of shape (..., 2), one for each box, into the boxes' own axes."""
    cosine, sine = np.cos(boxes[:, 4]), np.sin(boxes[:, 4])
    east, north = vectors[..., 0], vectors[..., 1]
    return east * cosine + north * sine, north * cosine - east * sine


def lines_to_posts_m(
    starts: Array, along: Array, enter: Array, leave: Array, posts: Array
) -> Array:
    """Distances of parts of lines to one cylinder each, in the plane; shape (K,)."""
    offset = posts[:, :2] - starts
    share = np.minimum(np.maximum(_nearest_share(offset, along), enter), leave)
    gap = offset - share[:, None] * along
    return np.asarray(np.maximum(np.hypot(gap[:, 0], gap[:, 1]) - posts[:, 2], 0.0))


def lines_to_boxes_m(
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


def outside(points: Array, half: Array) -> Array:
    """Distances of points to boxes around the origin, 0 inside; (..., 2) gives (...)."""
    return _outside(points[..., 0], points[..., 1], half[..., 0], half[..., 1])


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
