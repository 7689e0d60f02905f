"""Distance of a vehicle from the path that it follows, and the yaw of the path there. No ROS."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from navigation_core.geometry import Vector3

_LEVEL_M = 1e-3


def tracking_errors(
    path_enu_m: Sequence[Vector3], position_enu_m: Vector3
) -> tuple[float, float] | None:
    """Return the horizontal distance from a path, m, positive to its left, and its yaw there, ENU.

    Args:
        path_enu_m: its corners. Climbs and descents have no yaw and are left out.
        position_enu_m: the vehicle's.

    Returns:
        None without a path that leads anywhere.
    """
    nearest: tuple[float, float, float] | None = None
    for start, end in itertools.pairwise(path_enu_m):
        along = (end[0] - start[0], end[1] - start[1])
        length_m = math.hypot(*along)
        if length_m < _LEVEL_M:
            continue
        offset = [p - s for p, s in zip(position_enu_m, start, strict=True)]
        part = (offset[0] * along[0] + offset[1] * along[1]) / length_m**2
        part = min(max(part, 0.0), 1.0)
        steps = (part * along[0], part * along[1], part * (end[2] - start[2]))
        away_m = math.dist(offset, steps)
        if nearest is None or away_m < nearest[0]:
            left_m = (along[0] * offset[1] - along[1] * offset[0]) / length_m
            nearest = away_m, left_m, math.atan2(along[1], along[0])
    return None if nearest is None else nearest[1:]
