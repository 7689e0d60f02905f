"""The common base of flights to a point: state, phases and operations.

The parts of the flight are :mod:`.goto_departure` (until it flies), :mod:`.goto_stopping` and
:mod:`.goto`, each on top of the one before.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace

from navigation_core.geometry import KinematicState, Vector3, distance, wrap_angle
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import (
    COPTER,
    Fly,
    Intent,
    Observation,
    OperationKind,
    OperationStatus,
    Outcome,
    Perform,
    Progress,
    Rejection,
    Requirement,
    Status,
    Traits,
    VehicleMode,
    Wait,
)
from navigation_core.tasks.conditions import Dwell, RequestedOperation
from navigation_core.tasks.flying.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.flying.goto_phases import Phase, PhaseEvent, next_phase
from navigation_core.tasks.flying.goto_progress import GotoEstimator
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.avoider import Avoider
from navigation_core.tasks.leading.caution import Caution
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.pursuit import Pursuit
from navigation_core.tasks.measurement import is_airborne, is_located, measured_speed
from navigation_core.tasks.standstill import Standstill
from navigation_core.trajectories.trajectory import TrajectoryError

Answer = Intent | Outcome | None
PAUSABLE = frozenset({Phase.NAVIGATING, Phase.SETTLING, Phase.BLOCKED})
_DOUBTING = PAUSABLE | {Phase.PAUSED}
_FLYING = PAUSABLE | {Phase.HOLDING, Phase.PAUSED, Phase.BRAKING}
_STOPPING = frozenset({Phase.BRAKING, Phase.DISARMING})
# A step changes the phase a few times at most; more would be a programming error.
_PHASE_CHANGES_MAX = 8
# Two full turns at 1 m/s, per metre of their radius.
_TURNS_S_M = 4.0 * math.pi
# Over a shorter time positions do not tell whether the vehicle moves.
_STILL_MIN_S = 0.5


class GotoBase(ABC):
    """State and phases of the task of one goal. See :class:`~.base.Task`."""

    def __init__(
        self,
        goal: GotoGoal,
        config: GotoConfig,
        predecessor: KinematicState | None = None,
        predecessor_yaw: float | None = None,
        predecessor_time_s: float | None = None,
        traits: Traits = COPTER,
        avoidance: AvoidanceConfig | None = None,
    ) -> None:
        """Prepare.

        Args:
            goal: where to go; it is expected to have passed ``safety.check_target``.
            config: how to go there.
            predecessor: state of the setpoint that the replaced task sent last, from which
                this one goes on without a jump; None to begin at the measured state.
            predecessor_yaw: yaw of that setpoint.
            predecessor_time_s: when it was sent; None for the time of :meth:`start`.
            traits: what the vehicle can do.
            avoidance: how to keep away from obstacles; None to fly straight.
        """
        self._goal = goal
        self._config = config
        self._traits = traits
        self._follower = PathFollower(goal, config, predecessor, predecessor_yaw, avoidance, traits)
        self._avoider = None if avoidance is None else Avoider(avoidance, self._follower)
        self._caution = Caution(avoidance, traits, self._follower.limits)
        self._estimator = GotoEstimator(goal, config, self._follower.limits, traits)
        self._predecessor_time_s = predecessor_time_s
        self._last_step_s = 0.0
        self._phase = Phase.PREPARING
        self._phase_since_s = 0.0
        self._operation: RequestedOperation | None = None
        self._arming_asked = False
        self._armed_seen = False
        self._armed_for_us = False
        self._cancel_asked = False
        self._pause_asked = False
        # Whether the vehicle was held by its velocity, so that it is not where it was told to be.
        self._doubted = False
        self._ending: Outcome | None = None
        self._thought_failed: TrajectoryError | None = None
        self._outcome: Outcome | None = None
        self._arrival = Dwell(config.arrival_dwell_s)
        window_s = max(config.arrival_dwell_s, _STILL_MIN_S)
        self._still = Standstill(config.arrival_speed_m_s, window_s)
        self._arrival_radius_m = max(config.arrival_radius_m, traits.arrival_radius_m)
        self._pursuit = Pursuit(traits)
        # What cannot turn on the spot may have to go away first, and round once more.
        self._patience_s = config.settle_timeout_s + _TURNS_S_M * traits.turning_radius_m
        self._hold_time_s = 0.0
        # Time without a position since the flight last got nearer to its end.
        self._held_s = 0.0
        self._least_left_m = math.inf
        self._stopped = Standstill(config.stop_speed_m_s, config.stop_dwell_s)
        self._landed = Dwell(config.landed_timeout_s)
        self._handlers: dict[Phase, Callable[[Observation, float], Answer]] = {}

    # --- the task protocol -----------------------------------------------------------

    @property
    def requires(self) -> Requirement:
        """The preconditions of :meth:`start`."""
        return (
            Requirement.CONNECTION | Requirement.POSITION | Requirement.VELOCITY | Requirement.YAW
        )

    @property
    def phase(self) -> Phase:
        """The phase of the task."""
        return self._phase

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""
        return self._follower.commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        return self._follower.commanded_yaw

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path that is planned, in the map frame; the same object until it is replanned."""
        return self._follower.path_enu_m

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        self._phase_since_s = now
        self._last_step_s = now if self._predecessor_time_s is None else self._predecessor_time_s
        self._estimator.start(self._level(observation), self._follower)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended; after the end, the outcome again."""
        if self._outcome is not None:
            return self._outcome
        observation = self._level(observation)
        self._follower.dt_s = max(now - self._last_step_s, 0.0)
        self._last_step_s = now
        if self._follower.dt_s > self._config.step_gap_s:
            self._forget()
        self._armed_seen = self._armed_seen or observation.armed
        try:
            if self._thought_failed is not None:
                raise self._thought_failed
            self._interrupt(observation, now)
            answer = self._answer(observation, now)
        except TrajectoryError as error:
            answer = self._over(OutcomeCode.INTERNAL_ERROR, str(error), observation)
        braking = self._doubted and self._phase is Phase.BRAKING
        if isinstance(answer, Fly) and (observation.position_doubt or braking):
            answer = replace(answer, by_velocity=True)
            self._doubted = True
        if isinstance(answer, Fly):
            if self._follower.carrot is not None:
                self._follower.note(self._follower.carrot)
            answer = replace(answer, setpoint=self._caution.tempered(answer.setpoint, observation))
        elif isinstance(answer, Outcome):
            self._outcome = answer
            self._go(PhaseEvent.OVER, now)
        return answer

    def think(self, observation: Observation, now: float) -> None:
        """Look for another path around obstacles, if need be."""
        if self._avoider is None or self._phase is not Phase.NAVIGATING or self._cancel_asked:
            return
        if is_located(observation, self._config.position_stale_s) and not self._follower.is_stale:
            try:
                self._avoider.think(self._level(observation), now)
            except TrajectoryError as error:
                self._thought_failed = error

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""
        self._cancel_asked = True

    def pause(self, now: float) -> Rejection | None:
        """Brake and hold until :meth:`unpause`; before the flight, as soon as it begins."""
        self._pause_asked = True
        return None

    def unpause(self, now: float) -> None:
        """Resume after a pause."""
        self._pause_asked = False

    def take_up(self, now: float) -> None:
        """Take control again, and plan from where the vehicle is then."""
        if self._phase is Phase.PREPARING or self._phase in _STOPPING:
            return
        self._follower.forget_commanded()
        if self._avoider is not None:
            self._avoider.restart_clock()
        self._forget()
        self._go(PhaseEvent.NEEDS_CONTROL, now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Some autopilots leave the mode that obeys setpoints for the take-off, and hold after."""
        if self._traits.control_before_takeoff:
            return False
        before_flight = self._phase not in _FLYING
        return before_flight and mode in (VehicleMode.TAKE_OFF, VehicleMode.HOLD)

    def resume(self, observation: Observation, now: float) -> None:
        """Resume after a time without steps: the flight is replanned at the next step."""
        self._last_step_s = now
        self._forget()

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress."""
        elapsed_s = now - self._phase_since_s
        observation = self._level(observation)
        progress = self._estimator.progress(
            self._phase, elapsed_s, self._follower.carrot, observation
        )
        if self._avoider is None:
            return progress
        progress = replace(progress, replans=self._avoider.replans)
        if self._phase is not Phase.BLOCKED:
            return progress
        if not self._avoider.reason:
            # The first search, for a fraction of a second: no obstacle is known.
            return replace(progress, status=Status.NAVIGATING)
        return replace(progress, blocked=self._avoider.reason)

    # --- the state machine -----------------------------------------------------------

    def _level(self, observation: Observation) -> Observation:
        """Put what drives at the height of its goal: the home that heights count from moves."""
        position = observation.position_enu_m
        if self._traits.flies or position is None:
            return observation
        height_m = self._goal.position_enu_m[2]
        return replace(observation, position_enu_m=(position[0], position[1], height_m))

    def _interrupt(self, observation: Observation, now: float) -> None:
        """Stop for what was asked, or for a position that is in doubt."""
        if self._cancel_asked and self._phase not in _STOPPING:
            text = "The goal was cancelled."
            self._stop(observation, now, Outcome(OutcomeCode.CANCELED, text, None))
        elif observation.position_doubt and self._phase in _DOUBTING:
            self._follower.plan_stop(observation)
            self._go(PhaseEvent.POSITION_LOST, now)
        elif self._pause_asked and self._phase in PAUSABLE:
            self._follower.plan_stop(observation)
            self._go(PhaseEvent.PAUSE, now)

    def _answer(self, observation: Observation, now: float) -> Intent | Outcome:
        for _ in range(_PHASE_CHANGES_MAX):
            if self._ending is not None and self._phase not in _STOPPING:
                return self._ending
            answer = self._check_flight(observation, now)
            if answer is None:
                answer = self._handlers[self._phase](observation, now)
            if answer is not None:
                return answer
        raise RuntimeError(f"The task keeps changing phase; the last is {self._phase.name}.")

    def _go(self, event: PhaseEvent, now: float) -> None:
        """Move to the phase that an event leads to."""
        self._phase = next_phase(self._phase, event)
        self._phase_since_s = now
        self._operation = None
        self._arrival.reset()
        self._stopped.reset()

    def _forget(self) -> None:
        """Drop what a time without steps makes worthless."""
        self._follower.is_stale = True
        for memory in (self._arrival, self._still, self._stopped, self._landed):
            memory.reset()

    def _stop(self, observation: Observation, now: float, ending: Outcome) -> None:
        """Bring the vehicle to a stop that fits the phase, and then end with an outcome."""
        self._ending = ending
        inherited = self._phase is Phase.PREPARING and self._follower.commanded is not None
        # A replaced goal may have left something under way.
        on_ground = self._phase is Phase.TAKING_OFF or any(
            is_pending(observation, kind)
            for kind in (OperationKind.ARM, OperationKind.DISARM, OperationKind.TAKE_OFF)
        )
        if self._phase in _FLYING or (inherited and observation.in_control):
            self._follower.plan_stop(observation)
            self._go(PhaseEvent.STOP_IN_AIR, now)
        elif on_ground or self._arming_asked:
            self._armed_for_us = self._arming_asked or any(
                is_pending(observation, kind) for kind in (OperationKind.ARM, OperationKind.DISARM)
            )
            self._go(PhaseEvent.STOP_ON_GROUND, now)

    def _check_flight(self, observation: Observation, now: float) -> Answer:
        """Look for what ends or suspends every flight."""
        if self._phase not in _FLYING:
            return None
        if not observation.armed:
            text = "The vehicle was disarmed during the goal."
            return self._over(OutcomeCode.DISARMED, text, observation)
        if not observation.in_control:
            text = "The vehicle left the mode in which it follows setpoints."
            return self._over(OutcomeCode.PILOT_OVERRIDE, text, observation)
        on_ground = observation.airborne is False and self._traits.flies
        if self._landed.holds(on_ground, now):
            if self._ending is not None:
                return self._ended("The vehicle is on the ground.", observation)
            text = f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s."
            return self._over(OutcomeCode.LANDED, text, observation)
        return Wait() if on_ground else None

    @abstractmethod
    def _begin_flight(self, event: PhaseEvent, observation: Observation, now: float) -> None:
        """Plan the flight, and be in the phase that the event leads to."""

    # --- outcomes and operations -----------------------------------------------------

    def _over(self, code: OutcomeCode, text: str, observation: Observation) -> Outcome:
        return Outcome(code, text, self._error_m(observation))

    def _ended(self, text: str, observation: Observation) -> Outcome:
        """Return the outcome that the stop was for, and how the stop went."""
        assert self._ending is not None
        return self._over(self._ending.code, f"{self._ending.message} {text}", observation)

    def _timeout(self, what: str, observation: Observation) -> Outcome:
        error_m, speed_m_s = self._error_m(observation), measured_speed(observation)
        config = self._config
        text = (
            f"{what} within {self._patience_s:.0f} s: the vehicle is {error_m:.2f} m from the "
            f"target and moves at {speed_m_s:.2f} m/s; arrival requires at most "
            f"{self._arrival_radius_m:g} m and {config.arrival_speed_m_s:g} m/s."
        )
        yaw_error_rad = self._yaw_error_rad(observation)
        if yaw_error_rad > config.arrival_yaw_rad:
            text += (
                f" Its yaw error is {math.degrees(yaw_error_rad):.0f} degrees; arrival requires "
                f"at most {math.degrees(config.arrival_yaw_rad):.0f}."
            )
        return Outcome(OutcomeCode.TIMEOUT, text, error_m)

    def _perform(
        self, intent: Perform, refusal: OutcomeCode, observation: Observation, now: float
    ) -> Answer:
        """Ask for an operation; None once it is achieved."""
        if self._operation is None:
            stopping = intent.kind in (OperationKind.DISARM, OperationKind.HOLD)
            timeout_s = (
                self._config.cancel_timeout_s if stopping else self._config.operation_timeout_s
            )
            self._operation = RequestedOperation(intent, refusal, now, timeout_s)
            return intent  # A report that is there already is about an earlier request.
        return self._operation.check(observation, now)

    def _flies(self, observation: Observation) -> bool:
        """Whether it can move: what flies must be in the air, what drives only armed."""
        if not self._traits.flies:
            return observation.armed
        return observation.armed and is_airborne(observation, self._config.airborne_height_m)

    def _yaw_error_rad(self, observation: Observation) -> float:
        """Return how far the yaw is from the one that the goal names; 0 if it names none.

        What drives has the yaw of its path.
        """
        yaw, wanted = observation.yaw_enu_rad, self._goal.yaw_enu_rad
        if wanted is None or yaw is None or not self._traits.flies:
            return 0.0
        return abs(wrap_angle(yaw - wanted))

    def _error_m(self, observation: Observation) -> float | None:
        position = observation.position_enu_m
        return None if position is None else distance(position, self._goal.position_enu_m)


def is_pending(observation: Observation, kind: OperationKind) -> bool:
    """Whether an operation of this kind is under way."""
    report = observation.operation
    if report is None or report.kind is not kind:
        return False
    return report.state is OperationStatus.PENDING
