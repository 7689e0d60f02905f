"""Whether there is a path among the true posts of a scenario, however it may be found."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tests.explore.scenario import Post

_CELL_M, _BEYOND_M = 0.5, 25.0


def has_passage(
    posts: Sequence[Post], start: Sequence[float], goal: Sequence[float], clearance_m: float
) -> bool:
    """Return whether a level path leads from a place to another that far from all posts.

    Args:
        posts: none is flown over.
        start: east and north, m.
        goal: the same.
        clearance_m: to the middle of the vehicle.
    """
    ends = np.array([start[:2], goal[:2]])
    low = ends.min(axis=0) - _BEYOND_M
    size = np.ceil((ends.max(axis=0) + _BEYOND_M - low) / _CELL_M).astype(int)
    east, north = (low[i] + _CELL_M * (np.arange(size[i]) + 0.5) for i in (0, 1))
    free = np.ones((size[0], size[1]), dtype=bool)
    for post in posts:
        x, y = post.at_enu_m
        away_m = np.hypot(east[:, None] - x, north[None, :] - y)
        free &= away_m > post.radius_m + clearance_m
    first, last = (tuple(((end - low) / _CELL_M).astype(int)) for end in ends)
    reached = np.zeros_like(free)
    reached[first] = free[first]
    for _ in range(math.prod(free.shape)):
        grown = reached.copy()
        grown[1:] |= reached[:-1]
        grown[:-1] |= reached[1:]
        grown[:, 1:] |= reached[:, :-1]
        grown[:, :-1] |= reached[:, 1:]
        grown &= free
        if grown[last] or np.array_equal(grown, reached):
            return bool(grown[last])
        reached = grown
    return False
