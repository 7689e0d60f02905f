"""A vehicle that somebody else has: the goal ends once it is clear who."""

from __future__ import annotations

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules import link
from navigation_bridge.rules.verdict import Abandon, SendNothing, Verdict
from navigation_bridge.snapshot import Snapshot
from navigation_core.outcomes import OutcomeCode

# Within this time of a mode change either an answer comes, or the link is found to be one way.
_ANSWERS_S = 2.0


def judge(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return how a goal ends whose vehicle has left our control; nothing is sent meanwhile."""
    takeover, now = goal.takeover, snapshot.time_s
    if takeover is None:
        return None
    if snapshot.one_way:
        return link.judge_answers(snapshot, goal)
    judged = takeover.judge(snapshot.state, now)
    answered_s = now - snapshot.unanswered_s
    unclear = answered_s < takeover.seen_s and now - takeover.seen_s < _ANSWERS_S
    if judged is None or snapshot.mode_unclear or unclear:
        # A PX4 that gets no more setpoints leaves OFFBOARD before the link is known to be lost.
        return SendNothing(shown=False)
    code, text = judged
    if code is OutcomeCode.PILOT_OVERRIDE and goal.cancelled_by:
        code = OutcomeCode.CANCELED  # it has ended already
    return Abandon(code, text)
