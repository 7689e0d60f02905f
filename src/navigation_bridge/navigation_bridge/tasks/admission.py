"""Admission of goals: checks a goal and makes its task. No ROS."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.point_requests import check_request
from navigation_bridge.goals.requests import NavigateRequest, Request
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.tasks.registry import task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

__all__ = ["admit"]


def admit(
    request: Request,
    tasks: Sequence[TaskKind[Any]],
    snapshot: Snapshot,
    active_goal_id: str | None,
) -> Admitted | Rejection:
    """Return the admitted goal for this vehicle, or the first reason for rejection."""
    if isinstance(request, NavigateRequest):
        rejection = check_request(request)
        if rejection is not None:
            return rejection
    task = task_of(request, tasks)
    rejection = _check_vehicle(snapshot)
    if rejection is not None:
        return rejection
    busy: Rejection | None = None
    if active_goal_id is not None and not snapshot.config.replace_active_goal:
        text = f"Goal {active_goal_id} is active and on_new_goal is 'reject'; cancel it first."
        busy = Rejection(OutcomeCode.BUSY, text)
    if task.admit_anywhere is not None:
        return busy or task.admit_anywhere(request, snapshot)
    if not isinstance(snapshot, LocatedSnapshot):
        return Rejection(
            OutcomeCode.NO_POSITION,
            "The autopilot has no valid position yet; wait for its GPS and estimator.",
        )
    age_s, stale_s = snapshot.arrival_age_s, snapshot.config.goto.position_stale_s
    if age_s > stale_s:
        return Rejection(
            OutcomeCode.NO_POSITION,
            f"The last GLOBAL_POSITION_INT is {age_s:.1f} s old, and this goal needs one of the "
            f"last {stale_s:g} s; send it again, or check the link and the message rates.",
        )
    return busy or task.admit(request, snapshot)


def _check_vehicle(snapshot: Snapshot) -> Rejection | None:
    """Return why goals are not accepted by this vehicle, or by none, or None."""
    profile = snapshot.profile
    if not snapshot.connected:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and the vehicle's power.",
        )
    if snapshot.one_way:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "The link is one way: telemetry arrives, but nothing that is sent is answered; check "
            "the way from this computer to the autopilot.",
        )
    if profile.unsupported is not None:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, profile.unsupported)
    if profile.control_mode is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Goals on this vehicle ({profile.name}) are not supported; docs/autopilots.md lists "
            "the supported ones.",
        )
    return None
