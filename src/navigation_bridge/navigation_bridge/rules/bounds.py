"""The flight volume, and a fence of the vehicle that changes during the goal."""

from __future__ import annotations

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules.verdict import Stop, Verdict, Warn
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.supervision.preflight import check_fence
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome

_VOLUME, _FENCE = "volume", "fence"
# Tolerance for overshoot and position errors before the vehicle counts as outside.
_LEFT_M = 3.0


def judge_volume(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """End a goal whose vehicle has left the volume that it was in."""
    if goal.plan is None or snapshot.pose is None:
        return None
    volume = snapshot.config.volume
    left_m = volume.left_by_m(snapshot.pose.position_enu_m, snapshot.ground_enu_m)
    if left_m <= 0.0:
        return Warn(_VOLUME, "", True)
    if left_m <= _LEFT_M or _VOLUME not in goal.facts:
        return None
    text = f"The vehicle is {left_m:.1f} m outside the flight volume."
    return Stop(Outcome(OutcomeCode.OUTSIDE_VOLUME, text, None))


def judge_fence(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """End a goal whose remaining path a changed fence forbids."""
    plan, fence = goal.plan, snapshot.own_fence
    if plan is None or snapshot.pose is None or fence is None or fence == goal.facts.get(_FENCE):
        return None
    route = None if goal.progress is None else goal.progress.route
    again = plan.laps > 1 and (route is None or route.lap < plan.laps - 1)
    first = 0 if route is None or again else route.current
    rejection = check_fence(snapshot, fence, plan, first, again)
    if rejection is None:
        return Warn(_FENCE, "", fence)
    text = f"The vehicle's fence was changed: {rejection.message}"
    return Stop(Outcome(rejection.code, text, None))
