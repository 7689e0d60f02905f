"""The shortest path around few obstacles, searched only among those that it meets.

The shortest path in the plane is made of lines that touch the outlines they go round. So begin
with the straight line; where the shortest path found yet hits an obstacle, add that, and
look for the shortest path around all that were added. A path that hits nothing any more is
the shortest there is: an obstacle that was never added could only have made it longer.

Outlines are taken as polygons about them, which makes a path longer by up to 2 % of its bends.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_kernels import LOOKS_MAX, SearchEnd
from navigation_kernels import tangent_path as searched

__all__ = ["tangent_path"]

# Most searches take fewer looks; before others it is worth a proof that there is a path at all.
_LOOKS_FEW = 500_000


def tangent_path(
    start_enu_m: Array,
    goal_enu_m: Array,
    level: Obstacles,
    clearance_m: float,
    longest_m: float = math.inf,
    is_hopeless: Callable[[], bool] = lambda: False,
) -> Array | None:
    """Return the points of the shortest path in the plane of the start, shape (N, 3).

    Args:
        start_enu_m: clear of all obstacles.
        goal_enu_m: clear of all obstacles, at the same height.
        level: the obstacles at this height, taken as endless.
        clearance_m: that every line of the path keeps.
        longest_m: no path of this length or more is wanted.
        is_hopeless: asked once, when it takes longer, whether there is surely no path.

    Returns:
        None if there is none along outlines, or if the bound on the work was reached before.
    """
    plane = start_enu_m[:2], goal_enu_m[:2]
    for looks_max in (_LOOKS_FEW, LOOKS_MAX):
        answer, points, _ = searched(
            level.posts, level.boxes, *plane, clearance_m, longest_m, looks_max
        )
        if answer is SearchEnd.FOUND:
            return np.column_stack([points, np.full(len(points), start_enu_m[2])])
        if answer is SearchEnd.NONE or is_hopeless():
            return None
    return None
