"""Asks for the speed of a leg by command."""

from __future__ import annotations

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import Requester
from navigation_core.tasks.intents import Intent, Outcome, Perform
from navigation_core.tasks.observation import Observation, TaskOperation


class LegSpeed:
    """Asks once for each speed; one that is rejected is kept as a sentence, and it flies on.

    Attributes:
        problem: why the last speed was rejected; empty if it was not.
    """

    def __init__(self, requests: Requester) -> None:
        """Begin without a speed; `requests` are the operations of the task."""
        self.problem = ""
        self._requests = requests
        self._asked_m_s: float | None = None

    def forget(self) -> None:
        """Ask again: the vehicle forgets its speed when it leaves the mode."""
        self._asked_m_s = None

    def ask(self, speed_m_s: float | None, observation: Observation, now: float) -> Intent | None:
        """Return the request for a speed; None once it is answered, or without a speed."""
        if speed_m_s is None or speed_m_s == self._asked_m_s:
            return None
        intent = Perform(TaskOperation.CHANGE_SPEED, speed_m_s=speed_m_s)
        answer = self._requests.perform(intent, OutcomeCode.MODE_REFUSED, observation, now)
        if isinstance(answer, Outcome):
            self.problem = f"It flew at its own speed. {answer.message}"
        elif answer is not None:
            return answer
        self._asked_m_s = speed_m_s
        self._requests.forget()
        return None
