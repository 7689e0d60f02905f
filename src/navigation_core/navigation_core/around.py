"""The way around obstacles between two points that are clear of them."""

from __future__ import annotations

import itertools

import numpy as np

from navigation_core.obstacles import Array, Obstacles
from navigation_core.roadmap import build_net
from navigation_core.shortcuts import pulled_tight
from navigation_core.ways import shortest_way

__all__ = ["around"]

# Levels at which a net of ways is laid, at most: each takes up to a quarter of the time.
_LEVELS_MAX = 4
_OVER_M = 0.01


def around(
    start_enu_m: Array,
    goal_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float] | None,
) -> Array | None:
    """Return the points of a short way, shape (N, 3); None if there is none.

    Args:
        start_enu_m: with the clearance.
        goal_enu_m: with the clearance.
        obstacles: all that count.
        clearance_m: that every line of the way keeps.
        heights_m: lowest and highest map z; None stays in the plane of the start.
    """
    nets = []
    ends = np.array([start_enu_m, goal_enu_m])
    for height in levels(start_enu_m, goal_enu_m, obstacles, clearance_m, heights_m):
        level = obstacles.between(height - clearance_m, height + clearance_m)
        nets.append(build_net(level, height, ends[:, :2], clearance_m))
    way = shortest_way(nets, ends, obstacles, clearance_m)
    return None if way is None else pulled_tight(way, obstacles, clearance_m)


def levels(
    start_enu_m: Array,
    goal_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float] | None,
) -> list[float]:
    """Return the heights at which to look for a way, sorted.

    They are the heights of both ends, and those just over the tops or under the bottoms of what
    is in the way. Where the same obstacles are in the way at two heights, one of them is enough.
    """
    begin, end = float(start_enu_m[2]), float(goal_enu_m[2])
    if heights_m is None:
        return [begin]
    low, high = heights_m
    beside = obstacles.between(min(begin, end) - clearance_m, max(begin, end) + clearance_m)
    tops = np.concatenate([beside.posts[:, 4], beside.boxes[:, 6]]) + clearance_m + _OVER_M
    bottoms = np.concatenate([beside.posts[:, 3], beside.boxes[:, 5]]) - clearance_m - _OVER_M
    over = _picked(tops[(tops <= high) & (tops > min(begin, end))])
    under = _picked(-bottoms[(bottoms >= low) & (bottoms < max(begin, end))])
    wanted = [min(max(begin, low), high), end, *over, *(-height for height in under)]
    chosen: dict[tuple[bytes, bytes], float] = {}
    for height in wanted:
        level = obstacles.between(height - clearance_m, height + clearance_m)
        chosen.setdefault((level.posts.tobytes(), level.boxes.tobytes()), height)
    return sorted(itertools.islice(chosen.values(), _LEVELS_MAX))


def _picked(heights: Array) -> list[float]:
    """Return the highest and a middle one."""
    if not len(heights):
        return []
    ordered = np.sort(heights)
    return [float(ordered[-1]), float(ordered[len(ordered) // 2])]
