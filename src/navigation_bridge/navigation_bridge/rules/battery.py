"""A battery that runs low during the goal."""

from __future__ import annotations

from navigation_bridge.configuration.settings import BatteryPolicy
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules.verdict import Stop, Verdict, Warn
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.supervision.battery_forecast import reported_low, runs_low
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome

_RULE = "battery"


def judge(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return the end of a goal, or a warning once, as battery_policy says."""
    policy = snapshot.config.safety.battery_policy
    if policy is BatteryPolicy.IGNORE or goal.plan is None:
        return None
    if not isinstance(snapshot, LocatedSnapshot):
        return None
    # A PX4 whose failsafe only warns shows it by the charge state alone (observed).
    code, text = OutcomeCode.FAILSAFE_BATTERY, reported_low(snapshot)
    if text is None:
        code, text = OutcomeCode.LOW_BATTERY, runs_low(goal.plan, snapshot)
    if text is None:
        return None
    if policy is BatteryPolicy.REJECT:
        return Stop(Outcome(code, text, None))
    return None if _RULE in goal.facts else Warn(_RULE, text, True)
