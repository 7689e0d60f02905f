"""The speed past corners that hide something.

Behind the end of a wall something may move that no sensor sees yet, and it is seen first when it
steps out. So the vehicle is no faster than it could come to rest within the distance to such a
corner ahead of it. Abreast of a corner it sees behind it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.limits import stopping_speed_m_s

__all__ = ["speed_past_corners_m_s"]

# A corner farther aside than this leaves time to brake when something steps out.
_ASIDE_MAX_M = 4.0


def speed_past_corners_m_s(
    position_enu_m: Vector3,
    velocity_enu_m_s: Vector3,
    corners_enu_m: Sequence[tuple[float, float]],
    reaction_s: float,
    braking_m_s2: float,
) -> float:
    """Return how fast a setpoint may be past the corners ahead of it; infinite without any.

    Args:
        position_enu_m: of the setpoint, map frame.
        velocity_enu_m_s: of the setpoint; its direction counts.
        corners_enu_m: east and north of the ends of what hides something.
        reaction_s: until a brake begins.
        braking_m_s2: deceleration of the brake.
    """
    course = np.array(velocity_enu_m_s[:2])
    speed = float(np.hypot(*course))
    if not len(corners_enu_m) or speed <= 0.0:
        return np.inf
    course /= speed
    offsets = np.array(corners_enu_m) - np.array(position_enu_m[:2])
    ahead_m = offsets @ course
    aside_m = np.abs(offsets[:, 1] * course[0] - offsets[:, 0] * course[1])
    near = (ahead_m > 0.0) & (aside_m < _ASIDE_MAX_M)
    if not near.any():
        return np.inf
    room_m = float(np.hypot(ahead_m[near], aside_m[near]).min())
    return stopping_speed_m_s(room_m, reaction_s, braking_m_s2)
