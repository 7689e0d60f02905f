"""Finds the part of a line of points that is too close to an obstacle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.trajectories.trajectory import Trajectory

# Between two samples of a trajectory its chord is off by a centimetre at 2 m/s^2.
_SAMPLE_S = 0.2
# Number of consecutive lines that are compared together with the obstacles near them.
_LINES_TOGETHER = 24
# A vehicle that is too near to an obstacle may get this much nearer while it leaves: sensor noise.
_NEARER_MAX_M = 0.05


@dataclass(frozen=True)
class MotionSamples:
    """Moments of a motion as arrays, to be checked against obstacles.

    Attributes:
        times_s: shape (N,), trajectory time.
        positions_enu_m: shape (N, 3), map frame.
        velocities_enu_m_s: shape (N, 3).
        accelerations_enu_m_s2: shape (N, 3).
    """

    times_s: Array
    positions_enu_m: Array
    velocities_enu_m_s: Array
    accelerations_enu_m_s2: Array

    @classmethod
    def of(cls, trajectory: Trajectory) -> MotionSamples:
        """Sample a whole trajectory."""
        count = max(int(np.ceil(trajectory.duration_s / _SAMPLE_S)), 1) + 1
        times_s = np.linspace(0.0, trajectory.duration_s, count)
        return cls(times_s, *trajectory.samples(times_s))

    @classmethod
    def at(cls, state: KinematicState) -> MotionSamples:
        """Return one state alone."""
        position, velocity = state.position_enu_m, state.velocity_enu_m_s
        acceleration = state.acceleration_enu_m_s2
        return cls(
            np.zeros(1), np.array([position]), np.array([velocity]), np.array([acceleration])
        )

    def ahead(self, time_s: float, position_enu_m: Vector3) -> Array:
        """Return the positions that are left at a time, from the one at that time on."""
        rest = self.positions_enu_m[np.searchsorted(self.times_s, time_s, side="right") :]
        return np.concatenate([[position_enu_m], rest])


def first_conflict(points_enu_m: Array, obstacles: Obstacles, clearance_m: float) -> int | None:
    """Return where a line of points first comes nearer to an obstacle than a clearance.

    A line that begins too near may lead out of there, as long as it comes no nearer.

    Args:
        points_enu_m: shape (N, 3), map frame.
        obstacles: the known obstacles.
        clearance_m: that is to be kept.

    Returns:
        Index of the point at the end of the first line in conflict; None if there is none.
    """
    if not len(obstacles) or not len(points_enu_m):
        return None
    begin = _escape_index(points_enu_m, obstacles, clearance_m)
    if begin < 0:
        return -begin - 1
    for i in range(begin, len(points_enu_m) - 1, _LINES_TOGETHER):
        part = points_enu_m[i : i + _LINES_TOGETHER + 1]
        clear = lines_clear(part[:-1], part[1:], obstacles, clearance_m)
        if not clear.all():
            return i + 1 + int(np.argmin(clear))
    return None


def lines_clear(
    starts_enu_m: Array, ends_enu_m: Array, obstacles: Obstacles, clearance_m: float
) -> NDArray[np.bool_]:
    """Return whether lines keep a clearance, looking only at obstacles near all of them."""
    both = np.concatenate([starts_enu_m, ends_enu_m])
    near = obstacles.near(_vector(both.min(axis=0)), _vector(both.max(axis=0)), clearance_m)
    if not len(near):
        return np.ones(len(starts_enu_m), dtype=np.bool_)
    return near.are_clear(starts_enu_m, ends_enu_m, clearance_m)


def clearance_at_m(position_enu_m: Vector3, obstacles: Obstacles, within_m: float) -> float:
    """Return how near the nearest obstacle is; infinity if none is within a distance."""
    near = obstacles.near(position_enu_m, position_enu_m, within_m)
    clearance_m = float(near.clearance_m(np.array([position_enu_m]))[0])
    return clearance_m if clearance_m <= within_m else float("inf")


def _escape_index(points: Array, obstacles: Obstacles, clearance_m: float) -> int:
    """Return the index from which on the clearance is to be kept; below 0: -1 - conflict."""
    nearest_m = clearance_at_m(_vector(points[0]), obstacles, clearance_m)
    if nearest_m >= clearance_m:
        return 0
    for i in range(1, len(points)):
        here_m = clearance_at_m(_vector(points[i]), obstacles, clearance_m)
        if here_m >= clearance_m:
            return i
        if here_m < nearest_m - _NEARER_MAX_M:
            return -1 - i
        nearest_m = max(nearest_m, here_m)
    return -len(points)


def _vector(point: Array) -> Vector3:
    return (float(point[0]), float(point[1]), float(point[2]))
