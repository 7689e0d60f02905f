"""Unplanned motions: a brake, and an evasion of an obstacle that approaches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.conflicts import MotionSamples, first_conflict
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.trajectory import plan_stop, plan_to

# Directions and steps in which a clear place is looked for, how many are tried, and what is kept
# there beyond the clearance.
_DIRECTIONS, _RING_M, _PLACES_MAX, _AWAY_M = 16, 0.5, 6, 0.2


class Evasion:
    """Stops one vehicle, and lets it give way."""

    def __init__(self, config: AvoidanceConfig, traits: Traits, limits: Limits) -> None:
        """Prepare; the arguments are those of `PathPlanner`."""
        self._config = config
        self._traits = traits
        self._limits = limits
        self._emergency_limits = _harder(limits, config.emergency_factor)

    def stop(self, start: KinematicState, obstacles: Obstacles) -> CheckedPath:
        """Return the braking path: an emergency's if the usual one leads too near to something.

        Args:
            start: state at the beginning, in the map frame.
            obstacles: the known obstacles.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        trajectory = plan_stop(start, self._limits)
        samples = MotionSamples.of(trajectory)
        clearance_m = self._config.conflict_clearance_m
        if first_conflict(samples.positions_enu_m, obstacles, clearance_m) is not None:
            trajectory = plan_stop(start, self._emergency_limits)
            samples = MotionSamples.of(trajectory)
        return CheckedPath(trajectory, (), samples)

    def plan_away(self, start: KinematicState, obstacles: Obstacles) -> CheckedPath | None:
        """Return a path to the nearest clear place; None if there is none within reach.

        A rover or boat has none: it could not leave sideways, and is safer standing than turning.

        Args:
            start: state at the beginning, in the map frame.
            obstacles: the known obstacles.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if not self._traits.flies:
            return None
        needed_m = self._config.plan_clearance_m + _AWAY_M
        places = self._places(start.position_enu_m)
        clear = obstacles.clearance_m(places) >= needed_m
        for x, y, z in places[clear][:_PLACES_MAX]:
            trajectory = plan_to(start, (float(x), float(y), float(z)), self._emergency_limits)
            samples = MotionSamples.of(trajectory)
            clearance_m = self._config.conflict_clearance_m
            if first_conflict(samples.positions_enu_m, obstacles, clearance_m) is None:
                return CheckedPath(trajectory, (trajectory.duration_s,), samples)
        return None

    def _places(self, here_enu_m: Vector3) -> Array:
        """Return places about one, the nearest first."""
        reach_m, low, high = self._config.give_way_reach_m, here_enu_m[2], here_enu_m[2]
        if self._config.heights_m is not None:
            low, high = self._config.heights_m
        angles = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
        circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
        circle = np.concatenate([circle, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
        radii_m = np.arange(_RING_M, reach_m + _RING_M, _RING_M)
        places = np.array(here_enu_m) + (radii_m[:, None, None] * circle).reshape(-1, 3)
        inside = (places[:, 2] >= low - _RING_M / 2) & (places[:, 2] <= high + _RING_M / 2)
        return np.asarray(places[inside])


def _harder(limits: Limits, factor: float) -> Limits:
    """Return limits with more acceleration, built up and taken away the sooner."""
    return replace(
        limits,
        acceleration_horizontal_m_s2=factor * limits.acceleration_horizontal_m_s2,
        jerk_m_s3=factor * factor * limits.jerk_m_s3,
    )
