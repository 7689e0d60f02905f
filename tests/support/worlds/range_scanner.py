"""A range sensor in a world of known obstacles, for tests of what is made of its readings."""

from __future__ import annotations

import math

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_map import RayScan
from navigation_core.mapping.obstacles import Array, Obstacles

_HIT_M = 1e-3
_STEPS = 200


def ranges_m(world: Obstacles, origin: Vector3, directions: Array, reach_m: float) -> Array:
    """Return how far rays go, infinity beyond the reach.

    A clearance is never more than the true distance, so a step of one never goes too far.
    """
    if not len(world):
        return np.full(len(directions), np.inf)
    away = np.zeros(len(directions))
    going = np.arange(len(directions))
    for _ in range(_STEPS):
        gap = world.clearance_m(np.array(origin) + away[going, None] * directions[going])
        away[going] += np.where(gap > _HIT_M, gap, 0.0)
        going = going[(gap > _HIT_M) & (away[going] <= reach_m)]
        if not len(going):
            break
    return np.where(away <= reach_m, away, np.inf)


def level_ring(beams: int, yaw_rad: float = 0.0) -> Array:
    """Return directions all around, the first along the yaw."""
    bearing = yaw_rad + np.arange(beams) * math.tau / beams
    return np.stack([np.cos(bearing), np.sin(bearing), np.zeros(beams)], axis=1)


def pitched(directions: Array, nose_up_rad: float) -> Array:
    """Return directions turned about the north axis, so that what points east rises."""
    east, up = directions[:, 0], directions[:, 2]
    cosine, sine = math.cos(nose_up_rad), math.sin(nose_up_rad)
    turned = [east * cosine - up * sine, directions[:, 1], up * cosine + east * sine]
    return np.stack(turned, axis=1)


def sectors(
    world: Obstacles,
    origin: Vector3,
    yaw_rad: float = 0.0,
    *,
    beams: int = 72,
    reach_m: float = 40.0,
    nose_up_rad: float = 0.0,
) -> RayScan:
    """Return a scan of sectors that touch, each with the range of the nearest thing in it."""
    half = math.pi / beams
    # Nine rays in each of 72 sectors are 0.2 m apart at 20 m.
    asides = np.linspace(-half, half, 9)
    rays = [pitched(level_ring(beams, yaw_rad + float(a)), nose_up_rad) for a in asides]
    ranges = ranges_m(world, origin, np.concatenate(rays), reach_m)
    nearest = ranges.reshape(len(asides), beams).min(axis=0)
    directions = pitched(level_ring(beams, yaw_rad), nose_up_rad)
    return RayScan(origin, directions, nearest, 0.2, reach_m, half)
