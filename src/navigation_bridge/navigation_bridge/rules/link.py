"""A vehicle that is not heard, or that does not answer."""

from __future__ import annotations

import math

from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.rules.verdict import Abandon, SendNothing, Verdict
from navigation_bridge.snapshot import Snapshot
from navigation_core.outcomes import OutcomeCode


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
            f"The vehicle has been silent for {silence_s:.1f} s; whether it has stopped is "
            "unknown.",
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
