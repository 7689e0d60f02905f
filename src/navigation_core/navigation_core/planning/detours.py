"""Paths around, over or under obstacles between two points that are clear of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.enclosure_proof import is_end_walled_in, is_walled_in
from navigation_core.planning.path_search import CLIMB_COST, path_cost_m, shortest_path
from navigation_core.planning.roadmap import build_net
from navigation_core.planning.shortcuts import pulled_tight, with_fewer_corners
from navigation_core.planning.tangent_search import tangent_path

__all__ = ["around"]

# Levels over or under the obstacles that are looked at.
_OVER = 2
_UNDER = 1
_OVER_M = 0.01
# A height leads over the obstacles on the line if less than this share of them still is there.
_STILL_BLOCKED_SHARE = 0.5
# Where to rise if it is not clear right above an end: directions, and how many clearances aside.
_DIRECTIONS = 16
_ASIDE = np.array([1.0, 2.0, 4.0, 7.0, 12.0])
# A difference of heights below this needs no path at either of them.
_LEVEL_M = 0.5


def around(
    start_enu_m: Array,
    goal_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float] | None,
    *,
    few_corners: bool = True,
    thorough: bool = True,
) -> Array | None:
    """Return the points of a short path, shape (N, 3); None if there is none.

    The cheapest of paths at other heights, up near the start and down near the goal, and of one
    around all that is in the way between the two heights. If there is none of them, a net of
    paths in the plane and at the heights that promise most is laid, and one of paths at all
    heights has the last word.

    Args:
        start_enu_m: with the clearance.
        goal_enu_m: with the clearance.
        obstacles: all that count.
        clearance_m: that every line of the path keeps.
        heights_m: lowest and highest map z; None stays in the plane of the start.
        few_corners: rather have few corners than the most gentle ones.
        thorough: whether to continue until it is sure that there is no path.
    """
    ends = np.array([start_enu_m, goal_enu_m])
    low, high = sorted((float(start_enu_m[2]), float(goal_enu_m[2])))
    beside = obstacles.between(low - clearance_m, high + clearance_m)
    others = [] if heights_m is None else _other_levels(beside, clearance_m, heights_m, low, high)
    best: Array | None = None
    # Above or below most obstacles there is little to look at, and a path there bounds the rest.
    promising = _promising(others, ends, obstacles, clearance_m)
    for height in promising:
        best = _cheaper(best, _at_level(ends, height, obstacles, clearance_m, _cost_m(best)))
    few, every = sorted({float(start_enu_m[2]), *promising}), sorted({low, high, *others})
    bounds_m = every[0], every[-1]
    no_way_in = partial(is_end_walled_in, ends[1], ends[0], obstacles, clearance_m, bounds_m)
    best = _cheaper(best, _beside(ends, beside, clearance_m, _cost_m(best), no_way_in))
    if best is None and is_walled_in(ends[0], ends[1], obstacles, clearance_m, bounds_m):
        return None
    if best is None:
        last = thorough and every == few
        best = _through_net(ends, few, obstacles, clearance_m, thorough=last)
    if best is None and thorough and every != few:
        best = _through_net(ends, every, obstacles, clearance_m, thorough=True)
    if best is not None and heights_m is not None:
        # Only the ends may be elsewhere, as before a take-off.
        best[1:-1, 2] = np.clip(best[1:-1, 2], *heights_m)
    if best is None or not few_corners:
        return best
    return with_fewer_corners(best, obstacles, clearance_m)


def _through_net(
    ends: Array,
    heights_m: list[float],
    obstacles: Obstacles,
    clearance_m: float,
    *,
    thorough: bool,
) -> Array | None:
    nets = []
    for height in heights_m:
        level = obstacles.between(height - clearance_m, height + clearance_m)
        nets.append(build_net(level, height, ends[:, :2], clearance_m))
    found = shortest_path(nets, ends, obstacles, clearance_m, thorough=thorough)
    return None if found is None else pulled_tight(found, obstacles, clearance_m)


def _promising(
    others_m: list[float], ends: Array, obstacles: Obstacles, clearance_m: float
) -> list[float]:
    """Return the heights of the ends, and those that lead over most obstacles.

    Obstacles seen by a scanner have no known top, but for a column here and there that the scanner
    looked over, and each height costs as much as the search in the plane.
    """
    met = obstacles.hits(ends[:1], ends[1:], clearance_m)[1]
    heights = []
    for height in others_m:
        there = obstacles.are_between(height - clearance_m, height + clearance_m)
        if height in ends[:, 2] or (len(met) and there[met].mean() < _STILL_BLOCKED_SHARE):
            heights.append(height)
    return heights


def _cost_m(path: Array | None) -> float:
    return math.inf if path is None else path_cost_m(path)


def _cheaper(one: Array | None, other: Array | None) -> Array | None:
    return other if other is not None and _cost_m(other) < _cost_m(one) else one


def _beside(
    ends: Array,
    beside: Obstacles,
    clearance_m: float,
    most_m: float,
    is_hopeless: Callable[[], bool],
) -> Array | None:
    """Return a path around all that is between two heights, its height changing evenly."""
    plane = ends * (1.0, 1.0, 0.0)
    path = tangent_path(plane[0], plane[1], beside, clearance_m, most_m, is_hopeless)
    if path is None:
        return None
    lines = np.diff(path, axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(lines[:, 0], lines[:, 1]))])
    path[:, 2] = ends[0, 2] + (ends[1, 2] - ends[0, 2]) * along / max(along[-1], 1e-9)
    path[-1] = ends[1]
    return path


def _at_level(
    ends: Array, height_m: float, obstacles: Obstacles, clearance_m: float, most_m: float
) -> Array | None:
    """Return a path at another height, straight up or down to it near both ends, pulled tight.

    None if there is none, or none that costs less than what is given.
    """
    if _least_cost_m(ends, height_m) >= most_m:
        return None
    columns = [_column(end, height_m, obstacles, clearance_m) for end in ends]
    if columns[0] is None or columns[1] is None:
        return None
    level = obstacles.between(height_m - clearance_m, height_m + clearance_m)
    path = tangent_path(columns[0][1], columns[1][1], level, clearance_m, most_m)
    if path is None:
        return None
    path = np.concatenate([ends[:1], columns[0], path[1:-1], columns[1][::-1], ends[1:]])
    return pulled_tight(path, obstacles, clearance_m)


def _column(end: Array, height_m: float, obstacles: Obstacles, clearance_m: float) -> Array | None:
    """Return the foot and the head of the nearest clear upright line to a height, shape (2, 3)."""
    angle = math.tau * np.arange(_DIRECTIONS) / _DIRECTIONS
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_DIRECTIONS)])
    aside = (clearance_m * _ASIDE[:, None, None] * ring).reshape(-1, 3)
    feet = end + np.concatenate([np.zeros((1, 3)), aside])
    heads = feet * (1.0, 1.0, 0.0) + (0.0, 0.0, height_m)
    clear = np.flatnonzero(obstacles.are_clear(feet, heads, clearance_m))
    for row in clear[:_DIRECTIONS]:
        if obstacles.are_clear(end[None], feet[row][None], clearance_m)[0]:
            return np.stack([feet[row], heads[row]])
    return None


def _least_cost_m(ends: Array, height_m: float) -> float:
    """Return what a path at a height costs at least."""
    east, north, up = ends[1] - ends[0]
    climb = max(abs(height_m - ends[:, 2]).sum() - abs(up), 0.0) + abs(up)
    return math.sqrt(east**2 + north**2 + (CLIMB_COST * climb) ** 2)


def _other_levels(
    beside: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float],
    low_m: float,
    high_m: float,
) -> list[float]:
    """Return the heights of the ends, and those just over or under the obstacles."""
    tops = np.concatenate([beside.posts[:, 4], beside.boxes[:, 6]]) + clearance_m + _OVER_M
    bottoms = np.concatenate([beside.posts[:, 3], beside.boxes[:, 5]]) - clearance_m - _OVER_M
    over = np.unique(tops[(tops <= heights_m[1]) & (tops > low_m)])
    under = np.unique(bottoms[(bottoms >= heights_m[0]) & (bottoms < high_m)])
    ends = [high_m, low_m] if high_m - low_m > _LEVEL_M else []
    return [*reversed(_spread(over, _OVER)), *_spread(under[::-1], _UNDER), *ends]


def _spread(heights: Array, count: int) -> list[float]:
    """Return this many of some heights at most, the last and others at even shares."""
    if len(heights) <= count:
        return [float(height) for height in heights]
    rows = (np.arange(1, count + 1) * len(heights)) // count - 1
    return [float(heights[row]) for row in rows]
