"""The common frame of tasks: phases with handlers, operations, cancel and pause, one outcome."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, TypeAlias

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.act_queue import ActQueue
from navigation_core.tasks.conditions import Requester
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.waypoint_acts import ActOrder
from navigation_core.tasks.intents import Intent, Outcome, StopFirst
from navigation_core.tasks.observation import Observation, VehicleMode
from navigation_core.tasks.phases import STOPPING, Phase, Table, check_change
from navigation_core.tasks.task import Task

Answer: TypeAlias = Intent | Outcome | Phase | StopFirst | None
"""The answer of a phase, or the phase that follows; None to ask the one that has begun."""

Handler: TypeAlias = Callable[[Observation, float], Answer]

# A step changes the phase a few times at most; more would be a programming error.
_PHASE_CHANGES_MAX = 8
_CANCELED = Outcome(OutcomeCode.CANCELED, "The goal was cancelled.", None)


class PhasedTask(Task):
    """A :class:`~navigation_core.tasks.task.Task` whose phases answer for it.

    Its defaults fit a vehicle that flies by itself: no setpoint is sent, no mode is accepted, and
    nothing has to be resumed after a pause.
    """

    may_replan = False
    """Nothing takes long."""

    table: ClassVar[Table]
    """The phases that may follow each other; another one raises PhaseError."""

    def __init__(self, config: GotoConfig, phase: Phase) -> None:
        """Prepare.

        Args:
            config: tolerances and limits of time.
            phase: the first phase.
        """
        self._config = config
        self._phase = phase
        self._phase_since_s = 0.0
        self._requests = Requester(config.operation_timeout_s)
        self._acts = ActQueue()
        self._cancel_asked = False
        self._pause_asked = False
        self._outcome: Outcome | None = None
        self._path_enu_m: tuple[Vector3, ...] = ()
        # A phase that has data of its own gets its handler, with them, when it begins.
        self._handlers: dict[Phase, Handler] = {}

    # --- the task protocol -----------------------------------------------------------

    @property
    def phase(self) -> Phase:
        """The phase of the task."""
        return self._phase

    @property
    def commanded(self) -> KinematicState | None:
        """None: a successor begins where the vehicle is."""
        return None

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """None, as for the state."""
        return None

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The waypoints, where there are any: the vehicle flies by itself."""
        return self._path_enu_m

    @property
    def act(self) -> ActOrder | None:
        """The act that is due at a waypoint."""
        return self._acts.order

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""
        self._phase_since_s = now

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Ask the phases until one has an answer; after the end, return the outcome again."""
        if self._outcome is not None:
            return self._outcome
        ended: Outcome | None = None
        if self._cancel_asked and self._phase not in STOPPING:
            ended = self._stop(_CANCELED, observation, now)
        for _ in range(_PHASE_CHANGES_MAX):
            answer = ended or self._check(observation, now)
            answer = answer or self._handlers[self._phase](observation, now)
            if isinstance(answer, Outcome):
                return self._finish(answer, now)
            if isinstance(answer, Phase):
                self._begin_phase(answer, observation, now)
            elif isinstance(answer, StopFirst):
                ended = self._stop(answer.ending, observation, now)
            elif answer is not None:
                return answer
        raise RuntimeError(f"The task keeps changing phase; the last is {self._phase.name}.")

    def replan(self, observation: Observation, now: float) -> None:
        """Nothing takes long."""

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""
        self._cancel_asked = True

    def pause(self, now: float) -> Rejection | None:
        """Stop until :meth:`unpause`; before the flight, as soon as it begins."""
        self._pause_asked = True
        return None

    def unpause(self, now: float) -> None:
        """Resume after a pause."""
        self._pause_asked = False

    def resume_control(self, now: float) -> None:
        """Nothing is past: the vehicle was held in a mode of its own."""

    def postpone(self, now: float) -> None:
        """Count the time of the operation that was requested last from now on."""
        self._requests.postpone(now)

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """No: any change of mode that was not requested is somebody taking over."""
        return False

    # --- the state machine -----------------------------------------------------------

    def _check(self, observation: Observation, now: float) -> Answer:
        """Return what ends or suspends every phase; None to ask the present one."""
        return None

    def _finish(self, outcome: Outcome, now: float) -> Outcome:
        """End the task; return how."""
        self._outcome = outcome
        self._go(Phase.ENDED, now)
        return outcome

    def _begin_phase(self, phase: Phase, observation: Observation, now: float) -> None:
        """Begin the phase that an answer names."""
        self._go(phase, now)

    def _stop(self, ending: Outcome, observation: Observation, now: float) -> Outcome | None:
        """Begin to stop the vehicle, to end with an outcome; return it if nothing is to be stopped.

        Args:
            ending: the outcome.
            observation: what is known.
            now: time in seconds.
        """
        return ending

    def _go(self, phase: Phase, now: float) -> None:
        """Begin another phase."""
        check_change(self.table, self._phase, phase)
        self._phase = phase
        self._phase_since_s = now
        self._requests.forget()
