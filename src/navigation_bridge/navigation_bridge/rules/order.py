"""The rules in their order."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules import battery, bounds, failsafe, link, position, stations, takeover
from navigation_bridge.rules.verdict import Verdict
from navigation_bridge.snapshot import Snapshot

__all__ = ["RULES", "Rule"]


class Rule(NamedTuple):
    """A rule about a goal.

    Attributes:
        judge: returns its verdict, or None.
        guards: whether it watches the flight: twice a second, and not while the goal is being
            ended; all others are asked at each step.
    """

    judge: Callable[[Snapshot, ActiveGoal], Verdict | None]
    guards: bool = False


RULES: tuple[Rule, ...] = (
    # Somebody else has the vehicle: nothing is sent, whatever else is the matter.
    Rule(takeover.judge),
    # The vehicle is not heard, or does not hear.
    Rule(link.judge_silence),
    Rule(link.judge_answers),
    Rule(link.judge_suspension),
    Rule(link.judge_request),
    # A doubtful position comes first of the reasons to stop: the others rely on it.
    Rule(position.judge),
    # The vehicle's own reason, before reasons that are concluded from its position.
    Rule(failsafe.judge, guards=True),
    Rule(bounds.judge_volume, guards=True),
    Rule(bounds.judge_fence, guards=True),
    Rule(battery.judge, guards=True),
    # Last: a goal that is stopped for a reason above ends with that one.
    Rule(stations.judge),
)
"""The first `Abandon` or `SendNothing` ends a turn; all else is applied, in this order."""
