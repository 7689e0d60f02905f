"""Follows velocity commands: moves while they come, holds when they stop, ends as goals end.

It neither arms nor takes off. The commands come with each observation; one that is older than the
timeout counts no more, so that a client that crashes, or a network that fails, stops the vehicle.
"""

from __future__ import annotations

from navigation_core.tasks.conditions import Located
from navigation_core.tasks.inputs.velocity_command import VelocityCommand
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.steering.command_silence import CommandSilence
from navigation_core.tasks.steering.steered_task import SteeredTask
from navigation_core.tasks.steering.steersman import VelocityTerms

__all__ = ["FollowVelocity"]


class FollowVelocity(SteeredTask):
    """The task. See :class:`navigation_core.tasks.task.Task`."""

    never_starts = "velocity commands neither arm nor take off"

    def __init__(self, terms: VelocityTerms) -> None:
        """Prepare."""
        super().__init__(terms)
        self._silence = CommandSilence(
            terms.command_timeout_s, terms.flight.config.settle_timeout_s
        )

    def _begin_again(self, now: float) -> None:
        self._silence.begin(now)

    def _wanted(
        self, here: Located, observation: Observation, now: float
    ) -> VelocityCommand | Outcome | None:
        command = self._silence.current(observation.command, now)
        return self._silence.ended(now) if command is None else command
