"""A roadmap of paths between obstacles, in the plane.

Points along the outlines of the obstacles are joined to triangles (Delaunay). A side of a
triangle between two obstacles is a gap; the skeleton of the free space (Voronoi) leads through
the middle of each gap that is wide enough, and a path of a given clearance exists if and only if
one exists along the skeleton. So nothing depends on a cell size: a gap of 3 m is as easy to find
in a world of 20 m as in one of 2 km.

Each gap gets up to three points: one in its middle, as far from the one obstacle as from the
other, and one near each of the two, so that a path may hug what it goes round. The points of
two gaps of the same triangle are joined.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.planar_shapes import Indices, PlanarShapes

__all__ = ["Net", "build_net"]

# Points beyond this number are saved by a wider spacing; Qhull takes about 2 us for each.
POINTS_MAX = 4000
# Points near an obstacle keep this share more than the clearance, so that a line between
# two of them about a corner is still clear.
_HUG = 1.06
_RING_POINTS = 24


@dataclass(frozen=True)
class Net:
    """Points and the lines between them.

    Attributes:
        height_m: map z of all points.
        points_enu_m: shape (K, 3).
        begins: of the lines, shape (E,).
        ends: of the lines, shape (E,).
    """

    height_m: float
    points_enu_m: Array
    begins: Indices
    ends: Indices


def build_net(level: Obstacles, height_m: float, around_m: Array, clearance_m: float) -> Net:
    """Return the net of paths at one height.

    Args:
        level: the obstacles at this height.
        height_m: map z of all points.
        around_m: points that must be well within the net, shape (N, 2).
        clearance_m: that the points of the net keep.
    """
    shapes = PlanarShapes(level)
    samples, owner = _samples(shapes, clearance_m)
    ring = _ring(np.concatenate([samples, around_m]), clearance_m)
    owner = np.concatenate([owner, np.full(len(ring), -1)])
    samples = np.concatenate([samples, ring])
    triangles = scipy.spatial.Delaunay(samples - around_m[0]).simplices.astype(np.intp)
    pairs, sides = _sides(triangles, owner)
    points, nodes = _gap_points(shapes, samples, owner, pairs, clearance_m)
    begins, ends = _joined(sides, np.append(nodes, [[-1, -1, -1]], axis=0))
    heights = np.full(len(points), height_m)
    return Net(height_m, np.column_stack([points, heights]), begins, ends)


def _samples(shapes: PlanarShapes, clearance_m: float) -> tuple[Array, Indices]:
    spacing_m = clearance_m
    while True:
        samples, owner = shapes.sampled(spacing_m)
        if len(samples) <= max(POINTS_MAX, 2 * len(shapes)):
            return samples, owner
        spacing_m *= 1.5


def _ring(points: Array, clearance_m: float) -> Array:
    """Return points about everything, far enough for a path between."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    radius = 1.15 * float(np.hypot(*(points - middle).T).max()) + 6.0 * clearance_m
    angle = math.tau * np.arange(_RING_POINTS) / _RING_POINTS
    return np.asarray(middle + radius * np.column_stack([np.cos(angle), np.sin(angle)]))


def _sides(triangles: Indices, owner: Indices) -> tuple[Indices, Indices]:
    """Return the sides between two shapes, shape (S, 2), and those of each triangle, or -1.

    Returns:
        Pairs of samples, shape (S, 2), and their rows for each triangle, shape (T, 3).
    """
    sides = np.stack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]], axis=1)
    sides.sort(axis=-1)
    keys = sides[..., 0] * len(owner) + sides[..., 1]
    keys[owner[sides[..., 0]] == owner[sides[..., 1]]] = -1
    unique, rows = np.unique(keys, return_inverse=True)
    rows = rows.reshape(keys.shape)
    if unique[0] == -1:
        unique, rows = unique[1:], rows - 1
    return np.stack([unique // len(owner), unique % len(owner)], axis=1), rows


def _gap_points(
    shapes: PlanarShapes, samples: Array, owner: Indices, pairs: Indices, clearance_m: float
) -> tuple[Array, Indices]:
    """Return the points of gaps, and for each gap their rows or -1, shape (S, 3)."""
    # A sample in the middle of a post stands for its outline.
    within = -np.minimum(_from(shapes, samples, owner, samples)[0], 0.0)
    span = samples[pairs[:, 1]] - samples[pairs[:, 0]]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)
    may_pass = np.flatnonzero(length - within[pairs].sum(axis=1) >= 2.0 * clearance_m)
    (one, other), span, length = pairs[may_pass].T, span[may_pass], length[may_pass]
    share = 0.5 * (1.0 + (within[one] - within[other]) / length)
    middle = samples[one] + share[:, None] * span
    for _ in range(2):
        near, off = _from(shapes, middle, owner[one], samples[one])
        far, _ = _from(shapes, middle, owner[other], samples[other])
        middle = middle + 0.5 * (far - near)[:, None] * off
    near, off = _from(shapes, middle, owner[one], samples[one])
    far, off_other = _from(shapes, middle, owner[other], samples[other])
    least = np.minimum(near, far)
    open_ = least >= clearance_m
    hug = _HUG * clearance_m
    beside = open_ & (least > 1.15 * clearance_m)
    by_one, by_other = beside & (owner[one] >= 0), beside & (owner[other] >= 0)
    points = np.concatenate(
        [
            middle[open_],
            (middle - (near - hug)[:, None] * off)[by_one],
            (middle - (far - hug)[:, None] * off_other)[by_other],
        ]
    )
    rows = np.full((len(pairs), 3), -1, dtype=np.intp)
    count = 0
    for column, chosen in enumerate((open_, by_one, by_other)):
        number = int(chosen.sum())
        rows[may_pass[chosen], column] = np.arange(count, count + number)
        count += number
    return points, rows


def _from(
    shapes: PlanarShapes, points: Array, owner: Indices, samples: Array
) -> tuple[Array, Array]:
    """How far points are from shapes, or from the ring samples, and the direction off them."""
    offset = points - samples
    reach = np.hypot(offset[:, 0], offset[:, 1])
    off = offset / np.maximum(reach, 1e-12)[:, None]
    if len(shapes):
        own = owner >= 0
        reach[own], off[own] = shapes.away(points[own], owner[own])
    return reach, off


def _joined(sides: Indices, nodes: Indices) -> tuple[Indices, Indices]:
    """Join the points of all gaps of each triangle, and those of each gap.

    The last row of nodes, which -1 stands for, belongs to no gap.
    """
    rows = nodes[sides]
    begins, ends = [], []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for k in range(3):
            for m in range(3):
                begins.append(rows[:, a, k])
                ends.append(rows[:, b, m])
    for k, m in ((0, 1), (0, 2)):
        begins.append(nodes[:, k])
        ends.append(nodes[:, m])
    begin, end = np.concatenate(begins), np.concatenate(ends)
    both = (begin >= 0) & (end >= 0)
    return begin[both], end[both]
