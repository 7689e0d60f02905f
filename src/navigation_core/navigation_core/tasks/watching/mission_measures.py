"""Measurements that the mission task makes itself, beside the reports of the vehicle."""

from __future__ import annotations

from navigation_core.geometry import distance, horizontal_norm, subtract
from navigation_core.tasks.conditions import is_airborne, measured_speed
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import MissionReport, Observation
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.waypoint import MissionPlan, RouteWaypoint

_CIRCLE_SHARE = 1.5
# WP_RADIUS of an ArduRover is 2 m, and it stops within it.
_GROUND_ARRIVAL_M = 3.0
# A PX4 calls a take-off over within 0.8 m of its height (NAV_MC_ALT_RAD).
_RISEN_WITHIN_M = 1.0
# Farther than this from where it stood it flies its route.
_AWAY_M = 3.0


class MissionMeasures:
    """Judges the ends of a mission by position and speed."""

    def __init__(
        self, waypoints: tuple[RouteWaypoint, ...], config: GotoConfig, traits: Traits
    ) -> None:
        """Judge a mission through these waypoints."""
        self._first, self._last = waypoints[0], waypoints[-1]
        self._config = config
        self._traits = traits

    def on_ground(self, observation: Observation) -> bool:
        """Whether it is a vehicle that flies, and does not."""
        return self._traits.flies and not (
            observation.armed and is_airborne(observation, self._config.airborne_height_m)
        )

    def has_risen(self, plan: MissionPlan, observation: Observation) -> bool:
        """Whether its take-off is over, if the mission has one: it is at its height, or away."""
        start, position = plan.takeoff_from_enu_m, observation.position_enu_m
        if start is None or position is None:
            return start is None
        way_m = subtract(position, start)
        near_m = min(_RISEN_WITHIN_M, 0.5 * plan.takeoff_height_m)
        return way_m[2] >= plan.takeoff_height_m - near_m or horizontal_norm(way_m) > _AWAY_M

    def takeoff_height_m(self, ground_enu_m: float) -> float:
        """Return the height above the ground to take off to: the first waypoint's, in limits."""
        height_m = self._first.position_enu_m[2] - ground_enu_m
        height_m = max(height_m, self._config.takeoff_height_min_m)
        return min(height_m, self._config.takeoff_height_m) if self._traits.hovers else height_m

    def has_arrived(self, report: MissionReport | None, observation: Observation) -> bool:
        """Whether the vehicle says that it is done, is there, and stands if it can."""
        error_m = self.error_m(observation)
        if report is None or not report.complete or error_m is None or error_m > self._arrival_m():
            return False
        speed_m_s = measured_speed(observation)
        slow = speed_m_s is not None and speed_m_s <= self._config.arrival_speed_m_s
        return slow or not self._traits.hovers

    def near_end(self, observation: Observation) -> bool:
        """Whether it is near enough to the last waypoint to hold because of that."""
        error_m = self.error_m(observation)
        return error_m is not None and error_m <= self._arrival_m() + _GROUND_ARRIVAL_M

    def error_m(self, observation: Observation) -> float | None:
        """Return how far the last waypoint is; without height where that is the terrain's."""
        position = observation.position_enu_m
        if position is None:
            return None
        offset = subtract(position, self._last.position_enu_m)
        flat = self._last.height_above_ground_m is not None or not self._traits.hovers
        return horizontal_norm(offset) if flat else distance(position, self._last.position_enu_m)

    def _arrival_m(self) -> float:
        radius_m = max(self._last.acceptance_radius_m, self._traits.arrival_radius_m)
        if not self._traits.hovers:
            return max(radius_m, _CIRCLE_SHARE * self._traits.circle_radius_m)
        return radius_m if self._traits.flies else max(radius_m, _GROUND_ARRIVAL_M)
