"""Follows velocity commands: moves while they come, holds when they stop, ends as goals end.

It neither arms nor takes off. The commands come with each observation; one that is older than the
timeout counts no more, so that a client that crashes, or a network that fails, stops the vehicle.
"""

from __future__ import annotations

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Located
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.steering.steered_task import SteeredTask
from navigation_core.tasks.steering.steersman import VelocityTerms

__all__ = ["FollowVelocity"]


class FollowVelocity(SteeredTask):
    """The task. See :class:`navigation_core.tasks.task.Task`."""

    never_starts = "velocity commands neither arm nor take off"

    def __init__(self, terms: VelocityTerms) -> None:
        """Prepare."""
        super().__init__(terms)
        self._timeout_s = terms.command_timeout_s
        self._command_s = 0.0  # of the last command that counted
        self._last: VelocityCommand | None = None

    def _begin_again(self, now: float) -> None:
        self._command_s = now

    def _wanted(
        self, here: Located, observation: Observation, now: float
    ) -> VelocityCommand | Outcome | None:
        command = observation.command
        if command is not None and now - command.time_s <= self._timeout_s:
            self._last, self._command_s = command, max(self._command_s, command.time_s)
            return command
        return self._idle(now)

    def _idle(self, now: float) -> Outcome | None:
        """Return the end of a goal that nobody sends commands to; the vehicle holds by then."""
        idle_s = self._config.settle_timeout_s
        if now - self._command_s <= idle_s:
            return None
        text = f"No velocity command has been received for {idle_s:g} s."
        if self._last is not None and self._last.is_zero:
            text = (
                f"The last velocity command was to stop; none has been received for {idle_s:g} s."
            )
            return Outcome(OutcomeCode.SUCCESS, text, None)
        return Outcome(OutcomeCode.TIMEOUT, text, None)
