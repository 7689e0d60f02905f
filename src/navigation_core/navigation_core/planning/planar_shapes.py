"""Obstacles in the plane: rounded boxes, points along their outlines, and distances to them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["Indices", "PlanarShapes", "places_of"]

Indices: TypeAlias = NDArray[np.intp]


class PlanarShapes:
    """Obstacles seen from above.

    A shape is a box with a radius about it: a post is a box without sides, a box one without
    a radius. So there is one rule for how far a point is from a shape.

    Attributes:
        middle_m: shape (M, 2), east and north.
        half_m: half the sides, shape (M, 2).
        axis: unit vectors along the first side, shape (M, 2).
        radius_m: shape (M,).
    """

    def __init__(self, obstacles: Obstacles) -> None:
        """Look at obstacles from above."""
        posts, boxes = obstacles.posts, obstacles.boxes
        level = np.zeros((len(posts), 2))
        yaw = np.concatenate([np.zeros(len(posts)), boxes[:, 4]])
        self.middle_m = np.concatenate([posts[:, :2], boxes[:, :2]])
        self.half_m = np.concatenate([level, boxes[:, 2:4]])
        self.axis = np.column_stack([np.cos(yaw), np.sin(yaw)])
        self.radius_m = np.concatenate([posts[:, 2], np.zeros(len(boxes))])

    def __len__(self) -> int:
        """How many shapes."""
        return len(self.radius_m)

    @property
    def extent_m(self) -> Array:
        """How far the outlines are from their middles at most, east and north, shape (M, 2)."""
        east, north = np.abs(self.axis).T
        x, y = self.half_m.T
        return np.asarray(
            self.radius_m[:, None] + np.stack([east * x + north * y, north * x + east * y], 1)
        )

    def gaps_m(self, points_m: Array) -> Array:
        """Return how far points (N, 2) are from all shapes, shape (N, M); at most 0 within one."""
        east = points_m[:, 0:1] - self.middle_m[:, 0]
        north = points_m[:, 1:2] - self.middle_m[:, 1]
        axis_east, axis_north = self.axis[:, 0], self.axis[:, 1]
        x = np.abs(east * axis_east + north * axis_north) - self.half_m[:, 0]
        y = np.abs(north * axis_east - east * axis_north) - self.half_m[:, 1]
        np.maximum(x, 0.0, out=x)
        np.maximum(y, 0.0, out=y)
        return np.asarray(np.hypot(x, y) - self.radius_m)

    def away(self, points_m: Array, of: Indices) -> tuple[Array, Array]:
        """Return how far points are from one shape each, and which direction leads off it.

        Args:
            points_m: shape (N, 2).
            of: which shape, shape (N,).

        Returns:
            Distances, shape (N,), at most 0 within a shape; and unit vectors away from it, shape
            (N, 2), zero inside of a box.
        """
        axis = self.axis[of]
        x, y = self._beyond(points_m, of, axis)
        reach = np.hypot(x, y)
        scale = 1.0 / np.maximum(reach, 1e-12)
        east = (x * axis[:, 0] - y * axis[:, 1]) * scale
        north = (x * axis[:, 1] + y * axis[:, 0]) * scale
        return reach - self.radius_m[of], np.column_stack([east, north])

    def gap_m(self, points_m: Array, of: Indices) -> Array:
        """Return how far points (N, 2) are from one shape each (N,); at most 0 within it."""
        x, y = self._beyond(points_m, of, self.axis[of])
        return np.asarray(np.hypot(x, y) - self.radius_m[of])

    def _beyond(self, points_m: Array, of: Indices, axis: Array) -> tuple[Array, Array]:
        """Return how far points are beyond the sides of shapes, in the shapes' own axes."""
        half, offset = self.half_m[of], points_m - self.middle_m[of]
        x = offset[:, 0] * axis[:, 0] + offset[:, 1] * axis[:, 1]
        y = offset[:, 1] * axis[:, 0] - offset[:, 0] * axis[:, 1]
        x -= np.minimum(np.maximum(x, -half[:, 0]), half[:, 0])
        y -= np.minimum(np.maximum(y, -half[:, 1]), half[:, 1])
        return x, y

    def depth_m(self, point_m: Array) -> float:
        """Return how far a point is within the outline of any shape, at most; 0 if in none."""
        if not len(self):
            return 0.0
        offset = point_m - self.middle_m
        x = offset[:, 0] * self.axis[:, 0] + offset[:, 1] * self.axis[:, 1]
        y = offset[:, 1] * self.axis[:, 0] - offset[:, 0] * self.axis[:, 1]
        in_post = self.radius_m - np.hypot(x, y)
        in_box = np.minimum(self.half_m[:, 0] - np.abs(x), self.half_m[:, 1] - np.abs(y))
        depth = np.where(self.radius_m > 0.0, in_post, in_box)
        return max(float(depth.max()), 0.0)

    def sampled(self, spacing_m: float) -> tuple[Array, Indices]:
        """Return points along the outlines, and whose they are.

        A shape that is thinner than the spacing has its points along its middle: two rows so near
        to each other would add nothing.

        Returns:
            Shapes (N, 2) and (N,).
        """
        wide = np.flatnonzero(self.radius_m > spacing_m)
        parts = [self._rings(wide, spacing_m)] if len(wide) else []
        length, breadth = 2.0 * self.half_m.max(axis=1), 2.0 * self.half_m.min(axis=1)
        thick = (breadth > spacing_m) & (self.radius_m == 0.0)
        thin = np.flatnonzero(~thick & (self.radius_m <= spacing_m))
        along = np.where(
            (self.half_m[:, 0] >= self.half_m[:, 1])[:, None],
            self.half_m * (1.0, 0.0),
            self.half_m * (0.0, 1.0),
        )[thin]
        count = np.ceil(length[thin] / spacing_m).astype(np.intp) + 1
        parts.append(self._lines(thin, -along, along, count))
        index = np.flatnonzero(thick)
        half = self.half_m[index]
        for sign in (1.0, -1.0):
            for a, b in (((-1.0, -1.0), (1.0, -1.0)), ((1.0, -1.0), (1.0, 1.0))):
                count = np.ceil(2.0 * half[:, 0 if a[1] == b[1] else 1] / spacing_m)
                start, end = half * a * sign, half * b * sign
                step = (end - start) / count[:, None]
                parts.append(self._lines(index, start, end - step, count.astype(np.intp)))
        return np.concatenate([p for p, _ in parts]), np.concatenate([o for _, o in parts])

    def _rings(self, index: Indices, spacing_m: float) -> tuple[Array, Indices]:
        count = np.ceil(math.tau * self.radius_m[index] / spacing_m).astype(np.intp)
        owner, place = np.repeat(index, count), places_of(count)
        angle = math.tau * place / np.repeat(count, count)
        ring = np.column_stack([np.cos(angle), np.sin(angle)]) * self.radius_m[owner, None]
        return self.middle_m[owner] + ring, owner

    def _lines(
        self, index: Indices, start: Array, end: Array, count: Indices
    ) -> tuple[Array, Indices]:
        """Points along lines within shapes, from start to end in the shapes' own axes."""
        owner, place = np.repeat(index, count), places_of(count)
        number = np.repeat(count, count)
        share = np.where(number == 1, 0.5, place / np.maximum(number - 1, 1))[:, None]
        first, last = np.repeat(start, count, axis=0), np.repeat(end, count, axis=0)
        own = first * (1.0 - share) + last * share
        axis = self.axis[owner]
        east = own[:, 0] * axis[:, 0] - own[:, 1] * axis[:, 1]
        north = own[:, 0] * axis[:, 1] + own[:, 1] * axis[:, 0]
        return self.middle_m[owner] + np.column_stack([east, north]), owner


def places_of(count: Indices) -> Indices:
    """Return 0, 1, ... for each group of this many."""
    total = np.cumsum(count)
    last = int(total[-1]) if len(total) else 0
    return np.arange(last) - np.repeat(total - count, count)
