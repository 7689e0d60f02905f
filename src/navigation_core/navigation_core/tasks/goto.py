"""Fly to a point: take control, arm, take off, fly there, settle, and say how it went.

The vehicle is believed, never assumed: a phase ends when the vehicle's own state shows
that it has. While a take-off is under way or the vehicle stands on the ground no setpoint
is sent, because a real ArduCopter then stays on the ground (observed).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from navigation_core.geometry import KinematicState, Vector3, distance, norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import (
    COPTER,
    Fly,
    Intent,
    Observation,
    OperationKind,
    OperationState,
    Outcome,
    Perform,
    Progress,
    Rejection,
    Requirement,
    Setpoint,
    Traits,
    VehicleMode,
    Wait,
)
from navigation_core.tasks.carrot import Carrot
from navigation_core.tasks.conditions import Dwell, Operation
from navigation_core.tasks.flight import Flight
from navigation_core.tasks.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.goto_phases import Event, Phase, next_phase
from navigation_core.tasks.goto_progress import GotoEstimator
from navigation_core.tasks.measurement import (
    is_airborne,
    is_located,
    measured_speed,
    measured_state,
)
from navigation_core.tasks.pursuit import Pursuer, Pursuit, Way
from navigation_core.trajectory import TrajectoryError

__all__ = ["Goto", "GotoConfig", "GotoConfigError", "GotoGoal"]

_Answer = Intent | Outcome | None
_PAUSABLE = frozenset({Phase.NAVIGATING, Phase.SETTLING})
_FLYING = _PAUSABLE | {Phase.HOLDING, Phase.PAUSED, Phase.BRAKING}
_STOPPING = frozenset({Phase.BRAKING, Phase.DISARMING})
# A step changes the phase a few times at most; more would be a programming error.
_PHASE_CHANGES_MAX = 8
# Two full turns at 1 m/s, per metre of their radius.
_TURNS_S_M = 4.0 * math.pi


class Goto:
    """The task of one goal, and the base of routes. See :class:`~.base.Task`."""

    def __init__(
        self,
        goal: GotoGoal,
        config: GotoConfig,
        predecessor: KinematicState | None = None,
        predecessor_yaw: float | None = None,
        predecessor_time_s: float | None = None,
        traits: Traits = COPTER,
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
        """
        self._goal = goal
        self._config = config
        self._traits = traits
        self._flight = Flight(goal, config, predecessor, predecessor_yaw)
        self._estimator = GotoEstimator(goal, config, self._flight.limits, traits)
        self._predecessor_time_s = predecessor_time_s
        self._last_step_s = 0.0
        self._phase = Phase.PREPARING
        self._phase_since_s = 0.0
        self._operation: Operation | None = None
        self._arming_asked = False
        self._armed_seen = False
        self._armed_for_us = False
        self._cancel_asked = False
        self._pause_asked = False
        self._ending: Outcome | None = None
        self._outcome: Outcome | None = None
        self._arrival = Dwell(config.arrival_dwell_s)
        self._arrival_radius_m = max(config.arrival_radius_m, traits.arrival_radius_m)
        self._pursuit = Pursuit(traits)
        # What cannot turn on the spot may have to go away first, and round once more.
        self._patience_s = config.settle_timeout_s + _TURNS_S_M * traits.turning_radius_m
        self._hold_time_s = 0.0
        self._stopped = Dwell(config.stop_dwell_s)
        self._landed = Dwell(config.landed_timeout_s)
        self._handlers: dict[Phase, Callable[[Observation, float], _Answer]] = {
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.TAKING_OFF: self._take_off,
            Phase.NAVIGATING: self._navigate,
            Phase.SETTLING: self._settle,
            Phase.HOLDING: self._hold,
            Phase.PAUSED: self._stay,
            Phase.BRAKING: self._brake,
            Phase.DISARMING: self._disarm,
        }

    # --- the task protocol -----------------------------------------------------------

    @property
    def requires(self) -> Requirement:
        """What must be there before :meth:`start`."""
        return (
            Requirement.CONNECTION | Requirement.POSITION | Requirement.VELOCITY | Requirement.YAW
        )

    @property
    def phase(self) -> Phase:
        """What the task is about."""
        return self._phase

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""
        return self._flight.commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        return self._flight.commanded_yaw

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The way that is planned, in the map frame; the same object until it is planned anew."""
        return self._flight.path_enu_m

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        self._phase_since_s = now
        self._last_step_s = now if self._predecessor_time_s is None else self._predecessor_time_s
        self._estimator.start(self._level(observation))

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Say what to do now, or how it ended; after the end, the outcome again."""
        if self._outcome is not None:
            return self._outcome
        observation = self._level(observation)
        self._flight.dt_s = max(now - self._last_step_s, 0.0)
        self._last_step_s = now
        if self._flight.dt_s > self._config.step_gap_s:
            self._forget()
        self._armed_seen = self._armed_seen or observation.armed
        try:
            if self._cancel_asked and self._phase not in _STOPPING:
                text = "The goal was cancelled."
                self._stop(observation, now, Outcome(OutcomeCode.CANCELED, text, None))
            elif self._pause_asked and self._phase in _PAUSABLE:
                self._flight.plan_stop(observation)
                self._go(Event.PAUSE, now)
            answer = self._answer(observation, now)
        except TrajectoryError as error:
            answer = self._over(OutcomeCode.INTERNAL_ERROR, str(error), observation)
        if isinstance(answer, Fly) and self._flight.carrot is not None:
            self._flight.note(self._flight.carrot.setpoint)
        elif isinstance(answer, Outcome):
            self._outcome = answer
            self._go(Event.OVER, now)
        return answer

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""
        self._cancel_asked = True

    def pause(self, now: float) -> Rejection | None:
        """Brake and hold until :meth:`unpause`; before the flight, as soon as it begins."""
        self._pause_asked = True
        return None

    def unpause(self, now: float) -> None:
        """Go on after a pause."""
        self._pause_asked = False

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Some autopilots leave the mode that obeys setpoints for the take-off, and hold after."""
        if self._traits.control_before_takeoff:
            return False
        before_flight = self._phase not in _FLYING
        return before_flight and mode in (VehicleMode.TAKE_OFF, VehicleMode.HOLD)

    def resume(self, observation: Observation, now: float) -> None:
        """Go on after a time without steps: the flight is planned anew at the next step."""
        self._last_step_s = now
        self._forget()

    def progress(self, observation: Observation, now: float) -> Progress:
        """Say how far it is."""
        elapsed_s = now - self._phase_since_s
        observation = self._level(observation)
        return self._estimator.progress(self._phase, elapsed_s, self._flight.carrot, observation)

    # --- the state machine -----------------------------------------------------------

    def _level(self, observation: Observation) -> Observation:
        """Put what drives at the height of its goal: the home that heights count from moves."""
        position = observation.position_enu_m
        if self._traits.flies or position is None:
            return observation
        height_m = self._goal.position_enu_m[2]
        return replace(observation, position_enu_m=(position[0], position[1], height_m))

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

    def _go(self, event: Event, now: float) -> None:
        """Move to the phase that an event leads to."""
        self._phase = next_phase(self._phase, event)
        self._phase_since_s = now
        self._operation = None
        self._arrival.reset()
        self._stopped.reset()

    def _forget(self) -> None:
        """Drop what a time without steps makes worthless."""
        self._flight.is_stale = True
        for dwell in (self._arrival, self._stopped, self._landed):
            dwell.reset()

    def _stop(self, observation: Observation, now: float, ending: Outcome) -> None:
        """Bring the vehicle to a stop that fits the phase, and then end with an outcome."""
        self._ending = ending
        inherited = self._phase is Phase.PREPARING and self._flight.commanded is not None
        # A replaced goal may have left something under way.
        on_ground = self._phase is Phase.TAKING_OFF or any(
            _is_pending(observation, kind)
            for kind in (OperationKind.ARM, OperationKind.DISARM, OperationKind.TAKE_OFF)
        )
        if self._phase in _FLYING or (inherited and observation.in_control):
            self._flight.plan_stop(observation)
            self._go(Event.STOP_IN_AIR, now)
        elif on_ground or self._arming_asked:
            self._armed_for_us = self._arming_asked or any(
                _is_pending(observation, kind) for kind in (OperationKind.ARM, OperationKind.DISARM)
            )
            self._go(Event.STOP_ON_GROUND, now)

    def _check_flight(self, observation: Observation, now: float) -> _Answer:
        """Look for what ends or suspends every flight."""
        if self._phase not in _FLYING:
            return None
        if not observation.armed:
            text = "The vehicle was disarmed while it should fly."
            return self._over(OutcomeCode.DISARMED, text, observation)
        if not observation.in_control:
            text = "The vehicle left the mode in which it obeys setpoints."
            return self._over(OutcomeCode.PILOT_OVERRIDE, text, observation)
        on_ground = observation.airborne is False and self._traits.flies
        if self._landed.holds(on_ground, now):
            if self._ending is not None:
                return self._ended("The vehicle is on the ground.", observation)
            text = f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s."
            return self._over(OutcomeCode.LANDED, text, observation)
        return Wait() if on_ground else None

    # --- before the flight -----------------------------------------------------------

    def _prepare(self, observation: Observation, now: float) -> _Answer:
        if not observation.armed and not self._config.may_arm:
            text = (
                "The vehicle is disarmed and may not be armed by this server; arm it and take "
                "off yourself, or allow the server to arm."
            )
            return self._over(OutcomeCode.ARMING_NOT_ALLOWED, text, observation)
        if _is_pending(observation, OperationKind.DISARM):
            return Perform(OperationKind.DISARM)  # of a replaced goal; it cannot be taken back
        # A take-off that a replaced goal began goes on.
        taking_off = _is_pending(observation, OperationKind.TAKE_OFF)
        needs_control = self._traits.control_before_takeoff or self._flies(observation)
        if not observation.in_control and not taking_off and needs_control:
            answer = self._perform(
                Perform(OperationKind.TAKE_CONTROL), OutcomeCode.MODE_REFUSED, observation, now
            )
            if answer is not None:
                return answer
        if self._flies(observation) and not taking_off:
            self._begin_flight(Event.FLIES, observation, now)
            return None
        self._flight.forget_commanded()  # What was sent in the air is no start on the ground.
        if observation.armed or taking_off:
            self._go(Event.NEEDS_TAKEOFF, now)
        else:
            self._go(Event.NEEDS_ARMING, now)
        return None

    def _arm(self, observation: Observation, now: float) -> _Answer:
        self._arming_asked = True
        answer = self._perform(
            Perform(OperationKind.ARM), OutcomeCode.ARMING_REFUSED, observation, now
        )
        report = observation.operation
        refused = report is not None and report.state is OperationState.REFUSED
        if isinstance(answer, Outcome) and (observation.armed or not refused):
            # Without a clear refusal the motors may be turning, now or in a moment.
            self._stop(observation, now, answer)
            return None
        if answer is not None:
            return answer
        self._go(Event.NEEDS_TAKEOFF if self._traits.flies else Event.NEEDS_CONTROL, now)
        return None

    def _take_off(self, observation: Observation, now: float) -> _Answer:
        if self._armed_seen and not observation.armed:
            text = "The vehicle was disarmed before it had taken off."
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
            self._begin_flight(Event.FLIES, observation, now)
        else:
            self._go(Event.NEEDS_CONTROL, now)
        return None

    # --- the flight ------------------------------------------------------------------

    def _begin_flight(self, event: Event, observation: Observation, now: float) -> None:
        if self._phase not in _PAUSABLE:
            self._pursuit.forget()
        self._flight.plan_to_goal(observation)
        self._go(event, now)

    def _navigate(self, observation: Observation, now: float) -> _Answer:
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation, now)
        if self._flight.is_stale or self._flight.carrot is None:
            self._begin_flight(Event.REPLAN, observation, now)
        carrot = self._flight.carrot
        assert carrot is not None
        here_enu_m = measured_state(observation).position_enu_m
        self._flight.walk(here_enu_m if self._traits.flies else carrot.only_behind(here_enu_m))
        self._note_place(observation)
        if carrot.arrived:
            self._go(Event.TRAJECTORY_ENDED, now)
            return None
        if carrot.stalled_s > self._patience_s:
            return self._timeout("It made no progress", observation)
        return Fly(self._setpoint(carrot, observation))

    def _note_place(self, observation: Observation) -> None:
        """Take note of where the vehicle has come to on its way."""

    def _settle(self, observation: Observation, now: float) -> _Answer:
        if not is_located(observation, self._config.position_stale_s):
            return self._lose_position(observation, now)
        if self._flight.is_stale:
            self._begin_flight(Event.REPLAN, observation, now)
            return None
        error_m = self._error_m(observation)
        speed_m_s = measured_speed(observation)
        assert error_m is not None
        assert speed_m_s is not None
        near = error_m <= self._arrival_radius_m
        slow = speed_m_s <= self._config.arrival_speed_m_s
        # A position that is only repeated adds nothing to the dwell.
        if self._arrival.holds(near and slow, now - observation.position_age_s):
            return self._arrived(error_m, observation, now)
        if now - self._phase_since_s > self._patience_s + self._hold_time_s:
            return self._timeout("It did not settle", observation)
        assert self._flight.carrot is not None
        return Fly(self._setpoint(self._flight.carrot, observation))

    def _setpoint(self, carrot: Carrot, observation: Observation) -> Setpoint:
        """Return what leads the vehicle along: the carrot, or a velocity after it."""
        if self._traits.flies:
            return carrot.setpoint
        here, yaw = measured_state(observation), observation.yaw_enu_rad
        assert yaw is not None
        return self._pursuit.follow(
            carrot.state,
            None if carrot.ended else Way(carrot.course_enu, carrot.distance_remaining_m),
            Pursuer(here.position_enu_m, here.velocity_enu_m_s, yaw),
            self._flight.limits,
            self._arrival_radius_m,
            observation.time_s,
        )

    def _arrived(self, error_m: float, observation: Observation, now: float) -> _Answer:
        """End, or go on; the vehicle has been near and slow for its time."""
        return Outcome(OutcomeCode.SUCCESS, f"Arrived, {error_m:.2f} m from the target.", error_m)

    def _lose_position(self, observation: Observation, now: float) -> _Answer:
        """Stop the setpoint, because where the vehicle is is not known."""
        self._flight.plan_stop(observation)
        self._go(Event.POSITION_LOST, now)
        return None

    def _hold(self, observation: Observation, now: float) -> _Answer:
        if is_located(observation, self._config.position_stale_s):
            self._begin_flight(Event.REPLAN, observation, now)
            return None
        timeout_s = self._config.position_timeout_s
        age_s = observation.position_age_s
        too_old = math.isfinite(age_s) and age_s > timeout_s
        # The age alone is not enough: the position may be new and its heading missing.
        if too_old or now - self._phase_since_s > timeout_s:
            text = f"The vehicle has given no valid position, velocity and yaw for {timeout_s:g} s."
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        self._flight.walk(None)
        carrot = self._flight.carrot
        return Wait() if carrot is None else Fly(carrot.setpoint)

    def _stay(self, observation: Observation, now: float) -> _Answer:
        """Stand still where the pause came, until it is over."""
        located = is_located(observation, self._config.position_stale_s)
        if not located:
            return self._lose_position(observation, now)
        if not self._pause_asked:
            self._begin_flight(Event.REPLAN, observation, now)
            return None
        if self._flight.is_stale or self._flight.carrot is None:
            self._flight.plan_stop(observation)
        self._flight.walk(None)
        carrot = self._flight.carrot
        return Wait() if carrot is None else Fly(carrot.setpoint)

    # --- stopping --------------------------------------------------------------------

    def _brake(self, observation: Observation, now: float) -> _Answer:
        located = is_located(observation, self._config.position_stale_s)
        if located and (self._flight.is_stale or self._flight.carrot is None):
            self._flight.plan_stop(observation)
        self._flight.walk(None)
        carrot = self._flight.carrot
        speed_m_s = measured_speed(observation) if located else None
        commanded = 0.0 if carrot is None else norm(carrot.state.velocity_enu_m_s)
        limit = self._config.stop_speed_m_s
        slow = speed_m_s is not None and max(speed_m_s, commanded) < limit
        if self._stopped.holds(slow, now - observation.position_age_s):
            return self._ended("The vehicle stands still.", observation)
        timeout_s = self._config.cancel_timeout_s
        if now - self._phase_since_s > timeout_s:
            speed = "an unknown speed" if speed_m_s is None else f"{speed_m_s:.2f} m/s"
            text = f"The vehicle had not stopped after {timeout_s:g} s; it moves at {speed}."
            return self._ended(text, observation)
        return Wait() if carrot is None else Fly(carrot.setpoint)

    def _disarm(self, observation: Observation, now: float) -> _Answer:
        assert self._ending is not None
        holds = not self._armed_for_us and self._operation is not None
        if self._traits.flies and self._flies(observation) and not holds:
            self._flight.plan_stop(observation)
            self._go(Event.STOP_IN_AIR, now)
            return None
        if not self._armed_for_us:
            return self._cut_take_off(observation, now)
        answer = self._perform(Perform(OperationKind.DISARM), self._ending.code, observation, now)
        if answer is None:
            return self._ended("The vehicle is disarmed.", observation)
        if isinstance(answer, Outcome):
            return self._ended(f"{answer.message} It may still be armed.", observation)
        return answer

    def _cut_take_off(self, observation: Observation, now: float) -> _Answer:
        """Stop a take-off of a vehicle that somebody else armed: theirs to disarm."""
        assert self._ending is not None
        answer = self._perform(Perform(OperationKind.HOLD), self._ending.code, observation, now)
        if answer is None:
            return self._ended("The vehicle holds; who armed it may disarm it.", observation)
        if isinstance(answer, Outcome):
            return self._ended(f"{answer.message} It is still armed.", observation)
        return answer

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
            f"{what} within {self._patience_s:.0f} s: the vehicle is {error_m:.2f} m from "
            f"the target and moves at {speed_m_s:.2f} m/s, where {self._arrival_radius_m:g} m "
            f"and {config.arrival_speed_m_s:g} m/s count as arrived."
        )
        return Outcome(OutcomeCode.TIMEOUT, text, error_m)

    def _perform(
        self, intent: Perform, refusal: OutcomeCode, observation: Observation, now: float
    ) -> _Answer:
        """Ask for an operation; None once it is achieved."""
        if self._operation is None:
            stopping = intent.kind in (OperationKind.DISARM, OperationKind.HOLD)
            timeout_s = (
                self._config.cancel_timeout_s if stopping else self._config.operation_timeout_s
            )
            self._operation = Operation(intent, refusal, now, timeout_s)
            return intent  # A report that is there already is about an earlier request.
        return self._operation.check(observation, now)

    def _flies(self, observation: Observation) -> bool:
        """Whether it can move: what flies must be in the air, what drives only armed."""
        if not self._traits.flies:
            return observation.armed
        return observation.armed and is_airborne(observation, self._config.airborne_height_m)

    def _error_m(self, observation: Observation) -> float | None:
        position = observation.position_enu_m
        return None if position is None else distance(position, self._goal.position_enu_m)


def _is_pending(observation: Observation, kind: OperationKind) -> bool:
    """Whether an operation of this kind is under way."""
    report = observation.operation
    if report is None or report.kind is not kind:
        return False
    return report.state is OperationState.PENDING
