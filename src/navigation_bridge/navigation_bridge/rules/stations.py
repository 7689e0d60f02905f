"""A vehicle that a ground station made hold: it is left alone."""

from __future__ import annotations

from navigation_bridge.goals.active_goal import ActiveGoal, Yielded
from navigation_bridge.rules.verdict import Verdict, Yield
from navigation_bridge.snapshot import Snapshot
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.measurement import is_airborne
from navigation_core.tasks.observation import VehicleMode


def judge(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return whether the vehicle is left alone from now on."""
    if goal.yielded is not None or not (goal.cancelled_by or goal.paused_by):
        return None
    if goal.mission is not None:
        return None  # a mission's task waits in the hold mode by itself
    if snapshot.mode is not VehicleMode.HOLD or snapshot.in_control or not snapshot.armed:
        return None
    if snapshot.traits.flies:
        taken = is_airborne(snapshot, snapshot.config.goto.airborne_height_m)
    else:
        taken = goal.plan is None or goal.task.commanded is not None
    return Yield() if taken else None


def judge_yielded(snapshot: Snapshot, goal: ActiveGoal, yielded: Yielded) -> Outcome | None:
    """Return the end of a goal whose vehicle is left alone, or None."""
    if not goal.ending:
        if snapshot.armed:
            return None
        text = "The vehicle was disarmed while paused by a ground station."
        return Outcome(OutcomeCode.DISARMED, text, None)
    how = _stopped(snapshot, goal, yielded)
    return None if how is None else Outcome(OutcomeCode.CANCELED, how, None)


def _stopped(snapshot: Snapshot, goal: ActiveGoal, yielded: Yielded) -> str | None:
    """Return how a vehicle that is left alone has stopped, in a sentence; None while it moves."""
    text, config = "The goal was cancelled.", snapshot.config.goto
    if not snapshot.traits.hovers:
        return f"{text} The plane is circling."
    if not snapshot.armed:
        return f"{text} The motors are off."
    if yielded.stopped.holds(snapshot, config.position_stale_s):
        return f"{text} The vehicle has stopped."
    asked_s = yielded.since_s
    if goal.cancel_requested_s is not None:
        asked_s = max(asked_s, goal.cancel_requested_s)
    if snapshot.time_s - asked_s <= config.cancel_timeout_s:
        return None
    return f"{text} {yielded.stopped.failure(config.cancel_timeout_s)}"
