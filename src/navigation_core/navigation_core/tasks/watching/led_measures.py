"""Measurements for a landing or a return, beside the reports of the vehicle."""

from __future__ import annotations

import math

from navigation_core.geometry import Vector3, horizontal_norm, subtract
from navigation_core.tasks.conditions import is_airborne, measured_speed
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

# Descent at the end of a landing: LAND_SPEED of ArduCopter is 0.5 m/s, MPC_LAND_SPEED of
# PX4 0.7 m/s; from 10 m up both are faster (LAND_ALT_LOW, MPC_LAND_ALT2).
_LAND_SPEED_M_S = 0.5
_LAND_LOW_M = 10.0
_DESCENT_M_S = 1.5
_TOUCHDOWN_S = 3.0
# A ground vehicle stops within its own waypoint radius (WP_RADIUS is 2 m), or about.
_ARRIVAL_MIN_M = 3.0


class LedMeasures:
    """Position, speed and distances of a vehicle; an old position counts as none."""

    def __init__(self, config: GotoConfig, traits: Traits) -> None:
        """Measure by these tolerances."""
        self._config = config
        self._traits = traits
        self.arrival_m = max(config.arrival_radius_m, _ARRIVAL_MIN_M) + traits.arrival_radius_m
        """Within this a vehicle is at its launch point."""

    def position(self, observation: Observation) -> Vector3 | None:
        """Return where the vehicle is; None where it only was."""
        recent = observation.position_age_s <= self._config.position_stale_s
        return observation.position_enu_m if recent else None

    def speed_m_s(self, observation: Observation) -> float:
        """Return the measured speed, 0 while it is unknown: an old one is no speed of a fall."""
        located = self.position(observation) is not None
        return (measured_speed(observation) or 0.0) if located else 0.0

    def home_m(self, observation: Observation) -> float | None:
        """Return the horizontal distance to the launch point; None while it is unknown."""
        position, home = self.position(observation), observation.home_enu_m
        if position is None or home is None:
            return None
        return horizontal_norm(subtract(position, home))

    def is_on_ground(self, observation: Observation) -> bool:
        """Whether it is on the ground with its motors off."""
        return not observation.armed and not is_airborne(
            observation, self._config.airborne_height_m
        )

    def height_m(self, observation: Observation) -> float:
        """Return the height above the ground; infinite while it is unknown."""
        position = self.position(observation)
        return math.inf if position is None else position[2] - observation.ground_enu_m

    def landing(self, observation: Observation) -> tuple[float, float]:
        """Return the height that is left, and how long a landing from there takes."""
        if self.position(observation) is None or not self._traits.lands_itself:
            return 0.0, 0.0
        height_m = max(self.height_m(observation), 0.0)
        low_m = min(height_m, _LAND_LOW_M)
        fast_s = (height_m - low_m) / _DESCENT_M_S
        return height_m, low_m / _LAND_SPEED_M_S + fast_s + _TOUCHDOWN_S
