"""Values and conditions that tasks read from an observation.

Where the vehicle is, dwell times, progress, and operations that are awaited.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from navigation_core.geometry import ZERO, KinematicState, Vector3
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.late_setpoints import TOO_LATE_S
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Fly, Intent, Outcome, Perform, Setpoint, Wait
from navigation_core.tasks.observation import Observation, OperationStatus, TaskOperation
from navigation_core.tasks.traits import Traits


@dataclass(frozen=True)
class Located:
    """The position of a vehicle that is known, finite and recent.

    Attributes:
        position_enu_m: as it was reported, in the map frame.
        velocity_enu_m_s: the same.
        yaw_enu_rad: yaw.
        state: the state now, see :func:`measured_state`.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    yaw_enu_rad: float
    state: KinematicState


def located(observation: Observation, age_max_s: float) -> Located | None:
    """Return position, velocity and yaw if they are known, finite and recent."""
    position, velocity = observation.position_enu_m, observation.velocity_enu_m_s
    yaw_rad = observation.yaw_enu_rad
    if position is None or velocity is None or yaw_rad is None:
        return None
    is_known = all(map(math.isfinite, (*position, *velocity, yaw_rad)))
    if not is_known or not observation.position_age_s <= age_max_s:
        return None
    return Located(position, velocity, yaw_rad, measured_state(observation))


def is_located(observation: Observation, age_max_s: float) -> bool:
    """Whether position, velocity and yaw are known, finite and recent."""
    return located(observation, age_max_s) is not None


def is_airborne(observation: Observation, height_min_m: float) -> bool:
    """Whether the vehicle flies: as it says, or by its height if it does not say."""
    if observation.airborne is not None:
        return observation.airborne
    position = observation.position_enu_m
    return position is not None and position[2] - observation.ground_enu_m > height_min_m


def can_move(observation: Observation, traits: Traits, height_min_m: float) -> bool:
    """Whether it can be led: what flies must be in the air, what drives only armed."""
    if not traits.flies:
        return observation.armed
    return observation.armed and is_airborne(observation, height_min_m)


def measured_state(observation: Observation) -> KinematicState:
    """Return the state where the vehicle is now, taken to be without acceleration.

    A position that is a little old is carried on at the measured velocity.

    Raises:
        ValueError: position or velocity is not known; ask :func:`is_located` first.
    """
    position, velocity = observation.position_enu_m, observation.velocity_enu_m_s
    if position is None or velocity is None:
        raise ValueError("The observation holds no position and velocity.")
    age_s, (x, y, z), (v_x, v_y, v_z) = observation.position_age_s, position, velocity
    return KinematicState((x + v_x * age_s, y + v_y * age_s, z + v_z * age_s), velocity)


def measured_speed(observation: Observation) -> float | None:
    """Return the measured speed, or None."""
    velocity: Vector3 | None = observation.velocity_enu_m_s
    return None if velocity is None else math.hypot(*velocity)


_WHAT = {
    TaskOperation.TAKE_CONTROL: "enter the mode in which it follows setpoints",
    TaskOperation.ARM: "arm",
    TaskOperation.DISARM: "disarm",
    TaskOperation.TAKE_OFF: "take off",
    TaskOperation.HOLD: "hold",
    TaskOperation.LAND: "land",
    TaskOperation.LAND_ON_TARGET: "land on the target",
    TaskOperation.RETURN: "return to the launch point",
    TaskOperation.REPOSITION: "go to the target",
    TaskOperation.CHANGE_SPEED: "change the speed",
    TaskOperation.UPLOAD_MISSION: "upload the mission",
    TaskOperation.START_MISSION: "start the mission",
    TaskOperation.CLEAR_MISSION: "clear the mission",
}
# More than the noise of a position at rest.
_HEADWAY_M = 1.0


def check_departure(
    observation: Observation, config: GotoConfig, traits: Traits
) -> Rejection | None:
    """Return why a vehicle must stay where it stands, or None.

    A person may stand beside its propellers: without leave to arm, only a vehicle that reports
    that it flies is flown. A rover or boat may drive once it is armed.
    """
    if not observation.armed and not config.may_arm:
        return Rejection(
            OutcomeCode.ARMING_NOT_ALLOWED,
            "The vehicle is disarmed and this server may not arm it; arm it yourself, or allow "
            "the server to arm it.",
        )
    if not traits.flies or config.may_leave_ground or observation.airborne:
        return None
    where = (
        "does not report whether it is airborne"
        if observation.airborne is None
        else "is on the ground"
    )
    return Rejection(
        OutcomeCode.TAKEOFF_NOT_ALLOWED,
        f"The vehicle {where}, and this server may not take off; take off yourself, or allow the "
        "server to take off.",
    )


def stand_on_ground(observation: Observation) -> Intent:
    """Neither climb nor press down, until it is sure that the vehicle has landed.

    A PX4 that gets no setpoints calls that a failsafe, before it is sure. A velocity of zero makes
    no vehicle take off.
    """
    position, yaw_rad = observation.position_enu_m, observation.yaw_enu_rad
    if position is None or yaw_rad is None:
        return Wait()
    return Fly(Setpoint(position, ZERO, ZERO, yaw_rad), by_velocity=True)


class Dwell:
    """Whether something has been true without a break for a time."""

    def __init__(self, duration_s: float) -> None:
        """Begin without observations."""
        self._duration_s = duration_s
        self._since_s: float | None = None

    def holds(self, condition: bool, time_s: float) -> bool:
        """Record the condition at a time, and return whether it held long enough."""
        if not condition:
            self._since_s = None
            return False
        if self._since_s is None:
            self._since_s = time_s
        return time_s - self._since_s >= self._duration_s

    def reset(self) -> None:
        """Forget what was seen."""
        self._since_s = None


class Headway:
    """Whether a vehicle that flies by itself still makes progress.

    It gets lengths that shrink as the vehicle gets on, and that do not shrink forever: so
    there is an end to whatever the vehicle does.
    """

    def __init__(self, patience_s: float) -> None:
        """Begin; the vehicle may be without headway for this time."""
        self._patience_s = patience_s
        self._since_s: float | None = None
        self._least_m: list[float] = []

    def restart(self) -> None:
        """Begin again, with other lengths."""
        self._since_s, self._least_m = None, []

    def is_lost(self, lengths_m: Sequence[float], now: float, longer_s: float = 0.0) -> bool:
        """Record the lengths, and return whether none has shrunk for too long.

        Args:
            lengths_m: always as many, or none while they are not known.
            now: time in seconds.
            longer_s: time that it may stand by right, beyond the usual patience.
        """
        least_m = self._least_m or [math.inf] * len(lengths_m)
        shrunk = [new < least - _HEADWAY_M for new, least in zip(lengths_m, least_m, strict=False)]
        if self._since_s is None or any(shrunk):
            self._since_s = now
        if lengths_m:
            self._least_m = [
                new if less else least
                for new, least, less in zip(lengths_m, least_m, shrunk, strict=True)
            ]
        return now - self._since_s > self._patience_s + longer_s


@dataclass(frozen=True)
class RequestedOperation:
    """An operation that was asked for.

    Attributes:
        intent: what was asked.
        refusal: code of the outcome if it comes to nothing.
        asked_s: when.
        timeout_s: how long its report may take.
    """

    intent: Perform
    refusal: OutcomeCode
    asked_s: float
    timeout_s: float

    def check(self, observation: Observation, now: float) -> Intent | Outcome | None:
        """Return its state: the request again, an outcome, or None once it is achieved."""
        report = observation.operation
        what = _WHAT[self.intent.kind]
        if report is None or report.kind is not self.intent.kind:
            state, reason = OperationStatus.PENDING, ""
        else:
            state, reason = report.state, report.reason.strip().rstrip(".")
        if state is OperationStatus.ACHIEVED:
            return None
        if state is OperationStatus.PENDING:
            if now - self.asked_s <= self.timeout_s:
                return self.intent
            text = f"The request to {what} timed out: no result within {self.timeout_s:g} s."
            late = observation.late_s >= TOO_LATE_S
            if late:
                text += f" This server was {observation.late_s:.1f} s late itself."
            return Outcome(OutcomeCode.SERVER_LATE if late else self.refusal, text, None)
        because = f": {reason}." if reason else "; the vehicle gave no reason."
        if state is OperationStatus.LINK_LOST:
            return Outcome(
                OutcomeCode.LINK_LOST,
                f"The link was lost during the request to {what}{because}",
                None,
            )
        if state is OperationStatus.LATE:
            text = f"This server was too late for the request to {what}{because}"
            return Outcome(OutcomeCode.SERVER_LATE, text, None)
        ending = {
            OperationStatus.REFUSED: "was rejected",
            OperationStatus.TIMED_OUT: "timed out",
            OperationStatus.CANCELLED: "was abandoned",
        }[state]
        return Outcome(self.refusal, f"The request to {what} {ending}{because}", None)


class Requester:
    """Requests the operations of a task, one at a time."""

    def __init__(self, timeout_s: float) -> None:
        """Begin without a request.

        Args:
            timeout_s: how long the report of an operation may take, by default.
        """
        self._timeout_s = timeout_s
        self.current: RequestedOperation | None = None
        """The operation that was requested last; None once it is forgotten."""

    def perform(
        self,
        intent: Perform,
        refusal: OutcomeCode,
        observation: Observation,
        now: float,
        timeout_s: float | None = None,
    ) -> Intent | Outcome | None:
        """Request an operation; None once it is achieved.

        Args:
            intent: what is to be done.
            refusal: code of the outcome if it comes to nothing.
            observation: what is known now.
            now: time in seconds.
            timeout_s: how long its report may take; None for the usual time.
        """
        if self.current is None or self.current.intent.kind is not intent.kind:
            patience_s = self._timeout_s if timeout_s is None else timeout_s
            self.current = RequestedOperation(intent, refusal, now, patience_s)
            return intent  # a report that is there already is about an earlier request
        return self.current.check(observation, now)

    def postpone(self, now: float) -> None:
        """Count the time of the request from now on: it has not been passed on yet."""
        if self.current is not None:
            self.current = replace(self.current, asked_s=now)

    def forget(self) -> None:
        """Forget the request, so that it can be made again."""
        self.current = None
