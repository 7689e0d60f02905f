"""A way around obstacles: from one point to another, clear of everything that is known."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from navigation_core.around import around
from navigation_core.geometry import Vector3, distance
from navigation_core.leading_out import way_out
from navigation_core.obstacles import Array, Obstacles

__all__ = ["NoPath", "Path", "PlanLimits", "plan"]


@dataclass(frozen=True)
class PlanLimits:
    """What a path keeps to.

    Attributes:
        clearance_m: to every obstacle, measured as in :mod:`~navigation_core.obstacles`.
        heights_m: lowest and highest map z of a path; None for what drives, whose path stays
            in the plane of its start.
        turning_radius_m: least radius of a turn of what drives; 0 if it can turn on the spot.
        heading_enu_rad: where its nose points at the start, for what cannot turn on the spot.
    """

    clearance_m: float
    heights_m: tuple[float, float] | None = None
    turning_radius_m: float = 0.0
    heading_enu_rad: float | None = None


@dataclass(frozen=True)
class Path:
    """Straight lines, one after the other, that keep the clearance.

    Attributes:
        points_enu_m: at least two: the start, the corners, the goal.
    """

    points_enu_m: tuple[Vector3, ...]

    @property
    def length_m(self) -> float:
        """Length of all lines."""
        return sum(distance(a, b) for a, b in itertools.pairwise(self.points_enu_m))


@dataclass(frozen=True)
class NoPath:
    """There is no way.

    Attributes:
        reason: a sentence with the numbers that matter.
    """

    reason: str


def plan(
    start_enu_m: Vector3, goal_enu_m: Vector3, obstacles: Obstacles, limits: PlanLimits
) -> Path | NoPath:
    """Return a short way that keeps clear of all obstacles.

    The same arguments give the same answer.

    Args:
        start_enu_m: where it begins. When that is nearer to an obstacle than the clearance, the
            way leads out of there first, without coming nearer.
        goal_enu_m: where it ends.
        obstacles: what is in the way.
        limits: what to keep to.
    """
    clearance_m = limits.clearance_m
    if limits.heights_m is None:
        goal_enu_m = (goal_enu_m[0], goal_enu_m[1], start_enu_m[2])
    reason = _unreachable(goal_enu_m, obstacles, limits)
    if reason is not None:
        return NoPath(reason)
    if obstacles.is_clear(start_enu_m, goal_enu_m, clearance_m):
        return Path((start_enu_m, goal_enu_m))
    lead_in: list[Array] = []
    start, goal = np.array(start_enu_m), np.array(goal_enu_m)
    has_m = float(obstacles.clearance_m(start[None])[0])
    if has_m < clearance_m:
        lead_in = [start]
        out = way_out(start, goal, obstacles, clearance_m, limits.heights_m)
        if out is None:
            return NoPath(
                f"The start is {has_m:.2f} m from an obstacle and no straight line leads out to "
                f"the clearance of {clearance_m:.2f} m without coming nearer."
            )
        start = out
    way = around(start, goal, obstacles, clearance_m, limits.heights_m)
    if way is None:
        return NoPath(
            f"No way to {_told(goal_enu_m)} keeps {clearance_m:.2f} m clear of all "
            f"{len(obstacles)} obstacles: it is walled in, or every gap is narrower than "
            f"{2.0 * clearance_m:.2f} m."
        )
    corners = [*lead_in, *way][1:-1]
    points = [(float(p[0]), float(p[1]), float(p[2])) for p in corners]
    return Path((start_enu_m, *points, goal_enu_m))


def _unreachable(goal_enu_m: Vector3, obstacles: Obstacles, limits: PlanLimits) -> str | None:
    """Return why nothing may be at the goal, if so."""
    if limits.heights_m is not None:
        low, high = limits.heights_m
        if not low <= goal_enu_m[2] <= high:
            return (
                f"The goal is at a height of {goal_enu_m[2]:.2f} m, outside of {low:.2f} to "
                f"{high:.2f} m."
            )
    has_m = float(obstacles.clearance_m(np.array([goal_enu_m]))[0])
    if has_m >= limits.clearance_m:
        return None
    if has_m <= 0.0:
        return f"The goal {_told(goal_enu_m)} is inside of an obstacle."
    return (
        f"The goal {_told(goal_enu_m)} is {has_m:.2f} m from an obstacle; "
        f"{limits.clearance_m:.2f} m are to be kept."
    )


def _told(point: Vector3) -> str:
    return f"({point[0]:.1f}, {point[1]:.1f}, {point[2]:.1f}) m"
