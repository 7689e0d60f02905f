"""The end of a flight's section: whether the vehicle is there, turned and still."""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_core.geometry import distance, wrap_angle
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell, measured_speed
from navigation_core.tasks.flying.itinerary import Section
from navigation_core.tasks.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits

# Two full turns at 1 m/s, per metre of their radius.
_TURNS_S_M = 4.0 * math.pi
# Over a shorter time positions do not show whether the vehicle moves.
_STILL_MIN_S = 0.5


class Arrival:
    """Judges the arrival at a stop."""

    def __init__(self, section: Section, config: GotoConfig, traits: Traits) -> None:
        """Expect the stop of a section."""
        self._config = config
        self._traits = traits
        window_s = max(config.arrival_dwell_s, _STILL_MIN_S)
        self._still = Standstill(config.arrival_speed_m_s, window_s)
        # A vehicle that cannot turn on the spot may have to leave first, and turn round once more.
        self.patience_s = config.settle_timeout_s + _TURNS_S_M * traits.turning_radius_m
        """How long to wait without getting nearer."""
        self.expect(section)

    def expect(self, section: Section) -> None:
        """Expect the stop of another section."""
        radius_m = self._config.arrival_radius_m if section.radius_m is None else section.radius_m
        self.goal: GotoGoal = section.goal
        self.radius_m = max(radius_m, self._traits.arrival_radius_m)
        self.hold_time_s, self.settles = section.hold_time_s, section.settles
        self._dwell = Dwell(max(self._config.arrival_dwell_s, section.hold_time_s))

    def restart(self) -> None:
        """Begin the dwell again."""
        self._dwell.reset()

    def forget(self) -> None:
        """Forget all that was seen."""
        self._dwell.reset()
        self._still.reset()

    def level(self, observation: Observation) -> Observation:
        """Put what drives at the height of its goal: the home that heights count from moves."""
        position = observation.position_enu_m
        if position is None:
            return observation
        place = (position[0], position[1], self.goal.position_enu_m[2])
        return replace(observation, position_enu_m=place)

    def error_m(self, observation: Observation) -> float | None:
        """Return how far the stop is; None without a position."""
        position = observation.position_enu_m
        return None if position is None else distance(position, self.goal.position_enu_m)

    def is_near(self, observation: Observation) -> bool:
        """Whether the vehicle is as near as it has to be."""
        error_m = self.error_m(observation)
        return error_m is not None and error_m <= self.radius_m

    def is_turned(self, observation: Observation) -> bool:
        """Whether it has the yaw that the goal names, if it names one."""
        return self._yaw_error_rad(observation) <= self._config.arrival_yaw_rad

    def holds(self, observation: Observation, now: float, turned: bool = True) -> bool:
        """Whether the vehicle has been near, turned and slow for its time.

        Slow is what its velocity or what its positions show: the velocity of a PX4 may be off by
        0.5 m/s for half a minute after a long flight (observed).
        """
        speed_m_s = measured_speed(observation)
        still = self._still.holds(observation, self._config.position_stale_s)
        slow = still or (speed_m_s is not None and speed_m_s <= self._config.arrival_speed_m_s)
        there = self.is_near(observation) and turned
        # A position that is only repeated adds nothing to the dwell.
        return self._dwell.holds(there and slow, now - observation.position_age_s)

    def timeout(self, what: str, observation: Observation) -> Outcome:
        """Return the outcome of a vehicle that did not get there, and what is missing."""
        error_m, speed_m_s = self.error_m(observation), measured_speed(observation)
        config = self._config
        text = (
            f"{what} within {self.patience_s:.0f} s: the vehicle is {error_m:.2f} m from the "
            f"target and moves at {speed_m_s:.2f} m/s; arrival requires at most "
            f"{self.radius_m:g} m and {config.arrival_speed_m_s:g} m/s."
        )
        yaw_error_rad = self._yaw_error_rad(observation)
        if yaw_error_rad > config.arrival_yaw_rad:
            text += (
                f" Its yaw error is {math.degrees(yaw_error_rad):.0f} degrees; arrival requires "
                f"at most {math.degrees(config.arrival_yaw_rad):.0f}."
            )
        return Outcome(OutcomeCode.TIMEOUT, text, error_m)

    def _yaw_error_rad(self, observation: Observation) -> float:
        """Return how far the yaw is from the one that the goal names; 0 if it names none.

        A rover or boat has the yaw of its path.
        """
        yaw, wanted = observation.yaw_enu_rad, self.goal.yaw_enu_rad
        if wanted is None or yaw is None or not self._traits.flies:
            return 0.0
        return abs(wrap_angle(yaw - wanted))
