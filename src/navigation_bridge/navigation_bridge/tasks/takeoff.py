"""Takeoff: climb to a height above the ground, and hover."""

from __future__ import annotations

from dataclasses import replace

from navigation_bridge.goals.admitted import Admitted, may_move
from navigation_bridge.goals.requests import TakeoffRequest
from navigation_bridge.names import TAKEOFF_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.navigate import admit_point
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.flying.goto import GotoGoal


def _admit(request: TakeoffRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    traits = snapshot.traits
    if not traits.flies:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, f"A {traits.name} cannot take off.")
    if snapshot.flies:
        return Rejection(
            OutcomeCode.ALREADY_FLYING,
            "The vehicle is already airborne; send a Navigate goal to change its altitude.",
        )
    rejection = may_move(snapshot)
    if rejection is not None:
        return rejection
    config = snapshot.config
    height_m = request.height_m or max(config.goto.takeoff_height_m, traits.takeoff_height_m)
    x, y, _ = snapshot.pose.position_enu_m
    target = (x, y, snapshot.ground_enu_m + height_m)
    rejection = check_target(target, None, snapshot.ground_enu_m, config.volume)
    if rejection is not None:
        return rejection
    goto = replace(config.goto, takeoff_height_m=height_m, takeoff_height_min_m=height_m)
    return admit_point(GotoGoal(target, snapshot.pose.yaw_enu_rad), goto, snapshot)


TAKEOFF = TaskKind(TAKEOFF_ACTION_NAME, TakeoffRequest, _admit)
