"""The path out of the clearance of an obstacle, for a vehicle that is too close."""

from __future__ import annotations

import math

import numpy as np

from navigation_core.mapping.obstacles import Array, Obstacles

__all__ = ["escape_point"]

_DIRECTIONS = 32
# How far it may be out, as multiples of what is missing.
_REACHES = np.array([1.01, 1.1, 1.25, 1.5, 2.0, 3.0, 4.5, 7.0, 12.0, 20.0])
# Rounding in the reckoning of a clearance.
_TINY_M = 1e-6


def escape_point(
    start_enu_m: Array,
    goal_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    heights_m: tuple[float, float] | None,
) -> Array | None:
    """Return where a straight line first has the clearance that never comes nearer before.

    Args:
        start_enu_m: nearer to an obstacle than the clearance, or inside of one.
        goal_enu_m: of several places as near, the one nearer to it is taken.
        obstacles: all that count.
        clearance_m: to be reached.
        heights_m: lowest and highest map z; None stays in the plane.
    """
    has_m = float(obstacles.clearance_m(start_enu_m[None])[0])
    angle = math.tau * np.arange(_DIRECTIONS) / _DIRECTIONS
    directions = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_DIRECTIONS)])
    if heights_m is not None:
        directions = np.concatenate([directions, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
    reaches = (clearance_m - has_m) * _REACHES
    places = start_enu_m + (reaches[:, None, None] * directions).reshape(-1, 3)
    sound = obstacles.clearance_m(places) >= clearance_m
    if heights_m is not None:
        sound &= (places[:, 2] >= heights_m[0]) & (places[:, 2] <= heights_m[1])
    starts = np.broadcast_to(start_enu_m, places.shape)
    sound[sound] = obstacles.are_clear(starts[sound], places[sound], has_m - _TINY_M)
    if not sound.any():
        return None
    far = np.repeat(reaches, len(directions)) + 0.2 * np.linalg.norm(places - goal_enu_m, axis=1)
    return np.asarray(places[np.where(sound, far, np.inf).argmin()])
