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
    share = np.clip(_nearest_share(offset, along), enter, leave)
    gap = offset - share[:, None] * along
    return np.asarray(np.maximum(np.hypot(gap[:, 0], gap[:, 1]) - posts[:, 2], 0.0))


def lines_to_boxes_m(
    starts: Array, along: Array, enter: Array, leave: Array, boxes: Array
) -> Array:
    """Distances of parts of lines to one box each, in the plane; shape (K,)."""
    offset = starts - boxes[:, :2]
    a = np.stack(in_boxes(offset + enter[:, None] * along, boxes), axis=-1)
    b = np.stack(in_boxes(offset + leave[:, None] * along, boxes), axis=-1)
    half, line = boxes[:, 2:4], b - a
    # Apart, the nearest two points are an end of the line or a corner of the box.
    nearest = np.where(_crosses(a, line, half), 0.0, np.minimum(outside(a, half), outside(b, half)))
    for signs in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        to = half * np.array(signs) - a
        gap = to - np.clip(_nearest_share(to, line), 0.0, 1.0)[:, None] * line
        nearest = np.minimum(nearest, np.hypot(gap[:, 0], gap[:, 1]))
    return np.asarray(nearest)


def _nearest_share(offset: Array, along: Array) -> Array:
    """Which share of vectors comes nearest to points at offsets from their tails."""
    # Written out: a sum over an axis of two takes several times as long.
    east, north = along[..., 0], along[..., 1]
    length2 = np.maximum(east * east + north * north, _POINT_M * _POINT_M)
    return np.asarray((offset[..., 0] * east + offset[..., 1] * north) / length2)


def outside(points: Array, half: Array) -> Array:
    """Distances of points to boxes around the origin, 0 inside; (..., 2) gives (...)."""
    over = np.maximum(np.abs(points) - half, 0.0)
    return np.asarray(np.hypot(over[..., 0], over[..., 1]))


def _crosses(start: Array, line: Array, half: Array) -> NDArray[np.bool_]:
    """Whether lines go through boxes about the origin, by the slab method."""
    safe = np.where(np.abs(line) < 1e-12, 1e-12, line)
    first, second = (-half - start) / safe, (half - start) / safe
    enter = np.minimum(first, second).max(axis=-1)
    leave = np.maximum(first, second).min(axis=-1)
    return np.asarray((enter <= leave) & (leave >= 0.0) & (enter <= 1.0))
