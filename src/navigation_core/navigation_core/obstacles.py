"""Things that are in the way: upright posts and boxes, and how far everything is from them.

Every obstacle is a prism with a level top and bottom. What a sensor has seen is a set of
posts, a cylinder is one post, a wall is a thin box. All of them are rows of two arrays, so
that a question about thousands of them is a few NumPy calls.

Clearance is measured as a vehicle of a given size needs it: a point is clear of a prism by
``c`` if it is ``c`` beside its outline, or ``c`` above its top or below its bottom. So it is
the greater of the horizontal and the vertical distance, which is never more than the true
distance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import Vector3

__all__ = ["NOTHING", "Box", "Cylinder", "KnownObstacle", "ObstacleError", "Obstacles"]

Array: TypeAlias = NDArray[np.float64]

# Columns of the two tables.
POST_COLUMNS = 5
BOX_COLUMNS = 7
# Pairs of points and obstacles that are looked at in one go, to bound the memory.
_PAIRS_MAX = 1_000_000


class ObstacleError(ValueError):
    """An obstacle has no sound shape; the sentence says which number is wrong."""


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder.

    Attributes:
        name: for people.
        centre_enu_m: east and north of its axis, in the map frame.
        radius_m: above 0.
        bottom_m: map z of its lower side; may be minus infinity.
        top_m: map z of its upper side; may be infinity.
    """

    name: str
    centre_enu_m: tuple[float, float]
    radius_m: float
    bottom_m: float = -math.inf
    top_m: float = math.inf

    def __post_init__(self) -> None:
        """Refuse what has no shape.

        Raises:
            ObstacleError: a number is NaN, or the radius or the height is not positive.
        """
        _check(self.name, self.centre_enu_m, (self.radius_m,), self.bottom_m, self.top_m)


@dataclass(frozen=True)
class Box:
    """An upright box; a wall is a thin one.

    Attributes:
        name: for people.
        centre_enu_m: east and north of its middle, in the map frame.
        size_m: length along its own x axis and along its own y axis, each at least 0.
        yaw_enu_rad: how its x axis is turned from east, counter-clockwise.
        bottom_m: map z of its lower side; may be minus infinity.
        top_m: map z of its upper side; may be infinity.
    """

    name: str
    centre_enu_m: tuple[float, float]
    size_m: tuple[float, float]
    yaw_enu_rad: float = 0.0
    bottom_m: float = -math.inf
    top_m: float = math.inf

    def __post_init__(self) -> None:
        """Refuse what has no shape.

        Raises:
            ObstacleError: a number is NaN, or both sides are 0, or the height is not positive.
        """
        place = (*self.centre_enu_m, self.yaw_enu_rad)
        _check(self.name, place, (max(self.size_m),), self.bottom_m, self.top_m)
        _check(self.name, self.size_m, (1.0,), self.bottom_m, self.top_m)
        if min(self.size_m) < 0.0:
            raise ObstacleError(f"Obstacle {self.name}: a side of {min(self.size_m)} m; give 0 up.")


KnownObstacle: TypeAlias = Cylinder | Box


def _check(
    name: str, place: tuple[float, ...], sizes: tuple[float, ...], bottom_m: float, top_m: float
) -> None:
    if not all(math.isfinite(value) for value in (*place, *sizes)):
        raise ObstacleError(f"Obstacle {name}: {(*place, *sizes)} holds no finite numbers.")
    if min(sizes) <= 0.0:
        raise ObstacleError(f"Obstacle {name}: a size of {min(sizes)} m; give more than 0.")
    if not bottom_m < top_m:
        raise ObstacleError(
            f"Obstacle {name}: its bottom at {bottom_m} m is not below its top at {top_m} m."
        )


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

    def near(self, low_enu_m: Vector3, high_enu_m: Vector3, within_m: float) -> Obstacles:
        """Return those that may be within a distance of an upright cuboid of the map frame."""
        low, high = np.array(low_enu_m) - within_m, np.array(high_enu_m) + within_m
        return Obstacles(
            self.posts[_may_touch(self.posts, self.posts[:, 2], low, high)],
            self.boxes[_may_touch(self.boxes, np.hypot(*self.boxes[:, 2:4].T), low, high)],
        )

    def between(self, low_m: float, high_m: float) -> Obstacles:
        """Return those of which some part is between two heights (map z)."""
        return Obstacles(
            self.posts[(self.posts[:, 3] < high_m) & (self.posts[:, 4] > low_m)],
            self.boxes[(self.boxes[:, 5] < high_m) & (self.boxes[:, 6] > low_m)],
        )

    def clearance_m(self, points_enu_m: Array) -> Array:
        """Return how far points are from the nearest obstacle, 0 inside of one.

        Args:
            points_enu_m: shape (N, 3).

        Returns:
            Shape (N,); infinity where there is no obstacle.
        """
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        nearest = np.full(len(points), np.inf)
        if not len(self) or not len(points):
            return nearest
        step = max(_PAIRS_MAX // len(self), 1)
        for i in range(0, len(points), step):
            nearest[i : i + step] = self._clearance_m(points[i : i + step])
        return nearest

    def _clearance_m(self, points: Array) -> Array:
        beside = np.concatenate([self._to_posts_m(points), self._to_boxes_m(points)], axis=1)
        height = points[:, 2:3]
        over = np.maximum(np.maximum(self._bottom_m - height, height - self._top_m), 0.0)
        return np.asarray(np.maximum(beside, over).min(axis=1))

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
        starts = np.asarray(starts_enu_m, dtype=np.float64).reshape(-1, 3)
        ends = np.asarray(ends_enu_m, dtype=np.float64).reshape(-1, 3)
        clear = np.ones(len(starts), dtype=np.bool_)
        if not len(self):
            return clear
        step = max(_PAIRS_MAX // len(self), 1)
        for i in range(0, len(starts), step):
            clear[i : i + step] = self._are_clear(
                starts[i : i + step], ends[i : i + step], clearance_m
            )
        return clear

    def _are_clear(self, starts: Array, ends: Array, clearance_m: float) -> NDArray[np.bool_]:
        # The part of each line that is not above or below an obstacle, as shares of the line.
        low, high = self._bottom_m - clearance_m, self._top_m + clearance_m
        begin, rise = starts[:, 2:3], (ends - starts)[:, 2:3]
        with np.errstate(divide="ignore", invalid="ignore"):
            first, last = (low - begin) / rise, (high - begin) / rise
        level = np.abs(rise) < 1e-9
        beside = level & (begin > low) & (begin < high)
        enter = np.where(level, np.where(beside, 0.0, 2.0), np.minimum(first, last))
        leave = np.where(level, np.where(beside, 1.0, -1.0), np.maximum(first, last))
        enter, leave = np.maximum(enter, 0.0), np.minimum(leave, 1.0)
        count = len(self.posts)
        posts_m = self._lines_to_posts_m(starts, ends, enter[:, :count], leave[:, :count])
        boxes_m = self._lines_to_boxes_m(starts, ends, enter[:, count:], leave[:, count:])
        meets = enter < leave
        far = np.concatenate([posts_m, boxes_m], axis=1) >= clearance_m
        return np.asarray((far | ~meets).all(axis=1))

    @cached_property
    def _bottom_m(self) -> Array:
        return np.concatenate([self.posts[:, 3], self.boxes[:, 5]])

    @cached_property
    def _top_m(self) -> Array:
        return np.concatenate([self.posts[:, 4], self.boxes[:, 6]])

    def _to_posts_m(self, points: Array) -> Array:
        offset = points[:, None, :2] - self.posts[:, :2]
        far = np.hypot(offset[..., 0], offset[..., 1]) - self.posts[:, 2]
        return np.asarray(np.maximum(far, 0.0))

    def _to_boxes_m(self, points: Array) -> Array:
        x, y = self._in_boxes(points[:, None, :2] - self.boxes[:, :2])
        aside, along = np.abs(y) - self.boxes[:, 3], np.abs(x) - self.boxes[:, 2]
        return np.asarray(np.hypot(np.maximum(along, 0.0), np.maximum(aside, 0.0)))

    def _in_boxes(self, offset: Array) -> tuple[Array, Array]:
        """Vectors of shape (..., B, 2) in the boxes' own axes."""
        cosine, sine = np.cos(self.boxes[:, 4]), np.sin(self.boxes[:, 4])
        east, north = offset[..., 0], offset[..., 1]
        return east * cosine + north * sine, north * cosine - east * sine

    def _lines_to_posts_m(self, starts: Array, ends: Array, enter: Array, leave: Array) -> Array:
        """How near the parts of lines come to the posts, shape (N, P)."""
        along = (ends - starts)[:, None, :2]
        offset = self.posts[:, :2] - starts[:, None, :2]
        length2 = np.maximum((along * along).sum(axis=-1), 1e-18)
        share = np.clip((offset * along).sum(axis=-1) / length2, enter, leave)
        gap = offset - share[..., None] * along
        return np.asarray(np.maximum(np.hypot(gap[..., 0], gap[..., 1]) - self.posts[:, 2], 0.0))

    def _lines_to_boxes_m(self, starts: Array, ends: Array, enter: Array, leave: Array) -> Array:
        """How near the parts of lines come to the boxes, shape (N, B)."""
        if not len(self.boxes):
            return np.empty((len(starts), 0))
        along = (ends - starts)[:, None, :2]
        offset = starts[:, None, :2] - self.boxes[:, :2]
        a = np.stack(self._in_boxes(offset + enter[..., None] * along), axis=-1)
        b = np.stack(self._in_boxes(offset + leave[..., None] * along), axis=-1)
        half = self.boxes[:, 2:4]
        ends_m = np.minimum(_outside(a, half), _outside(b, half))
        line = b - a
        length2 = np.maximum((line * line).sum(axis=-1), 1e-18)
        nearest = np.where(_crosses(a, line, half), 0.0, ends_m)
        for signs in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
            to = half * np.array(signs) - a
            share = np.clip((to * line).sum(axis=-1) / length2, 0.0, 1.0)
            gap = to - share[..., None] * line
            nearest = np.minimum(nearest, np.hypot(gap[..., 0], gap[..., 1]))
        return np.asarray(nearest)


def _outside(points: Array, half: Array) -> Array:
    over = np.maximum(np.abs(points) - half, 0.0)
    return np.asarray(np.hypot(over[..., 0], over[..., 1]))


def _crosses(start: Array, line: Array, half: Array) -> NDArray[np.bool_]:
    """Whether lines go through boxes about the origin, by the slab method."""
    safe = np.where(np.abs(line) < 1e-12, 1e-12, line)
    first, second = (-half - start) / safe, (half - start) / safe
    enter = np.minimum(first, second).max(axis=-1)
    leave = np.maximum(first, second).min(axis=-1)
    return np.asarray((enter <= leave) & (leave >= 0.0) & (enter <= 1.0))


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
