"""The room that a motion keeps to what moves, each at its own time.

A place that something is about to take is free before, and again after it. So a motion is held
against where each moving obstacle is predicted to be at the same moment, at its present velocity.
"""

from __future__ import annotations

import numpy as np

from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["PREDICTED_S", "apart_m", "at_height", "moments_with_room_m", "without_moving"]

# Moving obstacles are predicted for at least this long, even if the vehicle comes to rest before:
# its server may hang. One may turn at any moment, so it is not much longer.
PREDICTED_S = 3.0
# A hit on something is about as high as the rest of it.
_SAME_HEIGHT_M = 2.0
# A map still has what moves where it was a moment ago, and its hits are wider than it is.
_ITS_OWN_M = 1.0
# After this time more is known of one whose velocity is uncertain now.
_UNCERTAIN_S = 2.0


def at_height(moving: tuple[Moving, ...], height_m: float) -> list[Moving]:
    """Return those of moving obstacles that are about as high as a map z."""
    return [one for one in moving if np.ptp([*one.points_enu_m[:, 2], height_m]) < _SAME_HEIGHT_M]


def apart_m(places: Array, in_s: Array, moving: Moving) -> Array:
    """Return how far places are from a moving obstacle in the plane.

    Args:
        places: shape (N, 2), east and north, map frame.
        in_s: shape (N,), when, from when the obstacle was seen last.
        moving: the obstacle.

    Returns:
        Shape (N,).
    """
    points = moving.points_enu_m[:, :2] + in_s[:, None, None] * np.array(moving.velocity_enu_m_s)
    away_m = np.linalg.norm(points - places[:, None], axis=2).min(axis=1)
    nearer_m = moving.uncertain_m_s * np.clip(in_s, 0.0, _UNCERTAIN_S)
    return np.asarray(np.maximum(away_m - nearer_m, 0.0))


def moments_with_room_m(
    in_s: Array,
    places_enu_m: Array,
    moving: tuple[Moving, ...],
    standing: Obstacles,
    enough_m: float,
) -> Array:
    """Return the room of a motion at each of its moments.

    Args:
        in_s: shape (N,), from now on.
        places_enu_m: shape (N, 3), map frame.
        moving: what moves.
        standing: what stands still.
        enough_m: more room than this is not told apart.

    Returns:
        Shape (N,); metres.
    """
    room_m = np.minimum(standing.clearance_m(places_enu_m), enough_m)
    for one in at_height(moving, float(places_enu_m[0, 2])):
        room_m = np.minimum(room_m, apart_m(places_enu_m[:, :2], in_s, one))
    return np.asarray(room_m)


def without_moving(seen: Obstacles, moving: tuple[Moving, ...]) -> Obstacles:
    """Return obstacles without those posts that are of something that moves."""
    if not moving or not len(seen.posts):
        return seen
    hits = np.concatenate([one.points_enu_m[:, :2] for one in moving])
    offsets = seen.posts[:, None, :2] - hits
    stands = ((offsets * offsets).sum(axis=2) > _ITS_OWN_M * _ITS_OWN_M).all(axis=1)
    return seen.chosen(np.concatenate([stands, np.ones(len(seen.boxes), dtype=np.bool_)]))
