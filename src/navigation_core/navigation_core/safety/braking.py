"""The last layer of safety: stops before an obstacle, independent of the planned path.

It knows nothing of paths. From where the vehicle is measured to be and how it moves follows the
straight line that it cannot but travel: the reaction time, and then the braking path. When
that line comes too near to an obstacle, it is time to stop.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.conflicts import MotionSamples, lines_clear

# Slower than this is standing: there is no direction to stop in.
STANDING_M_S = 0.2
# Points at which a line that leads away from an obstacle is looked at, and by how much it may
# come nearer nevertheless.
_LINE_POINTS = 5
_NEARER_MAX_M = 0.05


def stopping_ends(motion: MotionSamples, limits: Limits, reaction_s: float) -> Array:
    """Return where a vehicle comes to rest that brakes at these moments.

    The acceleration along the path is taken away first, at the jerk of the limits; then the
    speed is, by a deceleration that is built up and taken away at that jerk.

    Args:
        motion: the moments.
        limits: what the brake keeps to.
        reaction_s: time before it begins.

    Returns:
        Shape (N, 3), the ends of straight lines in the map frame.
    """
    velocities, jerk = motion.velocities_enu_m_s, limits.jerk_m_s3
    speed = np.linalg.norm(velocities, axis=1)
    course = velocities / np.maximum(speed, 1e-9)[:, None]
    limit = deceleration_along_m_s2(course, limits)
    ahead = np.clip((motion.accelerations_enu_m_s2 * course).sum(axis=1), 0.0, limit)
    fade_s = ahead / jerk
    stopping_m = speed * (reaction_s + fade_s) + ahead * fade_s * fade_s / 3.0
    speed = speed + 0.5 * ahead * fade_s
    full = speed * speed / (2.0 * limit) + speed * limit / (2.0 * jerk)
    short = speed * np.sqrt(speed / jerk)
    stopping_m = stopping_m + np.where(speed >= limit * limit / jerk, full, short)
    return np.asarray(motion.positions_enu_m + course * stopping_m[:, None])


def must_brake(
    motion: MotionSamples,
    obstacles: Obstacles,
    limits: Limits,
    clearance_m: float,
    reaction_s: float,
) -> NDArray[np.bool_]:
    """Return whether a vehicle must stop at these moments.

    One that is nearer to an obstacle than the clearance, and moves away from it, need not.

    Args:
        motion: the moments.
        obstacles: the known obstacles.
        limits: what a brake keeps to.
        clearance_m: that is to be kept.
        reaction_s: time before a brake begins.

    Returns:
        Shape (N,).
    """
    places = motion.positions_enu_m
    acts = np.linalg.norm(motion.velocities_enu_m_s, axis=1) >= STANDING_M_S
    if len(obstacles):
        ends = stopping_ends(motion, limits, reaction_s)
        acts &= ~lines_clear(places, ends, obstacles, clearance_m)
        for i in np.flatnonzero(acts):
            acts[i] = not leads_away(places[i], ends[i], obstacles, clearance_m)
        return np.asarray(acts, dtype=np.bool_)
    return np.zeros(len(acts), dtype=np.bool_)


def deceleration_along_m_s2(course: Array, limits: Limits) -> Array:
    """Return the greatest deceleration along unit vectors (N, 3), as :meth:`Limits.along`."""
    level = np.maximum(np.hypot(course[:, 0], course[:, 1]), 1e-9)
    rise = np.maximum(np.abs(course[:, 2]), 1e-9)
    return np.asarray(
        np.minimum(
            limits.acceleration_horizontal_m_s2 / level, limits.acceleration_vertical_m_s2 / rise
        )
    )


def leads_away(start: Array, end: Array, obstacles: Obstacles, clearance_m: float) -> bool:
    """Whether a line that begins nearer than a clearance comes no nearer."""
    points = start + np.linspace(0.0, 1.0, _LINE_POINTS)[:, None] * (end - start)
    clearances_m = obstacles.clearance_m(points)
    return bool(
        clearances_m[0] < clearance_m and (clearances_m >= clearances_m[0] - _NEARER_MAX_M).all()
    )
