"""Obstacle checks of a goal before it starts. No ROS."""

from __future__ import annotations

import itertools
import math

import numpy as np

from navigation_bridge.snapshot import Snapshot
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import KnownObstacle, Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig

__all__ = ["avoidance_of", "check_obstacles", "obstacle_on_line"]

_NO_SENSOR = "No obstacle sensor reports; only the known obstacles are avoided."
_MISSION = "The autopilot flies the mission itself; obstacles are not avoided."
_PLANE = "A plane is guided by its own autopilot; obstacles are not avoided."
_STRAIGHT = "Obstacles are not avoided, and straight legs"
_ROUNDING_M = 0.01
_NAMED_MAX = 4


def check_obstacles(
    targets_enu_m: tuple[Vector3, ...], avoid: bool, by_mission: bool, snapshot: Snapshot
) -> tuple[str, ...] | Rejection:
    """Return the warnings about obstacles for a goal, or a rejection.

    Sensed obstacles may have moved by the time the vehicle arrives, so only known obstacles reject
    a target.

    Args:
        targets_enu_m: its targets in the map frame.
        avoid: whether obstacles are to be avoided.
        by_mission: whether the autopilot flies it as a mission.
        snapshot: what is known.
    """
    known = snapshot.known_obstacles
    led_by_autopilot = by_mission or not snapshot.traits.hovers
    if avoid and not led_by_autopilot:
        rejection = _check_targets(targets_enu_m, known, snapshot)
        if rejection is not None:
            return rejection
        return () if snapshot.has_sensor else (_NO_SENSOR,)
    notes = (_PLANE if not snapshot.traits.hovers else _MISSION,) if avoid else ()
    return notes + _straight(targets_enu_m, known, snapshot)


def _check_targets(
    targets_enu_m: tuple[Vector3, ...], known: tuple[KnownObstacle, ...], snapshot: Snapshot
) -> Rejection | None:
    config = snapshot.config.obstacles
    kept_m = config.vehicle_radius_m + config.margin_m
    for target, obstacle in itertools.product(targets_enu_m, known):
        (away_m,) = Obstacles.of((obstacle,)).clearance_m(np.array([_level(target, snapshot)]))
        if away_m < kept_m:
            where = "inside" if away_m <= 0.0 else f"{away_m:.2f} m from"
            return Rejection(
                OutcomeCode.NO_PATH,
                f"The target {_point_text(target)} is {where} the known obstacle "
                f"{_named(obstacle)}; the required clearance is {kept_m:.2f} m "
                "(vehicle_radius_m + obstacle_margin_m).",
            )
    return None


def obstacle_on_line(
    line_enu_m: tuple[Vector3, ...], avoid: bool, snapshot: Snapshot
) -> Rejection | None:
    """Return which known obstacle stands on a line that a goal is about, and where, or None.

    Args:
        line_enu_m: its corners in the map frame.
        avoid: whether a clearance is to be kept; otherwise nothing is to be hit.
        snapshot: what is known.
    """
    config = snapshot.config.obstacles
    kept_m = config.vehicle_radius_m + (config.margin_m if avoid else 0.0)
    words = "vehicle_radius_m + obstacle_margin_m" if avoid else "vehicle_radius_m"
    for start, end in itertools.pairwise(line_enu_m):
        leg = _level(start, snapshot), _level(end, snapshot)
        for obstacle in snapshot.known_obstacles:
            if not Obstacles.of((obstacle,)).is_clear(*leg, kept_m):
                return Rejection(
                    OutcomeCode.NO_PATH,
                    f"The known obstacle {_named(obstacle)} is nearer to the circle than "
                    f"{kept_m:.2f} m ({words}), at {_point_text(end)}.",
                )
    return None


def _straight(
    targets_enu_m: tuple[Vector3, ...], known: tuple[KnownObstacle, ...], snapshot: Snapshot
) -> tuple[str, ...]:
    """Return sentences about the obstacles on the straight legs, or too near to them, if any."""
    sensed = snapshot.sensed_obstacles
    if snapshot.pose is None or not targets_enu_m or not (known or len(sensed)):
        return ()
    x, y, z = snapshot.pose.position_enu_m
    if snapshot.traits.flies and not snapshot.flies:
        # It climbs vertically, at least to the take-off height.
        highest_m = snapshot.ground_enu_m + snapshot.config.goto.takeoff_height_m
        z = max(z, min(highest_m, targets_enu_m[0][2]))
    config = snapshot.config.obstacles
    hull_m, kept_m = config.vehicle_radius_m, config.vehicle_radius_m + config.margin_m
    hit: dict[str, list[str]] = {}
    seen: dict[str, list[str]] = {}
    near: dict[str, list[str]] = {}
    for start, end in dict.fromkeys(itertools.pairwise([(x, y, z), *targets_enu_m])):
        leg = _level(start, snapshot), _level(end, snapshot)
        for obstacle in known:
            rows = Obstacles.of((obstacle,))
            if not rows.is_clear(*leg, hull_m):
                hit.setdefault(_named(obstacle), []).append(_point_text(end))
            elif not rows.is_clear(*leg, kept_m):
                near.setdefault(_named(obstacle), []).append(_point_text(end))
        # A sensor sees hundreds of cells: the first of them is named.
        if (cell := _first_on(leg, sensed, hull_m)) is not None:
            seen.setdefault(f"at {cell}", []).append(_point_text(end))
    kept = f"{kept_m:.2f} m (vehicle_radius_m + obstacle_margin_m)"
    kinds = (
        ("hit known ones", hit),
        ("hit sensed ones", seen),
        (f"pass nearer than {kept} to", near),
    )
    return tuple(f"{_STRAIGHT} {words}: {_on(found)}." for words, found in kinds if found)


def _first_on(leg: tuple[Vector3, Vector3], sensed: Obstacles, clearance_m: float) -> str | None:
    """Return the place of the first sensed obstacle that a leg meets, or None."""
    start, end = np.array(leg[0]), np.array(leg[1])
    _, rows = sensed.hits(start[None], end[None], clearance_m)
    if not len(rows):
        return None
    # All that is sensed are posts.
    cells = sensed.posts[rows, :2]
    east, north = cells[np.argmin(((cells - start[:2]) ** 2).sum(axis=1))]
    return f"({east:.1f}, {north:.1f}) m"


def _on(found: dict[str, list[str]]) -> str:
    named = [
        f"{name} on the path to {_listed(list(dict.fromkeys(ends)))}"
        for name, ends in found.items()
    ]
    return _listed(named)


def _listed(words: list[str]) -> str:
    """Return the first few names, and the number of the others."""
    left = len(words) - _NAMED_MAX
    return ", ".join(words[:_NAMED_MAX]) + (f" and {left} more" if left > 0 else "")


def _level(point: Vector3, snapshot: Snapshot) -> Vector3:
    """Return a point at the height of known obstacles for this vehicle."""
    return point if snapshot.traits.flies else (point[0], point[1], 0.0)


def avoidance_of(avoid: bool, snapshot: Snapshot) -> AvoidanceConfig | None:
    """Return the obstacle avoidance of a task that flies by setpoints.

    Args:
        avoid: whether obstacles are to be avoided; if not, None is returned.
        snapshot: what is known.
    """
    if not avoid:
        return None
    config = snapshot.config.obstacles
    return AvoidanceConfig(
        vehicle_radius_m=config.vehicle_radius_m,
        margin_m=config.margin_m,
        blocked_timeout_s=config.blocked_timeout_s,
        sensor_timeout_s=config.sensor_timeout_s,
        heights_m=_heights_m(snapshot),
        searcher=snapshot.searcher,
    )


def _heights_m(snapshot: Snapshot) -> tuple[float, float] | None:
    """Return the lowest and highest map z of paths; None for rovers and boats."""
    if not snapshot.traits.flies:
        return None
    config, ground_m, fence = (
        snapshot.config,
        snapshot.ground_enu_m,
        snapshot.own_fence,
    )
    low_m, high_m = config.volume.altitude_min_m, config.volume.altitude_max_m
    if fence is not None:
        margin_m = config.safety.fence_margin_m
        home_m = snapshot.home_z_enu_m - ground_m
        if fence.altitude_min_m is not None:
            low_m = max(low_m, home_m + fence.altitude_min_m + margin_m)
        if fence.altitude_max_m is not None:
            high_m = min(high_m, home_m + fence.altitude_max_m - margin_m)
    low_m, high_m = low_m - _ROUNDING_M, max(high_m, low_m) + _ROUNDING_M
    return ground_m + low_m, ground_m + high_m


def _named(obstacle: KnownObstacle) -> str:
    x, y = obstacle.centre_enu_m
    top = "" if math.isinf(obstacle.top_m) else f", {obstacle.top_m:.1f} m high"
    return f"'{obstacle.name}' at ({x:.1f}, {y:.1f}) m{top}"


def _point_text(point: Vector3) -> str:
    return f"({point[0]:.1f}, {point[1]:.1f}, {point[2]:.1f}) m"
