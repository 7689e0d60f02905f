"""Ends a mission: the vehicle holds or is disarmed, then the mission is removed."""

from __future__ import annotations

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Requester
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.observation import Observation, TaskOperation, VehicleMode
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits

# Time for a hold and the deletion of the mission after an end.
_CLEAR_MAX_S = 10.0


class MissionEnd:
    """The operations at the end of a mission.

    Attributes:
        is_stored: whether the vehicle may hold the mission of the task.
    """

    def __init__(self, config: GotoConfig, traits: Traits, requests: Requester) -> None:
        """Prepare; `requests` are the operations of the task."""
        self.is_stored = False
        self._config = config
        self._traits = traits
        self._requests = requests
        self._left_mode = False
        self._stopped = Standstill.of_stop(config, traits)

    def begin(self) -> None:
        """Measure the standstill from now on."""
        self._stopped.reset()

    def mission_stored(self) -> None:
        """The vehicle has the mission, or may have a part of it."""
        self.is_stored = True

    def is_held(self, observation: Observation) -> bool:
        """Whether it is in its hold mode, and nobody here has asked for another one."""
        is_starting = _is_about(observation, TaskOperation.START_MISSION)
        holds = observation.mode is VehicleMode.HOLD and not is_starting
        return holds and self._requests.current is None

    def come_to_rest(
        self, ending: Outcome, down: bool, since_s: float, observation: Observation, now: float
    ) -> Intent | Outcome:
        """Have it hold, or disarm it; return the ending once that is done.

        Args:
            ending: the outcome; what became of the stop is added.
            down: whether it stands on the ground, so that it is disarmed.
            since_s: when the stop began.
            observation: what is known.
            now: time in seconds.
        """
        is_idle = self._requests.current is None and not _is_about(observation, TaskOperation.ARM)
        if not observation.armed and is_idle:
            return ending
        timeout_s = self._config.cancel_timeout_s
        answer = None
        if down or not self.is_held(observation):
            kind = TaskOperation.DISARM if down else TaskOperation.HOLD
            answer = self._requests.perform(
                Perform(kind), OutcomeCode.MODE_REFUSED, observation, now, timeout_s
            )
        if isinstance(answer, Outcome):
            return ending.after(answer.message)
        if answer is not None:
            return answer
        stopped = self._stopped.holds(observation, self._config.position_stale_s)
        if not self._traits.hovers:
            return ending.after("It circles.")
        if stopped:
            return ending.after("It has stopped.")
        if now - since_s > timeout_s:
            return ending.after(self._stopped.failure(timeout_s))
        return Wait()

    def clear(self, ending: Outcome, observation: Observation, now: float) -> Intent | Outcome:
        """Remove the mission; return the ending once that is done."""
        # A PX4 that stands in its mission mode without a mission will not arm again.
        stands_in_mode = not observation.armed and observation.mode is VehicleMode.MISSION
        if stands_in_mode and not self._left_mode:
            hold = Perform(TaskOperation.HOLD)
            answer = self._requests.perform(hold, ending.code, observation, now, _CLEAR_MAX_S)
            if answer is not None and not isinstance(answer, Outcome):
                return answer
            self._left_mode = True
        changed = observation.mission is not None and observation.mission.changed
        if not self.is_stored or changed:
            return ending
        clear = Perform(TaskOperation.CLEAR_MISSION)
        answer = self._requests.perform(clear, ending.code, observation, now, _CLEAR_MAX_S)
        if isinstance(answer, Outcome):
            return ending.after(answer.message)
        return answer or ending


def _is_about(observation: Observation, kind: TaskOperation) -> bool:
    """Whether the operation that is known last is of this kind."""
    report = observation.operation
    return report is not None and report.kind is kind
