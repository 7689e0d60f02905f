"""Obstacles as upright cylinders and boxes, and the clearance to them.

Every obstacle is a prism with a level top and bottom. A cylinder is one post, a wall is a thin
box, and the obstacles that a sensor has seen are a set of posts. All of them are rows of two
arrays, so that a question about thousands of them is one call.

Clearance is measured as a vehicle of a given size needs it: a point is clear of a prism by
``c`` if it is ``c`` beside its outline, or ``c`` above its top or below its bottom. So it is
the greater of the horizontal and the vertical distance, which is never more than the true
distance.
"""

from __future__ import annotations

from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

import navigation_kernels
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_outlines import in_boxes, outside
from navigation_core.mapping.obstacle_shapes import Box, Cylinder, KnownObstacle, ObstacleError

__all__ = ["NOTHING", "Box", "Cylinder", "KnownObstacle", "ObstacleError", "Obstacles"]

Array: TypeAlias = NDArray[np.float64]
Indices: TypeAlias = NDArray[np.intp]

# Columns of the two tables.
POST_COLUMNS = 5
BOX_COLUMNS = 7
# Points for which the few obstacles that can be nearest are looked up together. They come along
# a path, so they are near each other; 400 points beside 2,000 posts take least time with this.
_POINTS_TOGETHER = 32
# Far above what sums of coordinates lose.
_ROUNDING_M = 1e-6
# A vehicle asks often about obstacles near it. With more obstacles than this, those of its vicinity
# are kept for the next questions: all within this distance of the last one.
_VICINITY_MIN, _VICINITY_M = 100, 12.0


class Obstacles:
    """A frozen set of obstacles; see the module.

    Attributes:
        posts: shape (P, 5): east, north, radius, bottom, top; metres in the map frame.
        boxes: shape (B, 7): east, north, half the length, half the width, yaw (rad,
            counter-clockwise from east), bottom, top.
    """

    def __init__(self, posts: Array | None = None, boxes: Array | None = None) -> None:
        """Take over two tables; they must not be changed afterwards."""
        self.posts = np.empty((0, POST_COLUMNS)) if posts is None else posts
        self.boxes = np.empty((0, BOX_COLUMNS)) if boxes is None else boxes
        # The last small cuboid that was asked about, widened, and what touches it.
        self._vicinity: tuple[Array, Array, Obstacles] | None = None

    @classmethod
    def of(cls, known: tuple[KnownObstacle, ...]) -> Obstacles:
        """Return known obstacles as tables."""
        posts = [
            (*o.centre_enu_m, o.radius_m, o.bottom_m, o.top_m)
            for o in known
            if isinstance(o, Cylinder)
        ]
        boxes = [
            (
                *o.centre_enu_m,
                0.5 * o.size_m[0],
                0.5 * o.size_m[1],
                o.yaw_enu_rad,
                o.bottom_m,
                o.top_m,
            )
            for o in known
            if isinstance(o, Box)
        ]
        return cls(
            np.array(posts, dtype=np.float64).reshape(-1, POST_COLUMNS),
            np.array(boxes, dtype=np.float64).reshape(-1, BOX_COLUMNS),
        )

    @cached_property
    def _bottom_m(self) -> Array:
        """Map z of all bottoms, shape (P + B,)."""
        return np.concatenate([self.posts[:, 3], self.boxes[:, 5]])

    @cached_property
    def _top_m(self) -> Array:
        """Map z of all tops, shape (P + B,)."""
        return np.concatenate([self.posts[:, 4], self.boxes[:, 6]])

    def __len__(self) -> int:
        """How many posts and boxes."""
        return len(self.posts) + len(self.boxes)

    def joined(self, other: Obstacles) -> Obstacles:
        """Return the obstacles of both."""
        if not len(other):
            return self
        if not len(self):
            return other
        return Obstacles(
            np.concatenate([self.posts, other.posts]), np.concatenate([self.boxes, other.boxes])
        )

    def endless(self) -> Obstacles:
        """Return the same obstacles without top and bottom."""
        posts, boxes = self.posts.copy(), self.boxes.copy()
        for table in (posts, boxes):
            table[:, -2:] = (-np.inf, np.inf)
        return Obstacles(posts, boxes)

    def near(self, low_enu_m: Vector3, high_enu_m: Vector3, within_m: float) -> Obstacles:
        """Return those that may be within a distance of an upright cuboid of the map frame."""
        low, high = np.array(low_enu_m) - within_m, np.array(high_enu_m) + within_m
        vicinity = self._vicinity
        if vicinity is not None and (vicinity[0] <= low).all() and (high <= vicinity[1]).all():
            return vicinity[2]._touching(low, high)
        if len(self) < _VICINITY_MIN or (high - low).max() > _VICINITY_M:
            return self._touching(low, high)
        wide_low, wide_high = low - _VICINITY_M, high + _VICINITY_M
        wide = self._touching(wide_low, wide_high)
        self._vicinity = (wide_low, wide_high, wide)
        return wide._touching(low, high)

    def _touching(self, low: Array, high: Array) -> Obstacles:
        """Return those whose surrounding cuboids touch another."""
        boxes = self.boxes
        if len(boxes):
            boxes = boxes[_may_touch(boxes, np.hypot(boxes[:, 2], boxes[:, 3]), low, high)]
        return Obstacles(self.posts[_may_touch(self.posts, self.posts[:, 2], low, high)], boxes)

    def between(self, low_m: float, high_m: float) -> Obstacles:
        """Return those of which some part is between two heights (map z)."""
        return self.chosen(self.are_between(low_m, high_m))

    def are_between(self, low_m: float, high_m: float) -> NDArray[np.bool_]:
        """Return of which some part is between two heights, shape (P + B,), the posts first."""
        return np.asarray((self._bottom_m < high_m) & (self._top_m > low_m))

    def chosen(self, which: NDArray[np.bool_]) -> Obstacles:
        """Return some of them; a flag for each, the posts first."""
        count = len(self.posts)
        return Obstacles(self.posts[which[:count]], self.boxes[which[count:]])

    def clearance_m(self, points_enu_m: Array) -> Array:
        """Return how far points are from the nearest obstacle, 0 inside of one.

        Args:
            points_enu_m: shape (N, 3).

        Returns:
            Shape (N,); infinity where there is no obstacle.
        """
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        nearest = np.full(len(points), np.inf)
        if not len(self):
            return nearest
        for i in range(0, len(points), _POINTS_TOGETHER):
            group = points[i : i + _POINTS_TOGETHER]
            nearest[i : i + len(group)] = self._may_be_nearest_to(group)._all_m(group).min(axis=1)
        return nearest

    def _may_be_nearest_to(self, points: Array) -> Obstacles:
        """Return all that can be the nearest to one of some points, and few others.

        A clearance changes by no more than one moves. So from a middle all points are within
        a reach, and each is no further from the nearest than the middle is, plus that reach.
        """
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        reach_m = np.sqrt(((points - middle) ** 2).sum(axis=1).max())
        gap_m = self._all_m(middle[None])[0]
        # Not `<=`: each comparison with NaN is false, and with NaN all obstacles must stay.
        keep = ~(gap_m > gap_m.min() + 2.0 * reach_m + _ROUNDING_M)
        count = len(self.posts)
        return Obstacles(self.posts[keep[:count]], self.boxes[keep[count:]])

    def _all_m(self, points: Array) -> Array:
        """Return the clearance of each point to each obstacle, shape (N, P + B)."""
        gaps = [
            table for table in (self._to_posts_m(points), self._to_boxes_m(points)) if table.size
        ]
        beside = gaps[0] if len(gaps) == 1 else np.concatenate(gaps, axis=1)
        height = points[:, 2:3]
        np.maximum(beside, self._bottom_m - height, out=beside)
        return np.maximum(beside, height - self._top_m, out=beside)

    def is_clear(self, start_enu_m: Vector3, end_enu_m: Vector3, clearance_m: float) -> bool:
        """Whether a straight line keeps a clearance throughout."""
        return bool(self.are_clear(np.array([start_enu_m]), np.array([end_enu_m]), clearance_m)[0])

    def are_clear(
        self, starts_enu_m: Array, ends_enu_m: Array, clearance_m: float
    ) -> NDArray[np.bool_]:
        """Whether straight lines keep a clearance throughout.

        Args:
            starts_enu_m: shape (N, 3).
            ends_enu_m: shape (N, 3).
            clearance_m: that is to be kept.

        Returns:
            Shape (N,).
        """
        return navigation_kernels.are_clear(
            self.posts, self.boxes, starts_enu_m, ends_enu_m, clearance_m
        )

    def hits(
        self, starts_enu_m: Array, ends_enu_m: Array, clearance_m: float
    ) -> tuple[Indices, Indices]:
        """Return which straight lines come nearer than a clearance to which obstacles.

        Args:
            starts_enu_m: shape (N, 3).
            ends_enu_m: shape (N, 3).
            clearance_m: that is to be kept.

        Returns:
            Rows of the lines, and of the obstacles, posts first; both of shape (K,).
        """
        return navigation_kernels.hits(
            self.posts, self.boxes, starts_enu_m, ends_enu_m, clearance_m
        )

    def _to_posts_m(self, points: Array) -> Array:
        east = self.posts[:, 0] - points[:, 0:1]
        north = self.posts[:, 1] - points[:, 1:2]
        # np.hypot is several times slower, and guards numbers that no map holds.
        gap = np.sqrt(east * east + north * north) - self.posts[:, 2]
        return np.asarray(np.maximum(gap, 0.0))

    def _to_boxes_m(self, points: Array) -> Array:
        x, y = in_boxes(points[:, None, :2] - self.boxes[:, :2], self.boxes)
        return outside(np.stack([x, y], axis=-1), self.boxes[:, 2:4])


def _may_touch(table: Array, reach_m: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    east, north, bottom, top = table[:, 0], table[:, 1], table[:, -2], table[:, -1]
    return np.asarray(
        (east + reach_m >= low[0])
        & (east - reach_m <= high[0])
        & (north + reach_m >= low[1])
        & (north - reach_m <= high[1])
        & (top >= low[2])
        & (bottom <= high[2])
    )


NOTHING = Obstacles()
