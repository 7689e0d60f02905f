"""A doubt about the position: the goal is held, and ends after a timeout.

:mod:`mavlink_vehicle.state.position_trust` defines the signs.
"""

from __future__ import annotations

from navigation_bridge.goals.active_goal import ActiveGoal, PositionDoubt
from navigation_bridge.rules.verdict import Doubt, Verdict
from navigation_bridge.snapshot import Snapshot
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome


def judge(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return the beginning, a change or the end of a doubt."""
    doubt, fault, now = goal.doubt, snapshot.fault, snapshot.time_s
    if fault is None:
        return None if doubt.since_s is None else Doubt(None, "The position is reliable again.")
    text = ""
    if doubt.since_s is None:
        text = f"The position is in doubt: {fault.reason}."
    elif fault.source not in doubt.reasons:
        text = f"The position is still in doubt: {fault.reason}."
    # A position that is stuck jumps at each step, by more each time: that is reported once.
    reasons = {**doubt.reasons, fault.source: fault.reason}
    since_s = now if doubt.since_s is None else doubt.since_s
    outcome, timeout_s = None, snapshot.config.safety.position_doubt_timeout_s
    # A landing and a return continue under the vehicle's own control.
    if goal.plan is not None and not goal.ending and now - since_s > timeout_s:
        why = f"The position is still in doubt after {timeout_s:g} s: {fault.reason}."
        outcome = Outcome(OutcomeCode.NO_POSITION, why, None)
    return Doubt(PositionDoubt(doubt.jumps_ned_m, since_s, reasons), text, outcome)
