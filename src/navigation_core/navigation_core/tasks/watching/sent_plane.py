"""The base of tasks that send a plane from place to place: what ends them, pause and cancel.

A plane follows no setpoints. It is sent to a place, flies there by itself, and circles it
until it is sent on. So a pause and a cancel are a place, too: where it is. It cannot stop.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell
from navigation_core.tasks.departure import Departure
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Outcome, Perform, StopFirst, Wait
from navigation_core.tasks.observation import Observation, TaskOperation
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import PLANE, STATUS, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.leg_speed import LegSpeed
from navigation_core.tasks.watching.plane_destination import PlaneDestination

__all__ = ["IN_FLIGHT", "SentPlane"]

IN_FLIGHT = frozenset({Phase.NAVIGATING, Phase.SETTLING, Phase.PAUSED})
"""The phases in which it is sent to places."""


class SentPlane(PhasedTask):
    """The base. See :class:`navigation_core.tasks.task.Task`."""

    table = PLANE

    def __init__(self, config: GotoConfig, traits: Traits) -> None:
        """Prepare.

        Args:
            config: tolerances and limits of time.
            traits: what the plane can do.
        """
        super().__init__(config, Phase.PREPARING)
        self._traits = traits
        self._destination = PlaneDestination(traits, self._requests)
        self._giving_way = self._destination.giving_way
        self._leg_speed = LegSpeed(self._requests)
        self._departure = Departure(config, traits, self._requests, self._error_m)
        self._landed = Dwell(config.landed_timeout_s)

    def resume_control(self, now: float) -> None:
        """Send it on to its place, which brings the mode; a speed is forgotten with a mode."""
        self._leg_speed.forget()
        self._destination.forget()
        if self._phase in IN_FLIGHT:
            self._go(Phase.NAVIGATING, now)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the status of the phase, without a distance and a time."""
        status = STATUS[self._phase]
        if self._phase is Phase.PAUSED and not self._pause_asked:
            status = Status.HOLDING  # the position is in doubt
        return Progress(status, 0.0, 0.0)

    # --- what ends it ------------------------------------------------------------------

    def _finish(self, outcome: Outcome, now: float) -> Outcome:
        problem = self._leg_speed.problem
        if problem:
            outcome = replace(outcome, message=f"{outcome.message} {problem}")
        return super()._finish(outcome, now)

    def _check(self, observation: Observation, now: float) -> Answer:
        """Look for what ends every flight."""
        if self._phase not in IN_FLIGHT:
            return None
        if not observation.armed:
            text = "The vehicle was disarmed during the goal."
            return self._over(OutcomeCode.DISARMED, text, observation)
        if self._destination.was_sent and not observation.in_control:
            text = "The vehicle left the mode in which it flies to targets."
            return self._over(OutcomeCode.PILOT_OVERRIDE, text, observation)
        if self._landed.holds(observation.airborne is False, now):
            text = f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s."
            return self._over(OutcomeCode.LANDED, text, observation)
        if observation.position_age_s > self._config.position_timeout_s:
            text = (
                "The vehicle has reported no valid position for "
                f"{self._config.position_timeout_s:g} s; it continues on its own."
            )
            return self._over(OutcomeCode.NO_POSITION, text, observation)
        return None

    # --- pause, cancel ---------------------------------------------------------------

    def _place_to_stay(self, observation: Observation) -> Vector3 | None:
        """Return where to circle: here, but no lower than is safe."""
        position = observation.position_enu_m
        if position is None:
            return None
        least_m = observation.ground_enu_m + self._traits.height_min_m
        return (position[0], position[1], max(position[2], least_m))

    def _begin_stay(self, observation: Observation) -> Answer:
        place = self._place_to_stay(observation)
        if place is None:
            return Wait()
        self._handlers[Phase.PAUSED] = partial(self._stay, place)
        return Phase.PAUSED

    def _stay(self, place: Vector3, observation: Observation, now: float) -> Answer:
        answer = self._destination.send(place, observation, now)
        if answer is None and not (self._pause_asked or observation.position_doubt):
            return Phase.NAVIGATING
        return answer or Wait()

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        flies = self._departure.moves(observation)
        if not flies and (self._departure.arming_asked or self._phase is Phase.TAKING_OFF):
            self._handlers[Phase.DISARMING] = partial(self._disarm, ending)
            self._go(Phase.DISARMING, now)
            return None
        place = self._place_to_stay(observation)
        if not flies or place is None:
            return replace(ending, final_error_m=self._error_m(observation))
        self._handlers[Phase.STOPPING] = partial(self._circle_here, ending, place)
        self._go(Phase.STOPPING, now)
        return None

    def _circle_here(
        self, ending: Outcome, place: Vector3, observation: Observation, now: float
    ) -> Answer:
        answer = self._destination.send(place, observation, now)
        if isinstance(answer, Outcome):
            return ending.after(answer.message, self._error_m(observation))
        where = "elsewhere, to give way" if self._giving_way.evades else "where it was"
        text = f"A plane cannot stop: it circles {where}."
        return answer or ending.after(text, self._error_m(observation))

    def _disarm(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        if self._departure.moves(observation):
            return StopFirst(ending)
        disarm = Perform(TaskOperation.DISARM)
        answer = self._requests.perform(disarm, ending.code, observation, now)
        if isinstance(answer, Outcome):
            text = f"{answer.message} It may still be armed."
            return ending.after(text, self._error_m(observation))
        return answer or ending.after("The vehicle is disarmed.", self._error_m(observation))

    def _over(self, code: OutcomeCode, text: str, observation: Observation) -> Outcome:
        return Outcome(code, text, self._error_m(observation))

    def _error_m(self, observation: Observation) -> float | None:
        """Return how far its target is, None without one."""
        return None
