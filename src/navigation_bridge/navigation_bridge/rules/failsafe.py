"""A failsafe of the vehicle that has not changed its mode.

:mod:`navigation_bridge.rules.takeover` handles one that has.
"""

from __future__ import annotations

from mavlink_vehicle.events import FailsafeKind
from navigation_bridge.configuration.settings import BatteryPolicy
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules.verdict import Stop, Verdict, Warn
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.vehicle.failsafes import failsafe_code
from navigation_core.tasks.intents import Outcome

_RULE = "failsafe"
# A failsafe that changes the mode does so within this time of its first sign.
_ACTS_S = 2.0


def judge(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return the end of a goal, or a warning, once for each kind of failsafe."""
    failsafe, now = snapshot.state.failsafe, snapshot.time_s
    if failsafe is None or failsafe.kind is goal.facts.get(_RULE):
        return None
    if now - failsafe.since_s < _ACTS_S:
        return None
    began_before = failsafe.since_s < goal.accepted_s  # so the goal was sent despite it
    ends = failsafe.kind in (FailsafeKind.FENCE, FailsafeKind.GPS) or (
        failsafe.kind is FailsafeKind.BATTERY
        and snapshot.config.safety.battery_policy is BatteryPolicy.REJECT
    )
    text = (
        f"The vehicle reported a failsafe ({failsafe.text}) but took no action; the goal continued."
    )
    if goal.plan is None:
        # It lands or returns, perhaps because of it: the failsafe does act.
        text = "" if began_before else f"The vehicle reported a failsafe ({failsafe.text})."
    elif began_before:
        text = f"The vehicle was already in a failsafe when the goal arrived ({failsafe.text})."
    elif ends:
        text = f"The vehicle is in a failsafe but still under our control: {failsafe.text}."
        return Stop(Outcome(failsafe_code(failsafe), text, None))
    return Warn(_RULE, text, failsafe.kind)
