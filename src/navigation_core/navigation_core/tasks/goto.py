"""Fly to a point: take control, arm, take off, fly there, settle, and say how it went.

The vehicle is only believed, never assumed: a phase ends when the vehicle's own state
shows that it has. While a take-off is under way or the vehicle stands on the ground no
setpoint is sent, because a real ArduCopter then stays on the ground (observed).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    add,
    distance,
    horizontal_norm,
    norm,
    scale,
    subtract,
)
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import (
    Fly,
    Intent,
    Observation,
    OperationKind,
    OperationState,
    Outcome,
    Perform,
    Progress,
    Requirement,
    Wait,
)
from navigation_core.tasks.carrot import Carrot
from navigation_core.tasks.conditions import Dwell, Operation, is_airborne, is_located
from navigation_core.tasks.goto_config import GotoConfig, GotoConfigError, GotoGoal
from navigation_core.tasks.goto_phases import Event, Phase, next_phase
from navigation_core.tasks.goto_progress import GotoEstimator
from navigation_core.trajectory import Limits, TrajectoryError, plan_stop, plan_to

__all__ = ["Goto", "GotoConfig", "GotoConfigError", "GotoGoal"]

_FLYING = frozenset({Phase.NAVIGATING, Phase.SETTLING, Phase.HOLDING, Phase.BRAKING})
_STOPPING = frozenset({Phase.BRAKING, Phase.DISARMING})
# A step changes the phase a few times at most; more would be a programming error.
_PHASE_CHANGES_MAX = 8
# Share of the goal's speed that is planned with: a vehicle sways about the speed it is told
# (measured 3 to 4 % after a change), and the goal's speed is a bound for what it really does.
_CRUISE_SHARE = 0.97
# Trajectory time that counts as progress.
_PROGRESS_S = 0.5
# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5

_Answer = Intent | Outcome | None


class Goto:
    """The task of one goal. See :class:`navigation_core.tasks.base.Task`."""

    def __init__(
        self,
        goal: GotoGoal,
        config: GotoConfig,
        predecessor: KinematicState | None = None,
        predecessor_yaw: float | None = None,
        predecessor_time_s: float | None = None,
    ) -> None:
        """Prepare.

        Args:
            goal: where to go; it is expected to have passed ``safety.check_target``.
            config: how to go there.
            predecessor: state of the setpoint that the replaced task sent last, from which
                this one goes on without a jump; None to begin at the measured state.
            predecessor_yaw: yaw of that setpoint.
            predecessor_time_s: when it was sent; None for the time of :meth:`start`.
        """
        self._goal = goal
        self._config = config
        asked_m_s = goal.max_speed_m_s
        self._limits: Limits = config.limits.with_speed(
            asked_m_s and asked_m_s * _CRUISE_SHARE
        )
        self._commanded = predecessor
        self._commanded_yaw = predecessor_yaw
        self._predecessor_time_s = predecessor_time_s
        self._estimator = GotoEstimator(goal, config, self._limits)
        self._phase = Phase.PREPARING
        self._phase_since_s = 0.0
        self._last_step_s = 0.0
        # Time that the setpoint has yet to walk in this step.
        self._dt_s = 0.0
        self._carrot: Carrot | None = None
        self._yaw_goal: float | None = goal.yaw_enu_rad
        self._operation: Operation | None = None
        self._arming_asked = False
        self._armed_seen = False
        self._cancel_asked = False
        self._replan_asked = False
        self._ending: Outcome | None = None
        self._outcome: Outcome | None = None
        self._arrival = Dwell(config.arrival_dwell_s)
        self._stopped = Dwell(config.stop_dwell_s)
        self._landed = Dwell(config.landed_timeout_s)
        self._progress_mark: tuple[float, float] = (0.0, 0.0)
        self._handlers: dict[Phase, Callable[[Observation, float], _Answer]] = {
            Phase.PREPARING: self._prepare,
            Phase.ARMING: self._arm,
            Phase.TAKING_OFF: self._take_off,
            Phase.NAVIGATING: self._navigate,
            Phase.SETTLING: self._settle,
            Phase.HOLDING: self._hold,
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
        return self._commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        return self._commanded_yaw

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        self._phase_since_s = now
        self._last_step_s = now if self._predecessor_time_s is None else self._predecessor_time_s
        self._estimator.start(observation)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Say what to do now, or how it ended; after the end, the outcome again."""
        if self._outcome is not None:
            return self._outcome
        self._dt_s = max(now - self._last_step_s, 0.0)
        self._last_step_s = now
        if self._dt_s > self._config.step_gap_s:
            self._forget()
        if self._cancel_asked and self._phase not in _STOPPING:
            self._stop(
                observation, now, Outcome(OutcomeCode.CANCELED, "The goal was cancelled.", None)
            )
        try:
            answer = self._answer(observation, now)
        except TrajectoryError as error:
            answer = Outcome(OutcomeCode.INTERNAL_ERROR, f"No trajectory: {error}", None)
        if isinstance(answer, Fly):
            setpoint = answer.setpoint
            self._commanded = KinematicState(
                setpoint.position_enu_m,
                setpoint.velocity_enu_m_s,
                setpoint.acceleration_enu_m_s2,
            )
            self._commanded_yaw = setpoint.yaw_enu_rad
        elif isinstance(answer, Outcome):
            self._outcome = answer
            self._go(Event.OVER, now)
        return answer

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""
        self._cancel_asked = True

    def resume(self, observation: Observation, now: float) -> None:
        """Go on after a time without steps: the flight is planned anew at the next step."""
        self._last_step_s = now
        self._forget()

    def progress(self, observation: Observation, now: float) -> Progress:
        """Say how far it is."""
        return self._estimator.progress(
            self._phase, now - self._phase_since_s, self._carrot, observation
        )

    # --- phases ----------------------------------------------------------------------

    def _answer(self, observation: Observation, now: float) -> Intent | Outcome:
        self._armed_seen = self._armed_seen or observation.armed
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

    def _check_flight(self, observation: Observation, now: float) -> Intent | Outcome | None:
        """Look for what ends or suspends every flight, whatever it is about."""
        if self._phase not in _FLYING:
            return None
        if not observation.armed:
            return Outcome(
                OutcomeCode.DISARMED,
                "The vehicle was disarmed while it should fly.",
                self._error_m(observation),
            )
        if not observation.in_control:
            return Outcome(
                OutcomeCode.PILOT_OVERRIDE,
                "The vehicle left the mode in which it obeys setpoints.",
                self._error_m(observation),
            )
        on_ground = observation.airborne is False
        if self._landed.holds(on_ground, now):
            if self._ending is not None:
                return self._ended(f"{self._ending.message} It is on the ground.", observation)
            return Outcome(
                OutcomeCode.LANDED,
                f"The vehicle has been on the ground for {self._config.landed_timeout_s:g} s "
                "while it should fly.",
                self._error_m(observation),
            )
        return Wait() if on_ground else None

    def _prepare(self, observation: Observation, now: float) -> _Answer:
        taking_off = self._reported(observation, OperationKind.TAKE_OFF)
        grounded = not is_airborne(observation, self._config.airborne_height_m)
        if not observation.armed and not self._config.may_arm:
            return Outcome(
                OutcomeCode.ARMING_NOT_ALLOWED,
                "The vehicle is disarmed and the server may not arm it; arm and take off "
                "yourself, or allow it to arm.",
                self._error_m(observation),
            )
        if not observation.in_control and not taking_off:
            result = self._perform(
                OperationKind.TAKE_CONTROL, OutcomeCode.MODE_REFUSED, observation, now
            )
            if result is not None:
                return result
        if taking_off or (observation.armed and grounded):
            self._go(Event.NEEDS_TAKEOFF, now)
        elif not observation.armed:
            self._go(Event.NEEDS_ARMING, now)
        else:
            self._begin_flight(Event.FLIES, observation, now)
        return None

    def _arm(self, observation: Observation, now: float) -> _Answer:
        self._arming_asked = True
        result = self._perform(OperationKind.ARM, OutcomeCode.ARMING_REFUSED, observation, now)
        if isinstance(result, Outcome) and observation.armed:
            self._stop(observation, now, result)
            return None
        if result is not None:
            return result
        self._go(Event.NEEDS_TAKEOFF, now)
        return None

    def _take_off(self, observation: Observation, now: float) -> _Answer:
        if self._armed_seen and not observation.armed:
            return Outcome(
                OutcomeCode.DISARMED,
                "The vehicle was disarmed before it had taken off.",
                self._error_m(observation),
            )
        result = self._perform(
            OperationKind.TAKE_OFF,
            OutcomeCode.TAKEOFF_REFUSED,
            observation,
            now,
            self._estimator.takeoff_height_m(observation.ground_enu_m),
        )
        if isinstance(result, Outcome):
            if self._arming_asked and not self._flies(observation):
                # Armed motors on the ground are a danger, and this task armed them.
                self._stop(observation, now, result)
                return None
            return result
        if result is not None:
            return result
        if observation.in_control:
            self._begin_flight(Event.FLIES, observation, now)
        else:
            self._go(Event.NEEDS_CONTROL, now)
        return None

    def _navigate(self, observation: Observation, now: float) -> _Answer:
        if not is_located(observation, self._config.position_stale_s):
            self._lose_position(now)
            return None
        if self._replan_asked or self._carrot is None:
            self._begin_flight(Event.REPLAN, observation, now)
        carrot = self._carrot
        assert carrot is not None
        carrot.advance(self._dt_s, _extrapolated(observation))
        if carrot.arrived:
            self._arrival.reset()
            self._go(Event.TRAJECTORY_ENDED, now)
            return None
        if carrot.travelled_s - self._progress_mark[1] >= _PROGRESS_S:
            self._progress_mark = (now, carrot.travelled_s)
        waited_s = now - self._progress_mark[0]
        turning = carrot.travelled_s >= carrot.trajectory.duration_s
        if waited_s > self._config.settle_timeout_s and not turning:
            return self._timeout(
                observation, f"no progress for {self._config.settle_timeout_s:g} s"
            )
        return Fly(carrot.setpoint)

    def _settle(self, observation: Observation, now: float) -> _Answer:
        if not is_located(observation, self._config.position_stale_s):
            self._lose_position(now)
            return None
        if self._replan_asked:
            self._begin_flight(Event.REPLAN, observation, now)
            return None
        error_m, speed_m_s = self._error_m(observation), _speed(observation)
        assert error_m is not None and speed_m_s is not None
        # A position that is repeated adds nothing to the dwell.
        measured_s = now - observation.position_age_s
        near = error_m <= self._config.arrival_radius_m
        if self._arrival.holds(near and speed_m_s <= self._config.arrival_speed_m_s, measured_s):
            return Outcome(
                OutcomeCode.SUCCESS, f"Arrived, {error_m:.2f} m from the target.", error_m
            )
        if now - self._phase_since_s > self._config.settle_timeout_s:
            return self._timeout(
                observation, f"not settled within {self._config.settle_timeout_s:g} s"
            )
        assert self._carrot is not None
        return Fly(self._carrot.setpoint)

    def _hold(self, observation: Observation, now: float) -> _Answer:
        if is_located(observation, self._config.position_stale_s):
            self._begin_flight(Event.REPLAN, observation, now)
            return None
        age_s = observation.position_age_s
        timeout_s = self._config.position_timeout_s
        # The age alone is not enough: the position may be new and its heading missing.
        if age_s > timeout_s or now - self._phase_since_s > timeout_s:
            return Outcome(
                OutcomeCode.NO_POSITION,
                f"The vehicle has given no valid position, velocity and yaw for {timeout_s:g} s.",
                None,
            )
        if self._carrot is None:
            return Wait()
        self._carrot.advance(self._dt_s, None)
        return Fly(self._carrot.setpoint)

    def _brake(self, observation: Observation, now: float) -> _Answer:
        assert self._ending is not None
        located = is_located(observation, self._config.position_stale_s)
        if self._replan_asked and located:
            self._begin_brake(Event.REPLAN, observation, now, commanded=None)
        speed_m_s = _speed(observation) if located else None
        carrot = self._carrot
        if carrot is not None:
            carrot.advance(self._dt_s, None)
        commanded = 0.0 if carrot is None else norm(carrot.state.velocity_enu_m_s)
        limit = self._config.stop_speed_m_s
        slow = speed_m_s is not None and speed_m_s < limit and commanded < limit
        if self._stopped.holds(slow, now - observation.position_age_s):
            text = f"{self._ending.message} The vehicle stands still."
            return self._ended(text, observation)
        if now - self._phase_since_s > self._config.cancel_timeout_s:
            moving = "an unknown speed" if speed_m_s is None else f"{speed_m_s:.2f} m/s"
            text = (
                f"{self._ending.message} The vehicle had not stopped after "
                f"{self._config.cancel_timeout_s:g} s: it moves at {moving}."
            )
            return self._ended(text, observation)
        return Wait() if carrot is None else Fly(carrot.setpoint)

    def _disarm(self, observation: Observation, now: float) -> _Answer:
        assert self._ending is not None
        if self._flies(observation):
            self._begin_brake(Event.STOP_IN_AIR, observation, now, commanded=None)
            return None
        result = self._perform(OperationKind.DISARM, self._ending.code, observation, now)
        if isinstance(result, Outcome):
            return self._ended(f"{self._ending.message} {result.message}", observation)
        if result is not None:
            return result
        return self._ended(f"{self._ending.message} The vehicle is disarmed.", observation)

    # --- beginning and ending --------------------------------------------------------

    def _begin_flight(self, event: Event, observation: Observation, now: float) -> None:
        """Plan to the target, from the last setpoint if that makes sense, and go."""
        located = is_located(observation, self._config.position_stale_s)
        start = self._commanded
        if self._replan_asked or (located and not self._is_near_commanded(observation)):
            start = None
        if start is None and located:
            start = _measured(observation)
            self._commanded_yaw = observation.yaw_enu_rad
            self._dt_s = 0.0
        self._go(event, now)
        self._carrot = None
        if start is None or self._commanded_yaw is None:
            return  # Nothing is known to begin with; the flight holds until there is.
        self._replan_asked = False
        self._progress_mark = (now, 0.0)
        if self._yaw_goal is None:
            self._yaw_goal = self._yaw_of_travel(start.position_enu_m, self._commanded_yaw)
        self._carrot = Carrot(
            plan_to(start, self._goal.position_enu_m, self._limits),
            self._config.tracking_error_max_m,
            self._commanded_yaw,
            self._yaw_goal,
        )

    def _lose_position(self, now: float) -> None:
        """Stop the setpoint where it is, because where the vehicle is is not known."""
        self._go(Event.POSITION_LOST, now)
        self._carrot = self._stopping_carrot(self._commanded, self._commanded_yaw)

    def _begin_brake(
        self,
        event: Event,
        observation: Observation,
        now: float,
        commanded: KinematicState | None,
    ) -> None:
        """Stop from the last setpoint if there is one, else from the measured state."""
        self._go(event, now)
        self._replan_asked = False
        self._stopped.reset()
        start, yaw = commanded, self._commanded_yaw
        if start is None and is_located(observation, self._config.position_stale_s):
            start, yaw = _measured(observation), observation.yaw_enu_rad
            self._dt_s = 0.0
        self._carrot = self._stopping_carrot(start, yaw)

    def _stopping_carrot(
        self, start: KinematicState | None, yaw_enu_rad: float | None
    ) -> Carrot | None:
        if start is None or yaw_enu_rad is None:
            return None
        trajectory = plan_stop(start, self._limits)
        return Carrot(trajectory, self._config.tracking_error_max_m, yaw_enu_rad, yaw_enu_rad)

    def _stop(self, observation: Observation, now: float, ending: Outcome) -> None:
        """Bring the vehicle to a stop that fits the phase, and then end with an outcome."""
        self._ending = ending
        if self._phase in _FLYING:
            commanded = None if self._replan_asked else self._commanded
            self._begin_brake(Event.STOP_IN_AIR, observation, now, commanded)
        elif self._phase is Phase.PREPARING:
            # Nothing was asked of the vehicle yet, but a replaced goal may have set it going.
            if self._reported(observation, OperationKind.TAKE_OFF):
                self._go(Event.STOP_ON_GROUND, now)
            elif self._commanded is not None and observation.in_control:
                self._begin_brake(Event.STOP_IN_AIR, observation, now, self._commanded)
        elif self._phase is Phase.TAKING_OFF or self._arming_asked:
            self._go(Event.STOP_ON_GROUND, now)

    def _ended(self, text: str, observation: Observation) -> Outcome:
        assert self._ending is not None
        return Outcome(self._ending.code, text, self._error_m(observation))

    def _timeout(self, observation: Observation, why: str) -> Outcome:
        error_m, speed_m_s = self._error_m(observation), _speed(observation)
        return Outcome(
            OutcomeCode.TIMEOUT,
            f"{why}: the vehicle is {error_m:.2f} m from the target and moves at "
            f"{speed_m_s:.2f} m/s; arrived means within {self._config.arrival_radius_m:g} m "
            f"and below {self._config.arrival_speed_m_s:g} m/s.",
            error_m,
        )

    def _forget(self) -> None:
        """Drop what a time without steps makes worthless."""
        self._replan_asked = True
        for dwell in (self._arrival, self._stopped, self._landed):
            dwell.reset()

    # --- operations and measurements -------------------------------------------------

    def _perform(
        self,
        kind: OperationKind,
        refusal: OutcomeCode,
        observation: Observation,
        now: float,
        height_m: float | None = None,
    ) -> _Answer:
        """Ask for an operation; None once it is achieved."""
        if self._operation is None:
            timeout_s = self._config.operation_timeout_s
            if kind is OperationKind.DISARM:
                timeout_s = self._config.cancel_timeout_s
            intent = Perform(kind, height_m)
            self._operation = Operation(intent, refusal, now, timeout_s)
            return intent  # A report that is there already is about an earlier request.
        return self._operation.check(observation, now)

    def _reported(self, observation: Observation, kind: OperationKind) -> bool:
        """Whether an operation of this kind is under way, asked for by a replaced goal."""
        report = observation.operation
        pending = report is not None and report.state is OperationState.PENDING
        return pending and report is not None and report.kind is kind

    def _flies(self, observation: Observation) -> bool:
        return observation.armed and is_airborne(observation, self._config.airborne_height_m)

    def _error_m(self, observation: Observation) -> float | None:
        position = observation.position_enu_m
        return None if position is None else distance(position, self._goal.position_enu_m)

    def _is_near_commanded(self, observation: Observation) -> bool:
        if self._commanded is None or observation.position_enu_m is None:
            return False
        error_m = distance(self._commanded.position_enu_m, observation.position_enu_m)
        return error_m <= _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _yaw_of_travel(self, start_enu_m: Vector3, yaw_enu_rad: float) -> float:
        """Return the heading from a point to the target, or the present one if it is close."""
        offset = subtract(self._goal.position_enu_m, start_enu_m)
        if horizontal_norm(offset) < self._config.yaw_distance_min_m:
            return yaw_enu_rad
        return math.atan2(offset[1], offset[0])


def _measured(observation: Observation) -> KinematicState:
    """Return the measured state, taken to be without acceleration."""
    assert observation.position_enu_m is not None
    assert observation.velocity_enu_m_s is not None
    return KinematicState(observation.position_enu_m, observation.velocity_enu_m_s)


def _extrapolated(observation: Observation) -> Vector3:
    """Return where the vehicle is now, from a position that is a little old."""
    measured = _measured(observation)
    moved = scale(measured.velocity_enu_m_s, observation.position_age_s)
    return add(measured.position_enu_m, moved)


def _speed(observation: Observation) -> float | None:
    velocity = observation.velocity_enu_m_s
    return None if velocity is None else norm(velocity)
