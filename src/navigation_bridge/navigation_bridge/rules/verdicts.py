"""Verdicts of the rules about a goal. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from navigation_bridge.goals.active_goal import PositionDoubt
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome

__all__ = ["Abandon", "Doubt", "SendNothing", "Stop", "Verdict", "Warn", "Yield"]


@dataclass(frozen=True)
class Abandon:
    """Control of the vehicle is lost: the goal ends at once, and nothing is sent.

    Attributes:
        code: stable reason.
        text: a sentence.
    """

    code: OutcomeCode
    text: str


@dataclass(frozen=True)
class SendNothing:
    """Nothing is sent in this turn.

    Attributes:
        shown: whether a new status is reported.
    """

    shown: bool = True


@dataclass(frozen=True)
class Stop:
    """The task stops the vehicle, and the goal then ends with this outcome."""

    outcome: Outcome


@dataclass(frozen=True)
class Warn:
    """The goal continues with a warning.

    Attributes:
        rule: name of the rule.
        text: a sentence for the log and the goal's result; empty for none.
        fact: what the rule remembers of it; compared with the next time.
    """

    rule: str
    text: str
    fact: object


@dataclass(frozen=True)
class Doubt:
    """The doubt about the position has begun, changed or ended.

    Attributes:
        doubt: the new one; None once the position is reliable again.
        text: a sentence for clients and the log; empty for none.
        outcome: how the goal ends, or None.
    """

    doubt: PositionDoubt | None
    text: str
    outcome: Outcome | None = None


@dataclass(frozen=True)
class Yield:
    """A ground station made the vehicle hold: it is left alone until the station resumes it."""


Verdict: TypeAlias = Abandon | SendNothing | Stop | Warn | Doubt | Yield
