"""The interface of tasks: observations, intents and outcomes.

A task is a pure state machine. Its owner calls :meth:`Task.step` at the setpoint rate with
what is known about the vehicle, carries out the intent that comes back, and stops calling
once the answer is an outcome. Positions are in the ENU map frame, times are seconds of
whatever clock the owner uses.
"""

from __future__ import annotations

from typing import Protocol

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.outcomes import Rejection
from navigation_core.tasks.inputs.waypoint_acts import ActOrder
from navigation_core.tasks.intents import Intent, Outcome
from navigation_core.tasks.observation import Observation, VehicleMode
from navigation_core.tasks.progress import Progress


class Task(Protocol):
    """Something that flies the vehicle towards an aim."""

    @property
    def commanded(self) -> KinematicState | None:
        """State of the setpoint sent last, for a successor; None before the first."""

    @property
    def commanded_yaw_enu_rad(self) -> float | None:
        """Yaw of the setpoint sent last; None before the first."""

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """The path that is planned, in the map frame; the same object until it is replanned."""

    @property
    def act(self) -> ActOrder | None:
        """The act that the vehicle is asked for beside the flight, until it has answered."""

    @property
    def may_replan(self) -> bool:
        """Whether :meth:`replan` has anything to do."""

    def start(self, observation: Observation, now: float) -> None:
        """Begin."""

    def step(self, observation: Observation, now: float) -> Intent | Outcome:
        """Return what to do now, or how it ended."""

    def replan(self, observation: Observation, now: float) -> None:
        """Search for another path, once the setpoint of the step before is out; steps fly it."""

    def cancel(self, now: float) -> None:
        """Ask for an early end; the steps that follow bring the vehicle to a stop."""

    def pause(self, now: float) -> Rejection | None:
        """Stop and hold until :meth:`unpause`; says why if this cannot be paused."""

    def unpause(self, now: float) -> None:
        """Resume after a pause."""

    def resume_control(self, now: float) -> None:
        """Resume with a vehicle that another station had stopped in another mode.

        Called before the next step; where the task was, and what it commanded, is past.
        """

    def postpone(self, now: float) -> None:
        """Count the time of the operation that was requested last from now on: it has to wait."""

    def accepts_mode(self, mode: VehicleMode) -> bool:
        """Whether the vehicle may get into this mode by itself at this point of the task.

        Any other change of mode that nobody here asked for is somebody taking over.
        """

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress."""
