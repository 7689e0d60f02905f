"""The phases in which a flight stands still: without a position, paused, or without a path."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import is_located
from navigation_core.tasks.flying.stopping import FlightParts, led
from navigation_core.tasks.intents import Fly, Outcome
from navigation_core.tasks.leading.avoider import Avoider
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.traffic.path_in_traffic import PathInTraffic

__all__ = ["Standing"]

# The remaining path must get shorter than ever before by this much to count as progress.
_PROGRESS_MIN_M = 1.0


class Standing:
    """Lets the vehicle of one flight stand still, and remembers for how long it had to."""

    def __init__(
        self,
        parts: FlightParts,
        in_traffic: PathInTraffic,
        avoider: Avoider | None,
        is_paused: Callable[[], bool],
    ) -> None:
        """Prepare.

        Args:
            parts: of the flight.
            in_traffic: leads it among other vehicles.
            avoider: keeps it away from obstacles; None to fly straight.
            is_paused: returns whether a pause is asked for.
        """
        self._parts = parts
        self._in_traffic = in_traffic
        self._avoider = avoider
        self._is_paused = is_paused
        self._since_s = 0.0
        # Time without a position since the flight last got nearer to its end.
        self._held_s = 0.0
        self._least_left_m = math.inf
        # Whether it was held by its velocity, so that it has drifted from its setpoint.
        self._doubted = False

    def begin(self, now: float) -> None:
        """Begin a phase."""
        self._since_s = now

    def restart(self) -> None:
        """Fly to another stop."""
        self._held_s, self._least_left_m = 0.0, math.inf

    def note_left(self, left_m: float) -> None:
        """Take how much of the path is left: one that gets nearer has not been held for long."""
        if left_m < self._least_left_m - _PROGRESS_MIN_M:
            self._least_left_m, self._held_s = left_m, 0.0

    def lose_position(self, observation: Observation) -> Phase:
        """Stop the setpoint, because where the vehicle is is not known."""
        self._parts.follower.plan_stop(observation)
        return Phase.HOLDING

    def hold(self, observation: Observation, now: float) -> Answer:
        """Stand still until the position is known, or it has taken too long."""
        parts, paused = self._parts, self._is_paused()
        is_known = is_located(observation, parts.config.position_stale_s)
        held_s = self._held_s + now - self._since_s
        if held_s > parts.arrival.patience_s and not paused:
            # Each time it comes back the flight restarts, and with it all other patience.
            text = (
                f"The vehicle's position is intermittent: the vehicle held for {held_s:.0f} s in "
                "total without getting closer."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        if is_known and not observation.position_doubt:
            if self._doubted:
                self._doubted = False
                parts.forget()
            self._held_s = 0.0 if paused else held_s
            return Phase.NAVIGATING
        if is_known:
            self._since_s = now  # it is not lost; for how long it may be in doubt is not ours
        timeout_s = parts.config.position_timeout_s
        age_s = observation.position_age_s
        too_old = math.isfinite(age_s) and age_s > timeout_s
        # The age alone is not enough: the position may be new and its heading missing.
        if too_old or now - self._since_s > timeout_s:
            text = (
                f"The vehicle has reported no valid position, velocity and yaw for {timeout_s:g} s."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        parts.follower.walk(None)
        return led(parts, observation)

    def held(self, fly: Fly, observation: Observation) -> Fly:
        """Hold by the velocity while the position is in doubt, and in a stop after that."""
        if not (observation.position_doubt or self._doubted):
            return fly
        self._doubted = True
        return replace(fly, by_velocity=True)

    def pause(self, observation: Observation, now: float) -> Answer:
        """Stand still where the pause came, until it is over."""
        if not is_located(observation, self._parts.config.position_stale_s):
            return self.lose_position(observation)
        if self._is_paused():
            return self.stand(observation, now)
        if self._avoider is not None:
            self._avoider.restart_clock()
        return Phase.NAVIGATING

    def stand(self, observation: Observation, now: float) -> Answer:
        """Brake and stand, but give way to what comes near."""
        follower = self._parts.follower
        if follower.sent.is_stale or follower.carrot is None:
            follower.plan_stop(observation)
        elif not self._in_traffic.gives_way(observation, now) and self._avoider is not None:
            self._avoider.give_way(observation, now)
        follower.walk(None)
        return led(self._parts, observation)
