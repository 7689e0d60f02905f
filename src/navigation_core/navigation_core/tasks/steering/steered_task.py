"""The base of tasks that steer a vehicle by a velocity that is new at each step.

They neither arm nor take off, hold while the position is unknown, and end at rest.
"""

from __future__ import annotations

from functools import partial

from navigation_core.geometry import KinematicState, norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Dwell, Located, is_located, located, stand_on_ground
from navigation_core.tasks.departure import Departure, is_pending
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.intents import Intent, Outcome, Perform, StopFirst, Wait
from navigation_core.tasks.observation import Observation, TaskOperation
from navigation_core.tasks.phased_task import Answer, PhasedTask
from navigation_core.tasks.phases import STOPPING, VELOCITY, Phase
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.steering.steersman import Steersman, VelocityTerms

__all__ = ["SteeredTask"]

_STANDS_M_S = 0.01


class SteeredTask(PhasedTask):
    """The base. See :class:`navigation_core.tasks.task.Task`."""

    table = VELOCITY
    never_starts = ""
    """A clause of the rejection on the ground: what neither arms nor takes off."""

    def __init__(self, terms: VelocityTerms) -> None:
        """Prepare."""
        config, traits = terms.flight.config, terms.flight.traits
        super().__init__(config, Phase.PREPARING)
        self._traits = traits
        self._steersman = Steersman(terms)
        self._departure = Departure(config, traits, self._requests)
        self._still = Standstill.of_stop(config, traits)
        self._landed = Dwell(config.landed_timeout_s)
        self._by_itself = terms.flight.handover.by_itself  # until the first change of phase
        self._last_step_s = self._dt_s = 0.0
        self._silent_s: float | None = None
        self._status = Status.PREPARING
        self._handlers = {
            Phase.PREPARING: self._prepare,
            Phase.NAVIGATING: self._follow,
            Phase.HOLDING: self._hold,
        }

    # --- the task protocol -----------------------------------------------------------

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""
        return self._steersman.commanded

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""
        return self._steersman.commanded_yaw_enu_rad

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        super().start(observation, now)
        self._last_step_s = now
        self._begin_again(now)

    def resume_control(self, now: float) -> None:
        """Take control again; setpoints sent before are past."""
        if self._phase not in STOPPING:
            self._forget()
            self._begin_again(now)
            self._go(Phase.PREPARING, now)

    def unpause(self, now: float) -> None:
        """Move again."""
        super().unpause(now)
        self._begin_again(now)

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the status; there is no distance and no time to a target."""
        status, why = self._status, self._steersman.held_back
        if status is Status.NAVIGATING and why:
            return Progress(Status.BLOCKED, 0.0, 0.0, blocked=why)
        return Progress(status, 0.0, 0.0)

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended; a gap between steps starts afresh."""
        self._dt_s = max(now - self._last_step_s, 0.0)
        self._last_step_s = now
        if self._dt_s > self._config.step_gap_s and self._outcome is None:
            self._dt_s = 0.0
            self._forget()
        return super().step(observation, now)

    # --- what steers it ---------------------------------------------------------------

    def _begin_again(self, now: float) -> None:
        """Count no time before this moment: the vehicle was not steered."""

    def _wanted(
        self, here: Located, observation: Observation, now: float
    ) -> VelocityCommand | Outcome | None:
        """Return the velocity that is wanted now, None to stand, or how it ends.

        Args:
            here: where the vehicle is.
            observation: the vehicle.
            now: time in seconds.
        """
        return None

    # --- the state machine -----------------------------------------------------------

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._by_itself = False

    def _forget_sent(self) -> None:
        """Begin again from the measured motion: what was sent is past."""
        self._steersman.forget()

    def _forget(self) -> None:
        self._forget_sent()
        self._still.reset()
        self._landed.reset()

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        asked = self._by_itself or is_pending(observation, TaskOperation.TAKE_CONTROL)
        led = self.commanded is not None
        self._still.reset()
        if led and observation.in_control:
            self._handlers[Phase.STOPPING] = partial(self._brake, ending)
            self._go(Phase.STOPPING, now)
        elif asked and self._departure.moves(observation):
            # It would get into a mode without setpoints, in which a PX4 soon returns by itself.
            self._handlers[Phase.RELEASING] = partial(self._release, ending)
            self._go(Phase.RELEASING, now)
        else:
            return ending
        return None

    def _check(self, observation: Observation, now: float) -> Answer:
        """Look for what ends every phase in which the vehicle is led."""
        if self._phase in (Phase.PREPARING, Phase.RELEASING):
            return None
        if not observation.armed:
            text = "The vehicle was disarmed during the goal."
            return Outcome(OutcomeCode.DISARMED, text, None)
        if not observation.in_control:
            text = "The vehicle left the mode in which it follows setpoints."
            return Outcome(OutcomeCode.PILOT_OVERRIDE, text, None)
        if self._is_down(observation, now):
            if self._phase is Phase.STOPPING:
                return None  # which ends for it
            timeout_s = self._config.landed_timeout_s
            text = f"The vehicle has been on the ground for {timeout_s:g} s."
            return Outcome(OutcomeCode.LANDED, text, None)
        if not self._on_ground(observation):
            return None
        self._forget_sent()
        return stand_on_ground(observation)

    def _on_ground(self, observation: Observation) -> bool:
        return observation.airborne is False and self._traits.flies

    def _is_down(self, observation: Observation, now: float) -> bool:
        return self._landed.holds(self._on_ground(observation), now)

    def _prepare(self, observation: Observation, now: float) -> Answer:
        self._status = Status.PREPARING
        if not self._departure.moves(observation):
            where = "not flying" if self._traits.flies else "disarmed"
            text = f"The vehicle is {where}; {self.never_starts}."
            return Outcome(OutcomeCode.NOT_FLYING, text, None)
        answer = self._departure.take_control(observation, now)
        if answer is not None:
            return answer
        self._begin_again(now)
        return Phase.NAVIGATING

    def _follow(self, observation: Observation, now: float) -> Answer:
        here = located(observation, self._config.position_stale_s)
        if here is None or observation.position_doubt:
            return Phase.HOLDING
        if self._pause_asked:
            self._status = Status.PAUSED
            self._begin_again(now)
            return self._lead(here, observation, None, now)
        wanted = self._wanted(here, observation, now)
        if isinstance(wanted, Outcome):
            return StopFirst(wanted)
        self._status = Status.HOLDING if wanted is None else Status.NAVIGATING
        return self._lead(here, observation, wanted, now)

    def _hold(self, observation: Observation, now: float) -> Answer:
        """Stand by velocity until it is known again where the vehicle is."""
        self._status = Status.HOLDING
        is_known = is_located(observation, self._config.position_stale_s)
        if is_known and not observation.position_doubt:
            self._forget()
            self._begin_again(now)
            return Phase.NAVIGATING
        if is_known:
            self._phase_since_s = now  # for how long it may be in doubt is not ours
        timeout_s = self._config.position_timeout_s
        if now - self._phase_since_s > timeout_s:
            text = (
                f"The vehicle has reported no valid position, velocity and yaw for {timeout_s:g} s."
            )
            return Outcome(OutcomeCode.NO_POSITION, text, None)
        return self._steersman.hold(observation)

    def _brake(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        self._status = Status.CANCELLING
        if self._is_down(observation, now):
            return ending.after("The vehicle is on the ground.")
        still = self._still.holds(observation, self._config.position_stale_s)
        sent = self.commanded
        sent_m_s = 0.0 if sent is None else norm(sent.velocity_enu_m_s)
        if still and sent_m_s < _STANDS_M_S:
            return ending.after("The vehicle has stopped.")
        timeout_s = self._config.cancel_timeout_s
        if now - self._phase_since_s > timeout_s:
            return ending.after(self._still.failure(timeout_s))
        here = located(observation, self._config.position_stale_s)
        if here is None or observation.position_doubt:
            return self._steersman.hold(observation)
        return self._stand(here, observation)

    def _release(self, ending: Outcome, observation: Observation, now: float) -> Answer:
        self._status = Status.CANCELLING
        answer = self._requests.perform(
            Perform(TaskOperation.HOLD),
            ending.code,
            observation,
            now,
            self._config.cancel_timeout_s,
        )
        if isinstance(answer, Outcome):
            return ending.after(f"{answer.message} It may still be moving.")
        if answer is not None:
            return answer
        if self._still.holds(observation, self._config.position_stale_s):
            return ending.after("The vehicle holds.")
        timeout_s = self._config.cancel_timeout_s
        if now - self._phase_since_s > timeout_s:
            return ending.after(self._still.failure(timeout_s))
        return Wait()

    def _stand(self, here: Located, observation: Observation) -> Intent:
        """Come to a stop, and stand."""
        return self._steersman.lead(here, observation, None, self._dt_s)

    def _lead(
        self, here: Located, observation: Observation, command: VelocityCommand | None, now: float
    ) -> Intent | Outcome:
        answer = self._steersman.lead(here, observation, command, self._dt_s)
        obstruction, patience_s = self._steersman.obstruction, self._steersman.sensor_patience_s
        if not obstruction.is_silent:
            self._silent_s = None
            return answer
        if self._silent_s is None:
            self._silent_s = now
        if now - self._silent_s <= patience_s:
            return answer
        text = f"There was no obstacle data for {patience_s:g} s. {obstruction.reason}"
        return Outcome(OutcomeCode.NO_OBSTACLE_DATA, text, None)
