"""The departure of a flight to a point: takes control, arms, takes off."""

from __future__ import annotations

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import Observation, OperationKind, OperationStatus, Outcome, Perform
from navigation_core.tasks.conditions import check_departure
from navigation_core.tasks.flying.goto_base import Answer, GotoBase, is_pending
from navigation_core.tasks.flying.goto_phases import PhaseEvent


class GotoDeparture(GotoBase):
    """The departure, before the flight."""

    def _prepare(self, observation: Observation, now: float) -> Answer:
        # A take-off that a replaced goal began goes on.
        taking_off = is_pending(observation, OperationKind.TAKE_OFF)
        rejection = check_departure(observation, self._config, self._traits)
        if rejection is not None and not taking_off:
            return self._over(rejection.code, rejection.message, observation)
        if is_pending(observation, OperationKind.DISARM):
            # Of a replaced goal; it cannot be taken back.
            disarm, refusal = Perform(OperationKind.DISARM), OutcomeCode.ARMING_REFUSED
            return self._perform(disarm, refusal, observation, now)
        if self._operation is not None and self._operation.intent.kind is OperationKind.DISARM:
            self._operation = None
        needs_control = self._traits.control_before_takeoff or self._flies(observation)
        if not observation.in_control and not taking_off and needs_control:
            answer = self._perform(
                Perform(OperationKind.TAKE_CONTROL), OutcomeCode.MODE_REFUSED, observation, now
            )
            if answer is not None:
                return answer
        if self._flies(observation) and not taking_off:
            self._begin_flight(PhaseEvent.FLIES, observation, now)
            return None
        self._follower.forget_commanded()  # What was sent in the air is no start on the ground.
        if observation.armed or taking_off:
            self._go(PhaseEvent.NEEDS_TAKEOFF, now)
        else:
            self._go(PhaseEvent.NEEDS_ARMING, now)
        return None

    def _arm(self, observation: Observation, now: float) -> Answer:
        self._arming_asked = True
        answer = self._perform(
            Perform(OperationKind.ARM), OutcomeCode.ARMING_REFUSED, observation, now
        )
        report = observation.operation
        refused = report is not None and report.state is OperationStatus.REFUSED
        if isinstance(answer, Outcome) and (observation.armed or not refused):
            # Without a clear rejection the motors may be turning, now or in a moment.
            self._stop(observation, now, answer)
            return None
        if answer is not None:
            return answer
        self._go(PhaseEvent.NEEDS_TAKEOFF if self._traits.flies else PhaseEvent.NEEDS_CONTROL, now)
        return None

    def _take_off(self, observation: Observation, now: float) -> Answer:
        if self._armed_seen and not observation.armed:
            text = "The vehicle was disarmed before take-off."
            return self._over(OutcomeCode.DISARMED, text, observation)
        height_m = self._estimator.takeoff_height_m(observation.ground_enu_m)
        answer = self._perform(
            Perform(OperationKind.TAKE_OFF, height_m),
            OutcomeCode.TAKEOFF_REFUSED,
            observation,
            now,
        )
        if isinstance(answer, Outcome) and self._arming_asked and not self._flies(observation):
            # Turning propellers on the ground are a danger, and this task armed them.
            self._stop(observation, now, answer)
            return None
        if answer is not None:
            return answer
        if observation.in_control:
            self._begin_flight(PhaseEvent.FLIES, observation, now)
        else:
            self._go(PhaseEvent.NEEDS_CONTROL, now)
        return None
