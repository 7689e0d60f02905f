"""The departure of a task: takes control, arms, takes off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.late_setpoints import TOO_LATE_S
from navigation_core.tasks.conditions import Requester, can_move, check_departure
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Intent, Outcome, Perform, StopFirst, Wait
from navigation_core.tasks.observation import Observation, OperationStatus, TaskOperation
from navigation_core.tasks.traits import Traits

# Of a replaced goal: what was sent arrives, and the vehicle would leave the control mode again.
_NOT_TAKEN_BACK = (
    *(TaskOperation.DISARM, TaskOperation.HOLD, TaskOperation.LAND, TaskOperation.RETURN),
    *(TaskOperation.LAND_ON_TARGET, TaskOperation.START_MISSION),
)


class Departure:
    """The operations before a flight. Each returns None once it is done."""

    def __init__(
        self,
        config: GotoConfig,
        traits: Traits,
        requests: Requester,
        error_m: Callable[[Observation], float | None] = lambda _: None,
    ) -> None:
        """Prepare.

        Args:
            config: whether it may arm and take off.
            traits: what the vehicle can do.
            requests: the operations of the task.
            error_m: how far the target is, for an outcome.
        """
        self._config, self._traits, self._requests = config, traits, requests
        self._error_m = error_m
        self.arming_asked = False
        """Whether the vehicle was asked to arm."""
        self.take_off_asked = False
        """Whether it was asked to take off."""
        self._armed_seen = False

    def check(self, observation: Observation) -> Outcome | None:
        """Return why the vehicle must stay where it stands, or None."""
        rejection = check_departure(observation, self._config, self._traits)
        if rejection is None:
            return None
        return Outcome(rejection.code, rejection.message, self._error_m(observation))

    def moves(self, observation: Observation) -> bool:
        """Whether the vehicle can be led already."""
        return can_move(observation, self._traits, self._config.airborne_height_m)

    def take_control(
        self, observation: Observation, now: float, is_needed: bool = True
    ) -> Intent | Outcome | None:
        """Get the vehicle into the mode in which it follows setpoints, or can be armed."""
        if any(is_pending(observation, kind) for kind in _NOT_TAKEN_BACK):
            return Wait()
        if observation.in_control or not is_needed:
            return None
        control, refusal = Perform(TaskOperation.TAKE_CONTROL), OutcomeCode.MODE_REFUSED
        return self._requests.perform(control, refusal, observation, now)

    def arm(self, observation: Observation, now: float) -> Intent | Outcome | StopFirst | None:
        """Arm."""
        self.arming_asked = True
        self._armed_seen = self._armed_seen or observation.armed
        arm, refusal = Perform(TaskOperation.ARM), OutcomeCode.ARMING_REFUSED
        answer = self._requests.perform(arm, refusal, observation, now)
        report = observation.operation
        refused = report is not None and report.state is OperationStatus.REFUSED
        if isinstance(answer, Outcome) and (observation.armed or not refused):
            # Without a clear rejection the motors may be turning, now or in a moment.
            return StopFirst(answer)
        return answer

    def take_off(
        self, height_m: float, observation: Observation, now: float
    ) -> Intent | Outcome | StopFirst | None:
        """Take off to a height above the ground."""
        late = ""
        if observation.late_s >= TOO_LATE_S:
            late = f" This server was {observation.late_s:.1f} s late itself."
        # A vehicle that is armed and left alone disarms itself after 10 s or so.
        self._armed_seen = self._armed_seen or observation.armed
        if self._armed_seen and not observation.armed:
            text = "The vehicle was disarmed before take-off."
            code = OutcomeCode.SERVER_LATE if late else OutcomeCode.DISARMED
            return Outcome(code, text + late, self._error_m(observation))
        self.take_off_asked = True
        climb, refusal = Perform(TaskOperation.TAKE_OFF, height_m), OutcomeCode.TAKEOFF_REFUSED
        answer = self._requests.perform(climb, refusal, observation, now)
        if isinstance(answer, Outcome) and answer.code is refusal and late:
            answer = replace(answer, code=OutcomeCode.SERVER_LATE, message=answer.message + late)
        if isinstance(answer, Outcome) and self.arming_asked and not self.moves(observation):
            # Turning propellers on the ground are a danger, and this task armed them.
            return StopFirst(answer)
        return answer


def is_pending(observation: Observation, kind: TaskOperation) -> bool:
    """Whether an operation of this kind is under way."""
    report = observation.operation
    if report is None or report.kind is not kind:
        return False
    return report.state is OperationStatus.PENDING
