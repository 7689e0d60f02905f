"""The shortest path around few obstacles, in NumPy: what the compiled search is compared with.

The shortest path in the plane is made of lines that touch the outlines they go round. So begin
with the straight line; where the shortest path found yet hits an obstacle, add that, and
look for the shortest path around all that were added. A path that hits nothing any more is
the shortest there is: an obstacle that was never added could only have made it longer.

Outlines are taken as polygons about them, which makes a path longer by up to 2 % of its bends.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.planar_shapes import Indices, PlanarShapes
from tests.support.worlds.numpy_lines import are_clear, hits

__all__ = ["TooManyObstaclesError", "tangent_path"]

_CORNERS = 16
# Beyond these numbers it takes too long: of obstacles, and of times that some are taken in.
_SHAPES_MAX = 90
_ROUNDS_MAX = 60
# A line along a polygon must not be nearer than the clearance by rounding.
_ROOM = 1.0 + 1e-6


class TooManyObstaclesError(Exception):
    """The oracle would take too long."""


def tangent_path(
    start_enu_m: Array,
    goal_enu_m: Array,
    level: Obstacles,
    clearance_m: float,
) -> Array | None:
    """Return the points of the shortest path in the plane of the start, shape (N, 3).

    Args:
        start_enu_m: clear of all obstacles.
        goal_enu_m: clear of all obstacles, at the same height.
        level: the obstacles at this height.
        clearance_m: that every line of the path keeps.

    Returns:
        None if there is none.

    Raises:
        TooManyObstaclesError: it is not clear with few obstacles.
    """
    search = _Search(start_enu_m, goal_enu_m, level, clearance_m)
    for _ in range(_ROUNDS_MAX):
        path = search.shortest()
        if path is None:
            return None
        _, obstacles = hits(level, path[:-1], path[1:], clearance_m)
        if not len(obstacles):
            return path
        new = np.unique(obstacles)
        if len(new) + search.taken > _SHAPES_MAX:
            break
        search.take(new)
    raise TooManyObstaclesError


class _Search:
    """The obstacles taken in, and the lines between their corners."""

    def __init__(self, start: Array, goal: Array, level: Obstacles, clearance_m: float) -> None:
        self._level = level
        self._shapes = PlanarShapes(level)
        self._clearance_m = clearance_m
        self._height = start[2]
        self._rows = np.empty(0, dtype=np.intp)
        # For each point: where it is, and the vectors to its neighbours on its polygon. The start
        # and the goal are polygons of one point.
        self._points = np.array([start[:2], goal[:2]])
        self._before = self._after = np.zeros((2, 2))
        self._sound = np.ones(2, dtype=np.bool_)
        self._begins = np.array([0], dtype=np.intp)
        self._ends = np.array([1], dtype=np.intp)

    @property
    def taken(self) -> int:
        """The number of obstacles taken in."""
        return len(self._rows)

    def shortest(self) -> Array | None:
        """Return the shortest path around what is taken in."""
        count = len(self._points)
        lengths = np.hypot(*(self._points[self._ends] - self._points[self._begins]).T)
        graph = scipy.sparse.csr_array((lengths, (self._begins, self._ends)), shape=(count, count))
        indices = np.array([0])
        _, before = scipy.sparse.csgraph.dijkstra(
            graph, directed=False, indices=indices, return_predecessors=True
        )
        path = [1]
        while path[-1] != 0:
            path.append(int(before[0, path[-1]]))
            if path[-1] < 0:
                return None
        return self._in_space(np.array(path[::-1]))

    def take(self, rows: Indices) -> None:
        """Process obstacles of the level."""
        new = _of(self._level, rows)
        clear = are_clear(
            new, self._in_space(self._begins), self._in_space(self._ends), self._clearance_m
        )
        self._begins, self._ends = self._begins[clear], self._ends[clear]
        self._rows = np.concatenate([self._rows, rows])
        taken = _of(self._level, self._rows)
        first = self._add_points(rows)
        self._sound[:first] &= self._are_sound(new, self._points[:first])
        self._sound[first:] = self._are_sound(taken, self._points[first:])
        begins, ends = self._touching(first)
        clear = are_clear(taken, self._in_space(begins), self._in_space(ends), self._clearance_m)
        self._begins = np.concatenate([self._begins, begins[clear]])
        self._ends = np.concatenate([self._ends, ends[clear]])

    def _add_points(self, rows: Indices) -> int:
        """Add the polygons about outlines; returns the first new point."""
        first = len(self._points)
        polygons = self._polygons(rows)
        sides = np.empty_like(polygons)
        sides[:, :-1] = polygons[:, 1:] - polygons[:, :-1]
        sides[:, -1] = polygons[:, 0] - polygons[:, -1]
        back = np.concatenate([-sides[:, -1:], -sides[:, :-1]], axis=1)
        new, before, after = (part.reshape(-1, 2) for part in (polygons, back, sides))
        self._points = np.concatenate([self._points, new])
        self._before = np.concatenate([self._before, before])
        self._after = np.concatenate([self._after, after])
        self._sound = np.concatenate([self._sound, np.ones(len(new), dtype=np.bool_)])
        return first

    def _are_sound(self, obstacles: Obstacles, points: Array) -> NDArray[np.bool_]:
        gaps_m = PlanarShapes(obstacles).gaps_m(points)
        return np.asarray((gaps_m >= self._clearance_m).all(axis=1))

    def _polygons(self, rows: Indices) -> Array:
        """Return polygons about outlines with the clearance, shape (N, _CORNERS, 2)."""
        shapes = self._shapes
        angle = math.tau * (np.arange(_CORNERS) + 0.5) / _CORNERS
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        reach = (shapes.radius_m[rows] + self._clearance_m) * _ROOM / math.cos(math.pi / _CORNERS)
        own = np.sign(circle) * shapes.half_m[rows, None] + circle * reach[:, None, None]
        axis = shapes.axis[rows, None]
        east = own[..., 0] * axis[..., 0] - own[..., 1] * axis[..., 1]
        north = own[..., 0] * axis[..., 1] + own[..., 1] * axis[..., 0]
        return np.asarray(shapes.middle_m[rows, None] + np.stack([east, north], axis=-1))

    def _touching(self, first: int) -> tuple[Indices, Indices]:
        """Return the lines between new points and all before that enter no own polygon."""
        new = first + np.flatnonzero(self._sound[first:])
        every = np.flatnonzero(self._sound)
        east = self._points[every, 0] - self._points[new, 0, None]
        north = self._points[every, 1] - self._points[new, 1, None]
        rows, columns = np.nonzero(self._passes(new[:, None], east, north))
        begins, ends = new[rows], every[columns]
        touches = self._passes(ends, east[rows, columns], north[rows, columns]) & (begins > ends)
        return begins[touches], ends[touches]

    def _passes(self, points: Indices, east: Array, north: Array) -> NDArray[np.bool_]:
        """Whether lines leave both neighbours of a point on one side of them, or touch them."""
        before, after = self._before[points], self._after[points]
        one = east * before[..., 1] - north * before[..., 0]
        one *= east * after[..., 1] - north * after[..., 0]
        return np.asarray(one >= -1e-9)

    def _in_space(self, points: Indices) -> Array:
        places = np.empty((len(points), 3))
        places[:, :2] = self._points[points]
        places[:, 2] = self._height
        return places


def _of(level: Obstacles, rows: Indices) -> Obstacles:
    count = len(level.posts)
    return Obstacles(level.posts[rows[rows < count]], level.boxes[rows[rows >= count] - count])
