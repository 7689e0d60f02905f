"""Plans a path around obstacles between two points, with a clearance to all known obstacles."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import partial
from typing import TypeGuard

import numpy as np

from navigation_core.geometry import Vector3, distance
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.clearance_escape import escape_point
from navigation_core.planning.detours import around
from navigation_core.planning.planar_shapes import PlanarShapes
from navigation_core.trajectories.turning_room import drivable_path, has_room_to_turn

__all__ = ["NoPath", "Path", "PlanLimits", "plan"]

_TINY_M = 1e-6


@dataclass(frozen=True)
class PlanLimits:
    """Limits that a path keeps.

    Attributes:
        clearance_m: to every obstacle, measured as in :mod:`~navigation_core.mapping.obstacles`.
        heights_m: lowest and highest map z of a path; None for what drives, whose path stays
            in the plane of its start.
        turning_radius_m: least radius of a turn of what drives; 0 if it can turn on the spot.
        heading_enu_rad: where its nose points at the start, for what cannot turn on the spot.
        thorough: whether the search continues, for several times as long, until it is sure that
            there is no path.
    """

    clearance_m: float
    heights_m: tuple[float, float] | None = None
    turning_radius_m: float = 0.0
    heading_enu_rad: float | None = None
    thorough: bool = True


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
        return math.fsum(distance(a, b) for a, b in itertools.pairwise(self.points_enu_m))


@dataclass(frozen=True)
class NoPath:
    """There is no path, or the search has reached a bound on its work.

    Attributes:
        reason: a sentence with the numbers that matter, which claims no more than is known.
    """

    reason: str


def plan(
    start_enu_m: Vector3, goal_enu_m: Vector3, obstacles: Obstacles, limits: PlanLimits
) -> Path | NoPath:
    """Return a short path that keeps clear of all obstacles.

    The same arguments give the same answer.

    Args:
        start_enu_m: where it begins. When that is nearer to an obstacle than the clearance, the
            path leads out of there first, without coming nearer.
        goal_enu_m: where it ends.
        obstacles: the known obstacles.
        limits: what to keep to.
    """
    clearance_m = limits.clearance_m
    if limits.heights_m is None:
        goal_enu_m = (goal_enu_m[0], goal_enu_m[1], start_enu_m[2])
    reason = _unreachable(goal_enu_m, obstacles, limits)
    if reason is not None:
        return NoPath(reason)
    turns = limits.turning_radius_m > 0.0 and limits.heights_m is None
    if not turns and obstacles.is_clear(start_enu_m, goal_enu_m, clearance_m):
        return Path((start_enu_m, goal_enu_m))
    start, goal = np.array(start_enu_m), np.array(goal_enu_m)
    begin = _beginning(start, goal, obstacles, limits)
    if isinstance(begin, NoPath):
        return begin
    path = around(
        begin[-1], goal, obstacles, clearance_m, limits.heights_m, thorough=limits.thorough
    )
    if not _is_clear(path, obstacles, clearance_m):
        return NoPath(
            f"No path to {_point_text(goal_enu_m)} was found that keeps {clearance_m:.2f} m clear "
            f"of all {len(obstacles)} obstacles: the target may be enclosed, or every gap narrower "
            f"than {2.0 * clearance_m:.2f} m."
        )
    if turns:
        heading_rad = limits.heading_enu_rad if len(begin) == 1 else None
        path = _driven(path, heading_rad, obstacles, limits)
        if not _is_clear(path, obstacles, clearance_m):
            return NoPath(
                f"There are paths to {_point_text(goal_enu_m)}, but none leaves room to turn with "
                f"a radius of {limits.turning_radius_m:.2f} m."
            )
    corners = np.concatenate([begin[:-1], path])[1:-1]
    points = [(float(p[0]), float(p[1]), float(p[2])) for p in corners]
    return Path((start_enu_m, *points, goal_enu_m))


def _is_clear(path: Array | None, obstacles: Obstacles, clearance_m: float) -> TypeGuard[Array]:
    """Whether there is a path, and each of its lines is clear: the last word, whoever found it."""
    return path is not None and bool(obstacles.are_clear(path[:-1], path[1:], clearance_m).all())


def _beginning(
    start: Array, goal: Array, obstacles: Obstacles, limits: PlanLimits
) -> Array | NoPath:
    """Return the start, and what leads out from too near to an obstacle, shape (1 or 2, 3)."""
    has_m = float(obstacles.clearance_m(start[None])[0])
    if has_m >= limits.clearance_m:
        return start[None]
    out = escape_point(start, goal, obstacles, limits.clearance_m, limits.heights_m)
    if out is None:
        return NoPath(
            f"The start is {has_m:.2f} m from an obstacle and no straight line leads out to "
            f"the clearance of {limits.clearance_m:.2f} m without coming nearer."
        )
    return np.array([start, out])


def _driven(
    path: Array, heading_rad: float | None, obstacles: Obstacles, limits: PlanLimits
) -> Array | None:
    """Return a path that turns no tighter than allowed, as near to a shortest path as there is.

    About an outline with a clearance of at least the radius there is always room to turn, so a
    path with that clearance is the next best.
    """
    radius_m = limits.turning_radius_m
    wide_m = max(limits.clearance_m, radius_m)
    for clearance_m, few_corners in ((limits.clearance_m, True), (wide_m, False)):
        path_from = partial(
            _path_in_plane, path[-1], obstacles, clearance_m, few_corners=few_corners
        )
        found = path if few_corners else path_from(path[0])
        if found is not None and heading_rad is not None:
            found = drivable_path(
                found, heading_rad, path_from, obstacles, limits.clearance_m, radius_m
            )
        if found is not None and has_room_to_turn(found, obstacles, limits.clearance_m, radius_m):
            return found
    return None


def _path_in_plane(
    goal: Array, obstacles: Obstacles, clearance_m: float, place: Array, *, few_corners: bool
) -> Array | None:
    return around(place, goal, obstacles, clearance_m, None, few_corners=few_corners)


def _unreachable(goal_enu_m: Vector3, obstacles: Obstacles, limits: PlanLimits) -> str | None:
    """Return why nothing may be at the goal, if so."""
    if limits.heights_m is not None:
        low, high = limits.heights_m
        if not low <= goal_enu_m[2] <= high:
            return (
                f"The goal is at a height of {goal_enu_m[2]:.2f} m, outside {low:.2f} to "
                f"{high:.2f} m."
            )
    has_m = float(obstacles.clearance_m(np.array([goal_enu_m]))[0])
    if has_m >= limits.clearance_m:
        return None
    if has_m <= 0.0:
        level = obstacles.between(goal_enu_m[2] - _TINY_M, goal_enu_m[2] + _TINY_M)
        depth_m = PlanarShapes(level).depth_m(np.array(goal_enu_m[:2]))
        return f"The goal {_point_text(goal_enu_m)} is inside an obstacle, by {depth_m:.2f} m."
    return (
        f"The goal {_point_text(goal_enu_m)} is {has_m:.2f} m from an obstacle; "
        f"the required clearance is {limits.clearance_m:.2f} m."
    )


def _point_text(point: Vector3) -> str:
    return f"({point[0]:.1f}, {point[1]:.1f}, {point[2]:.1f}) m"
