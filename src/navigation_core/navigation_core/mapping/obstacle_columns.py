"""Obstacles column by column, and the straight lines that come near them."""

from __future__ import annotations

from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.mapping.obstacle_outlines import lines_to_boxes_m, lines_to_posts_m
from navigation_core.mapping.obstacle_sweep import Indices, Sweep

__all__ = ["ObstacleColumns"]

Array: TypeAlias = NDArray[np.float64]

# Pairs of lines and obstacles that are looked at in one go, to bound the memory.
_PAIRS_MAX = 200_000
# With more pairs than this, most are left out by the order of the obstacles from west to east.
_SWEEP_MIN = 3000
# A line that rises less than this is level.
_LEVEL_M = 1e-9
# Far above what sums of coordinates lose.
ROUNDING_M = 1e-6


class ObstacleColumns:
    """One column for each measure of the obstacles, shape (P + B,), the posts first."""

    def __init__(self, posts: Array, boxes: Array) -> None:
        """Take over the tables of :class:`~navigation_core.mapping.obstacles.Obstacles`."""
        self._posts = posts
        self._boxes = boxes

    @cached_property
    def east_m(self) -> Array:
        """East coordinates of their middles."""
        return np.concatenate([self._posts[:, 0], self._boxes[:, 0]])

    @cached_property
    def north_m(self) -> Array:
        """North coordinates of their middles."""
        return np.concatenate([self._posts[:, 1], self._boxes[:, 1]])

    @cached_property
    def reach_m(self) -> Array:
        """How far their outlines are from their middles at most."""
        return np.concatenate([self._posts[:, 2], np.hypot(self._boxes[:, 2], self._boxes[:, 3])])

    @cached_property
    def radius_m(self) -> Array:
        """Radii of posts; 0 of boxes."""
        return np.concatenate([self._posts[:, 2], np.zeros(len(self._boxes))])

    @cached_property
    def half_x_m(self) -> Array:
        """Half the lengths of boxes; 0 of posts."""
        return np.concatenate([np.zeros(len(self._posts)), self._boxes[:, 2]])

    @cached_property
    def half_y_m(self) -> Array:
        """Half the widths of boxes; 0 of posts."""
        return np.concatenate([np.zeros(len(self._posts)), self._boxes[:, 3]])

    @cached_property
    def cosine(self) -> Array:
        """Cosines of the yaw of boxes; 1 of posts."""
        return np.concatenate([np.ones(len(self._posts)), np.cos(self._boxes[:, 4])])

    @cached_property
    def sine(self) -> Array:
        """Sines of the yaw of boxes; 0 of posts."""
        return np.concatenate([np.zeros(len(self._posts)), np.sin(self._boxes[:, 4])])

    @cached_property
    def sweep(self) -> Sweep:
        """Their order from west to east."""
        return Sweep(self.east_m, self.reach_m)

    @cached_property
    def bottom_m(self) -> Array:
        """Map z of their bottoms."""
        return np.concatenate([self._posts[:, 3], self._boxes[:, 5]])

    @cached_property
    def top_m(self) -> Array:
        """Map z of their tops."""
        return np.concatenate([self._posts[:, 4], self._boxes[:, 6]])

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
        starts = np.asarray(starts_enu_m, dtype=np.float64).reshape(-1, 3)
        ends = np.asarray(ends_enu_m, dtype=np.float64).reshape(-1, 3)
        step = max(_PAIRS_MAX // max(len(self.east_m), 1), 1)
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
        if len(starts) * len(self.east_m) > _SWEEP_MIN:
            pairs = self.sweep.pairs(middle[:, 0], np.abs(span[:, 0]) + clearance_m)
        line, obstacle = self._in_circles(middle, span, clearance_m) if pairs is None else pairs
        # Parted along the line, or along a side of a box; what is not further away, rather than
        # what is nearer: with NaN nothing is clear.
        room = self.radius_m[obstacle] + (clearance_m + ROUNDING_M)
        east = self.east_m[obstacle] - middle[line, 0]
        north = self.north_m[obstacle] - middle[line, 1]
        along_east, along_north = span[line, 0], span[line, 1]
        if len(self._boxes):
            cosine, sine = self.cosine[obstacle], self.sine[obstacle]
            east, north = east * cosine + north * sine, north * cosine - east * sine
            along_east, along_north = (
                along_east * cosine + along_north * sine,
                along_north * cosine - along_east * sine,
            )
        half_x, half_y = self.half_x_m[obstacle], self.half_y_m[obstacle]
        x, y = np.abs(along_east), np.abs(along_north)
        length = np.maximum(np.sqrt(x * x + y * y), ROUNDING_M)
        aside = np.abs(along_east * north - along_north * east)
        near = ~(aside > half_x * y + half_y * x + room * length)
        near &= ~(np.abs(east) > half_x + x + room)
        near &= ~(np.abs(north) > half_y + y + room)
        return line[near], obstacle[near]

    def _in_circles(
        self, middle: Array, span: Array, clearance_m: float
    ) -> tuple[Indices, Indices]:
        """Return the pairs of a line and an obstacle that a circle about each cannot part."""
        reach = self.reach_m + (np.hypot(span[:, 0], span[:, 1]) + clearance_m)[:, None]
        east, north = self.east_m - middle[:, 0:1], self.north_m - middle[:, 1:2]
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
        count = len(self._posts)
        for table, chosen, nearest_m in (
            (self._posts, hit & (which < count), lines_to_posts_m),
            (self._boxes, hit & (which >= count), lines_to_boxes_m),
        ):
            if chosen.any():
                rows = table[which[chosen] - (0 if table is self._posts else count)]
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
        low, high = self.bottom_m[which] - clearance_m, self.top_m[which] + clearance_m
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
