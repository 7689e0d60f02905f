"""The phases before a flight by setpoints."""

from __future__ import annotations

from navigation_core.tasks.departure import Departure, is_pending
from navigation_core.tasks.flying.itinerary import GotoEstimator
from navigation_core.tasks.flying.stopping import FlightParts
from navigation_core.tasks.observation import Observation, TaskOperation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import Phase

__all__ = ["Launch"]


class Launch:
    """Takes control, arms and takes off, as far as the vehicle needs it."""

    def __init__(self, parts: FlightParts, departure: Departure, estimator: GotoEstimator) -> None:
        """Prepare.

        Args:
            parts: of the flight.
            departure: its operations.
            estimator: knows how high to climb.
        """
        self._parts, self._departure, self._estimator = parts, departure, estimator

    def prepare(self, observation: Observation, now: float) -> Answer:
        """Take control."""
        # A take-off that a replaced goal began continues.
        taking_off = is_pending(observation, TaskOperation.TAKE_OFF)
        rejection = self._departure.check(observation)
        if rejection is not None and not taking_off:
            return rejection
        moves = self._departure.moves(observation)
        before_takeoff = self._parts.traits.control_before_takeoff
        is_needed = not taking_off and (before_takeoff or moves)
        answer = self._departure.take_control(observation, now, is_needed)
        if answer is not None:
            return answer
        if moves and not taking_off:
            return Phase.NAVIGATING
        # The vehicle is on the ground: the last setpoint of an earlier flight is no start for this.
        self._parts.follower.forget_commanded()
        return Phase.TAKING_OFF if observation.armed or taking_off else Phase.ARMING

    def arm(self, observation: Observation, now: float) -> Answer:
        """Arm."""
        following = Phase.TAKING_OFF if self._parts.traits.flies else Phase.PREPARING
        return self._departure.arm(observation, now) or following

    def take_off(self, observation: Observation, now: float) -> Answer:
        """Climb."""
        height_m = self._estimator.takeoff_height_m(observation.ground_enu_m)
        following = Phase.NAVIGATING if observation.in_control else Phase.PREPARING
        return self._departure.take_off(height_m, observation, now) or following
