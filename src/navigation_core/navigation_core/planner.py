"""A way around obstacles: from one point to another, clear of everything that is known."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from navigation_core.geometry import Vector3, distance
from navigation_core.obstacles import Obstacles

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
    if obstacles.is_clear(start_enu_m, goal_enu_m, limits.clearance_m):
        return Path((start_enu_m, goal_enu_m))
    return NoPath(f"Obstacles are in the way to {goal_enu_m} m.")
