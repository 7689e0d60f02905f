"""Obstacles as upright cylinders and boxes, and the clearance to them.

Every obstacle is a prism with a level top and bottom. A cylinder is one post, a wall is a thin
box, and the obstacles that a sensor has seen are a set of posts. All of them are rows of two
arrays, so that a question about thousands of them is a few NumPy calls.

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

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_outlines import (
    in_boxes,
    lines_to_boxes_m,
    lines_to_posts_m,
    outside,
)
from navigation_core.mapping.obstacle_shapes import Box, Cylinder, KnownObstacle, ObstacleError
from navigation_core.mapping.obstacle_sweep import Indices, Sweep

__all__ = ["NOTHING", "Box", "Cylinder", "KnownObstacle", "ObstacleError", "Obstacles"]

Array: TypeAlias = NDArray[np.float64]

# Columns of the two tables.
POST_COLUMNS = 5
BOX_COLUMNS = 7
# Pairs of lines and obstacles that are looked at in one go, to bound the memory.
_PAIRS_MAX = 200_000
# With more pairs than this, most are left out by the order of the obstacles from west to east.
_SWEEP_MIN = 3000
# Points for which the few obstacles that can be nearest are looked up together. They come along
# a path, so they are near each other; 400 points beside 2,000 posts take least time with this.
_POINTS_TOGETHER = 32
# A vehicle asks often about obstacles near it. With more obstacles than this, those of its vicinity
# are kept for the next questions: all within this distance of the last one.
_VICINITY_MIN, _VICINITY_M = 100, 12.0
# A line that rises less than this is level.
_LEVEL_M = 1e-9
# Far above what sums of coordinates lose.
_ROUNDING_M = 1e-6


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
        clear = np.ones(len(starts_enu_m), dtype=np.bool_)
        clear[self.hits(starts_enu_m, ends_enu_m, clearance_m)[0]] = False
        return clear

    def hits(
        self, starts_enu_m: Array, ends_enu_m: Array, clearance_m: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return which straight lines come nearer than a clearance to which obstacles.

        Args:
            starts_enu_m: shape (N, 3).
            ends_enu_m: shape (N, 3).
            clearance_m: that is to be kept.

        Returns:
            Rows of the lines, and of the obstacles, posts first; both of shape (K,).
        """
        starts = np.asarray(starts_enu_m, dtype=np.float64).reshape(-1, 3)
        ends = np.asarray(ends_enu_m, dtype=np.float64).reshape(-1, 3)
        step = max(_PAIRS_MAX // max(len(self), 1), 1)
        lines = [np.empty(0, dtype=np.intp)]
        obstacles = [np.empty(0, dtype=np.intp)]
        for i in range(0, len(starts), step):
            group = slice(i, i + step)
            line, obstacle = self._may_meet(starts[group], ends[group], clearance_m)
            hit = self._hits(starts[i + line], ends[i + line], obstacle, clearance_m)
            lines.append(i + line[hit])
            obstacles.append(obstacle[hit])
        return np.concatenate(lines), np.concatenate(obstacles)

    def _may_meet(self, starts: Array, ends: Array, clearance_m: float) -> tuple[Indices, Indices]:
        """Return the pairs of a line and an obstacle that no straight line can part."""
        middle = 0.5 * (starts[:, :2] + ends[:, :2])
        span = 0.5 * (ends[:, :2] - starts[:, :2])
        pairs = None
        if len(starts) * len(self) > _SWEEP_MIN:
            pairs = self._sweep.pairs(middle[:, 0], np.abs(span[:, 0]) + clearance_m)
        line, obstacle = self._in_circles(middle, span, clearance_m) if pairs is None else pairs
        # Parted along the line, or along a side of a box; what is not further away, rather than
        # what is nearer: with NaN nothing is clear.
        room = self._radius_m[obstacle] + (clearance_m + _ROUNDING_M)
        east = self._east_m[obstacle] - middle[line, 0]
        north = self._north_m[obstacle] - middle[line, 1]
        along_east, along_north = span[line, 0], span[line, 1]
        if len(self.boxes):
            cosine, sine = self._cosine[obstacle], self._sine[obstacle]
            east, north = east * cosine + north * sine, north * cosine - east * sine
            along_east, along_north = (
                along_east * cosine + along_north * sine,
                along_north * cosine - along_east * sine,
            )
        half_x, half_y = self._half_x_m[obstacle], self._half_y_m[obstacle]
        x, y = np.abs(along_east), np.abs(along_north)
        length = np.maximum(np.sqrt(x * x + y * y), _ROUNDING_M)
        aside = np.abs(along_east * north - along_north * east)
        near = ~(aside > half_x * y + half_y * x + room * length)
        near &= ~(np.abs(east) > half_x + x + room)
        near &= ~(np.abs(north) > half_y + y + room)
        return line[near], obstacle[near]

    def _in_circles(
        self, middle: Array, span: Array, clearance_m: float
    ) -> tuple[Indices, Indices]:
        """Return the pairs of a line and an obstacle that a circle about each cannot part."""
        reach = self._reach_m + (np.hypot(span[:, 0], span[:, 1]) + clearance_m)[:, None]
        east, north = self._east_m - middle[:, 0:1], self._north_m - middle[:, 1:2]
        # In place: on large tables most of the time goes into new memory.
        gap2 = np.multiply(east, east, out=east)
        gap2 += np.multiply(north, north, out=north)
        reach *= reach
        line, obstacle = np.nonzero(~(gap2 > reach))
        return line, obstacle

    def _hits(
        self, starts: Array, ends: Array, which: NDArray[np.intp], clearance_m: float
    ) -> NDArray[np.bool_]:
        """Whether lines come nearer than a clearance to an obstacle each, shape (K,)."""
        hit, enter, leave = self._beside(starts, ends, which, clearance_m)
        count = len(self.posts)
        for table, chosen, nearest_m in (
            (self.posts, hit & (which < count), lines_to_posts_m),
            (self.boxes, hit & (which >= count), lines_to_boxes_m),
        ):
            if chosen.any():
                rows = table[which[chosen] - (0 if table is self.posts else count)]
                start, along = starts[chosen, :2], (ends - starts)[chosen, :2]
                gap_m = nearest_m(start, along, enter[chosen], leave[chosen], rows)
                hit[chosen] = ~(gap_m >= clearance_m)
        return hit

    def _beside(
        self, starts: Array, ends: Array, which: Indices, clearance_m: float
    ) -> tuple[NDArray[np.bool_], Array, Array]:
        """Return the part of each line that is not above or below an obstacle each.

        Returns:
            Whether there is one, and where it begins and ends, as shares of the line.
        """
        low, high = self._bottom_m[which] - clearance_m, self._top_m[which] + clearance_m
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

    @cached_property
    def _east_m(self) -> Array:
        return np.concatenate([self.posts[:, 0], self.boxes[:, 0]])

    @cached_property
    def _north_m(self) -> Array:
        return np.concatenate([self.posts[:, 1], self.boxes[:, 1]])

    @cached_property
    def _reach_m(self) -> Array:
        """How far their outlines are from their middles at most."""
        return np.concatenate([self.posts[:, 2], np.hypot(self.boxes[:, 2], self.boxes[:, 3])])

    @cached_property
    def _radius_m(self) -> Array:
        return np.concatenate([self.posts[:, 2], np.zeros(len(self.boxes))])

    @cached_property
    def _half_x_m(self) -> Array:
        return np.concatenate([np.zeros(len(self.posts)), self.boxes[:, 2]])

    @cached_property
    def _half_y_m(self) -> Array:
        return np.concatenate([np.zeros(len(self.posts)), self.boxes[:, 3]])

    @cached_property
    def _cosine(self) -> Array:
        return np.concatenate([np.ones(len(self.posts)), np.cos(self.boxes[:, 4])])

    @cached_property
    def _sine(self) -> Array:
        return np.concatenate([np.zeros(len(self.posts)), np.sin(self.boxes[:, 4])])

    @cached_property
    def _sweep(self) -> Sweep:
        return Sweep(self._east_m, self._reach_m)

    @cached_property
    def _bottom_m(self) -> Array:
        return np.concatenate([self.posts[:, 3], self.boxes[:, 5]])

    @cached_property
    def _top_m(self) -> Array:
        return np.concatenate([self.posts[:, 4], self.boxes[:, 6]])

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
