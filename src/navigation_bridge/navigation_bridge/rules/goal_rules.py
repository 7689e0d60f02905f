"""Rules that end, hold or pause a goal, their verdicts and their order. No ROS.

Each ``judge(snapshot, goal)`` returns its verdict, and never acts;
:mod:`navigation_bridge.engine` carries it out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from mavlink_vehicle.events import FailsafeKind
from navigation_bridge.configuration.settings import BatteryPolicy
from navigation_bridge.goals.active_goal import ActiveGoal, PositionDoubt, Yielded
from navigation_bridge.rules.verdicts import (
    Abandon,
    Doubt,
    SendNothing,
    Stop,
    Verdict,
    Warn,
    Yield,
)
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.supervision.battery_forecast import reported_low, runs_low
from navigation_bridge.supervision.preflight import check_fence
from navigation_bridge.vehicle.takeover import failsafe_code
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import is_airborne
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import VehicleMode

__all__ = [
    "RULES",
    "Abandon",
    "Doubt",
    "Rule",
    "SendNothing",
    "Stop",
    "Verdict",
    "Warn",
    "Yield",
    "judge_yielded",
]


# Within this time of a mode change either an answer comes, or the link is found to be one way.
_ANSWERS_S = 2.0


def judge_twins(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """End a goal whose vehicle shares its ids; a landing and a return continue by themselves."""
    ends = snapshot.twins and goal.plan is not None
    return Abandon(OutcomeCode.DUPLICATE_VEHICLE, snapshot.twins) if ends else None


def judge_takeover(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return how a goal ends whose vehicle has left our control; nothing is sent meanwhile."""
    takeover, now = goal.takeover, snapshot.time_s
    if takeover is None:
        return None
    if snapshot.one_way:
        return judge_answers(snapshot, goal)
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


def judge_silence(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Wait for a silent vehicle, up to a timeout; no motion command is sent."""
    if snapshot.connected:
        return None
    heard_s, now, config = snapshot.state.last_heartbeat_s, snapshot.time_s, snapshot.config
    silence_s = math.inf if heard_s is None else now - heard_s
    asked_s = goal.cancel_requested_s
    if asked_s is not None and now - asked_s >= config.goto.cancel_timeout_s:
        return Abandon(
            OutcomeCode.CANCELED,
            f"The vehicle has been silent for {silence_s:.1f} s; whether it stopped is unknown.",
        )
    if silence_s >= config.link_lost_abort_s:
        return Abandon(
            OutcomeCode.LINK_LOST,
            f"No HEARTBEAT for {silence_s:.1f} s; the vehicle's own failsafe decides what it "
            "does. The goal is not resumed.",
        )
    return SendNothing()


def judge_answers(snapshot: Snapshot, _goal: ActiveGoal) -> Verdict | None:
    """End the goal when the vehicle is heard, but no longer answers."""
    if not snapshot.one_way:
        return None
    return Abandon(
        OutcomeCode.LINK_LOST,
        "The link is one way: telemetry arrives, but nothing was answered for "
        f"{snapshot.unanswered_s:.1f} s. The vehicle's own failsafe decides what it does. The "
        "goal is not resumed.",
    )


def judge_suspension(snapshot: Snapshot, _goal: ActiveGoal) -> Verdict | None:
    """Wait for the mode after the server was suspended: a pilot may have the vehicle."""
    return SendNothing() if snapshot.mode_unseen else None


def judge_request(snapshot: Snapshot, _goal: ActiveGoal) -> Verdict | None:
    """Wait for a mode that this server has requested itself."""
    return SendNothing(shown=False) if snapshot.mode_requested else None


def judge_position(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return the beginning, a change or the end of a doubt about the position.

    The goal is held meanwhile. :mod:`mavlink_vehicle.state.position_trust` defines the signs.
    """
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


# A failsafe that changes the mode does so within this time of its first sign.
_ACTS_S = 2.0


def judge_failsafe(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """Return the end of a goal, or a warning, once for each kind of failsafe.

    The failsafe has not changed the mode; :func:`judge_takeover` handles one that has.
    """
    failsafe, now = snapshot.state.failsafe, snapshot.time_s
    if failsafe is None or failsafe.kind is goal.facts.get(_FAILSAFE):
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
    return Warn(_FAILSAFE, text, failsafe.kind)


_FAILSAFE, _VOLUME, _FENCE = "failsafe", "volume", "fence"
# Tolerance for overshoot and position errors before the vehicle counts as outside.
_LEFT_M = 3.0


def judge_volume(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """End a goal whose vehicle has left the volume that it was in."""
    if goal.plan is None or snapshot.pose is None:
        return None
    left_m = snapshot.config.volume.left_by_m(snapshot.pose.position_enu_m, snapshot.ground_enu_m)
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
    ahead = len(plan.targets_enu_m) if route is None else route.remaining
    again = ahead > len(plan.targets_enu_m) or (plan.laps > 1 and route is None)
    first = max(len(plan.targets_enu_m) - ahead, 0)
    rejection = check_fence(snapshot, fence, plan, first, again)
    if rejection is None:
        return Warn(_FENCE, "", fence)
    text = f"The vehicle's fence was changed: {rejection.message}"
    return Stop(Outcome(rejection.code, text, None))


_BATTERY = "battery"


def judge_battery(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
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
    return None if _BATTERY in goal.facts else Warn(_BATTERY, text, True)


# Its client renews a lease each second.
_LEASE_S = 5.0


def judge_lease(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
    """End a goal whose client has stopped to renew its lease; a landing, too: the vehicle holds.

    A server that was late itself may not have heard the client yet: that time does not count.
    """
    renewed_s = goal.lease.renewed_s
    if renewed_s is None:
        return None
    silence_s = snapshot.time_s - renewed_s
    if silence_s - snapshot.late_s <= _LEASE_S:
        return None
    text = f"The client that sent the goal has not been heard for {silence_s:.1f} s."
    return Stop(Outcome(OutcomeCode.CLIENT_LOST, text, None))


def judge_stations(snapshot: Snapshot, goal: ActiveGoal) -> Verdict | None:
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
    # Two vehicles are heard as one, or somebody else has it: nothing is sent, whatever else.
    Rule(judge_twins),
    Rule(judge_takeover),
    # The vehicle is not heard, or does not hear.
    Rule(judge_silence),
    Rule(judge_answers),
    Rule(judge_suspension),
    Rule(judge_request),
    # A doubtful position comes first of the reasons to stop: the others rely on it.
    Rule(judge_position),
    # The vehicle's own reason, before reasons that are concluded from its position.
    Rule(judge_failsafe, guards=True),
    Rule(judge_volume, guards=True),
    Rule(judge_fence, guards=True),
    Rule(judge_battery, guards=True),
    Rule(judge_lease, guards=True),
    # Last: a goal that is stopped for a reason above ends with that one.
    Rule(judge_stations),
)
"""The first `Abandon` or `SendNothing` ends a turn; all else is applied, in this order."""
