"""The times at which something is due for a goal."""

from __future__ import annotations

import math
from dataclasses import dataclass

# Period of what is watched less often than setpoints are sent.
_GUARD_PERIOD_S = 0.5


@dataclass
class GoalTimes:
    """The times of one goal, in seconds.

    Attributes:
        next_step_s: of the next step of the task.
        feedback_due_s: from which the next position triggers feedback.
        replan_s: from which the task may replan; infinite until its next setpoint is sent.
        guard_s: of the next look at what is watched twice a second.
        setpoint_s: of the last setpoint, or None.
    """

    next_step_s: float
    feedback_due_s: float
    replan_s: float = math.inf
    guard_s: float = -math.inf
    setpoint_s: float | None = None

    def due(self, now: float) -> None:
        """Have the task step at once."""
        self.next_step_s = min(self.next_step_s, now)

    def step_begins(self, period_s: float, now: float) -> None:
        """Set the time of the next step: the first after ``now`` on the grid of the last one."""
        following = self.next_step_s + period_s
        if following <= now:
            periods = math.floor((now - self.next_step_s) / period_s) + 1
            following = self.next_step_s + periods * period_s
        self.next_step_s = following

    def replan_begins(self) -> None:
        """The task replans; not again before its next setpoint is out."""
        self.replan_s = math.inf

    def setpoint_sent(self, may_replan: bool, now: float) -> None:
        """A setpoint of the task is out; the next turn is for a task that may replan."""
        self.setpoint_s = now
        if may_replan:
            self.replan_s = now

    def guard_begins(self, now: float) -> None:
        """Set the time of the next look at what is watched less often."""
        self.guard_s = now + _GUARD_PERIOD_S

    def feedback_given(self, period_s: float, now: float) -> None:
        """Set the time of the next feedback.

        It counts from now, not on a grid, so that feedback keeps in step with the positions.
        """
        self.feedback_due_s = now + period_s
