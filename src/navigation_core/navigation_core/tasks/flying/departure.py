"""The departure of a flight: takes control, arms, takes off."""

from __future__ import annotations

from dataclasses import dataclass, replace

from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.lateness import TOO_LATE_S
from navigation_core.tasks.conditions import Requester, check_departure
from navigation_core.tasks.flying.arrival import Arrival
from navigation_core.tasks.flying.goto_progress import GotoEstimator
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Intent, Outcome, Perform, Wait
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.measurement import can_move
from navigation_core.tasks.observation import Observation, OperationStatus, TaskOperation
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.traits import Traits


@dataclass(frozen=True)
class StopFirst:
    """The answer of a phase after which the vehicle is to be stopped, and then the goal to end.

    Attributes:
        ending: the outcome.
    """

    ending: Outcome


Step = Intent | Outcome | Phase | StopFirst
"""The answer of a phase, or the phase that follows."""


@dataclass(frozen=True)
class FlightParts:
    """The parts of a flight that its phases share.

    Attributes:
        config: how to fly.
        traits: what the vehicle can do.
        requests: the operations that are requested.
        follower: leads along the path.
        arrival: judges the distance to the stop.
    """

    config: GotoConfig
    traits: Traits
    requests: Requester
    follower: PathFollower
    arrival: Arrival


# Of a replaced goal: what was sent arrives, and the vehicle would leave the control mode again.
NOT_TAKEN_BACK = (
    *(TaskOperation.DISARM, TaskOperation.HOLD, TaskOperation.LAND, TaskOperation.RETURN),
    TaskOperation.START_MISSION,
)


class Departure:
    """The phases before the flight."""

    def __init__(self, parts: FlightParts, estimator: GotoEstimator) -> None:
        """Prepare.

        Args:
            parts: of the flight that departs.
            estimator: knows the height of the take-off.
        """
        self._parts = parts
        self._estimator = estimator
        self.arming_asked = False
        """Whether the vehicle was asked to arm."""
        self.take_off_asked = False
        """Whether it was asked to take off."""
        self._armed_seen = False

    def note(self, observation: Observation) -> None:
        """Record whether the vehicle was ever armed."""
        self._armed_seen = self._armed_seen or observation.armed

    def prepare(self, observation: Observation, now: float) -> Step:
        """Take control, as far as that comes first."""
        # A take-off that a replaced goal began continues.
        taking_off = is_pending(observation, TaskOperation.TAKE_OFF)
        rejection = check_departure(observation, self._parts.config, self._parts.traits)
        if rejection is not None and not taking_off:
            return Outcome(
                rejection.code, rejection.message, self._parts.arrival.error_m(observation)
            )
        if any(is_pending(observation, kind) for kind in NOT_TAKEN_BACK):
            return Wait()
        moves = self._moves(observation)
        needs_control = self._parts.traits.control_before_takeoff or moves
        if not observation.in_control and not taking_off and needs_control:
            control, refusal = Perform(TaskOperation.TAKE_CONTROL), OutcomeCode.MODE_REFUSED
            answer = self._parts.requests.perform(control, refusal, observation, now)
            if answer is not None:
                return answer
        if moves and not taking_off:
            return Phase.NAVIGATING
        # The vehicle is on the ground: the last setpoint of an earlier flight is no start for this.
        self._parts.follower.forget_commanded()
        ready = observation.armed or taking_off
        return Phase.TAKING_OFF if ready else Phase.ARMING

    def arm(self, observation: Observation, now: float) -> Step:
        """Arm."""
        self.arming_asked = True
        arm, refusal = Perform(TaskOperation.ARM), OutcomeCode.ARMING_REFUSED
        answer = self._parts.requests.perform(arm, refusal, observation, now)
        report = observation.operation
        refused = report is not None and report.state is OperationStatus.REFUSED
        if isinstance(answer, Outcome) and (observation.armed or not refused):
            # Without a clear rejection the motors may be turning, now or in a moment.
            return StopFirst(answer)
        if answer is not None:
            return answer
        return Phase.TAKING_OFF if self._parts.traits.flies else Phase.PREPARING

    def take_off(self, observation: Observation, now: float) -> Step:
        """Take off."""
        # A vehicle that is armed and left alone disarms itself after 10 s or so.
        late = ""
        if observation.late_s >= TOO_LATE_S:
            late = f" This server was {observation.late_s:.1f} s late itself."
        if self._armed_seen and not observation.armed:
            text = "The vehicle was disarmed before take-off."
            code = OutcomeCode.SERVER_LATE if late else OutcomeCode.DISARMED
            return Outcome(code, text + late, self._parts.arrival.error_m(observation))
        height_m = self._estimator.takeoff_height_m(observation.ground_enu_m)
        self.take_off_asked = True
        climb, refusal = Perform(TaskOperation.TAKE_OFF, height_m), OutcomeCode.TAKEOFF_REFUSED
        answer = self._parts.requests.perform(climb, refusal, observation, now)
        if isinstance(answer, Outcome) and answer.code is refusal and late:
            answer = replace(answer, code=OutcomeCode.SERVER_LATE, message=answer.message + late)
        if isinstance(answer, Outcome) and self.arming_asked and not self._moves(observation):
            # Turning propellers on the ground are a danger, and this task armed them.
            return StopFirst(answer)
        if answer is not None:
            return answer
        return Phase.NAVIGATING if observation.in_control else Phase.PREPARING

    def _moves(self, observation: Observation) -> bool:
        return can_move(observation, self._parts.traits, self._parts.config.airborne_height_m)


def is_pending(observation: Observation, kind: TaskOperation) -> bool:
    """Whether an operation of this kind is under way."""
    report = observation.operation
    if report is None or report.kind is not kind:
        return False
    return report.state is OperationStatus.PENDING
