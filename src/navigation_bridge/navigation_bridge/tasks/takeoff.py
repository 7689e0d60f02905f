"""Takeoff: climb to a height above the ground, and hover."""

from __future__ import annotations

from dataclasses import replace

from navigation_bridge.goals.admitted import Admitted, Situation
from navigation_bridge.goals.requests import TakeoffRequest
from navigation_bridge.names import TAKEOFF_ACTION_NAME
from navigation_bridge.tasks.navigate import admit_point
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.flying.goto import GotoGoal


def _admit(request: TakeoffRequest, situation: Situation) -> Admitted | Rejection:
    traits = situation.traits
    if not traits.flies:
        return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, f"A {traits.name} cannot take off.")
    if situation.flies:
        return Rejection(
            OutcomeCode.ALREADY_FLYING,
            "The vehicle is already airborne; send a Navigate goal to change its altitude.",
        )
    rejection = situation.may_move()
    if rejection is not None:
        return rejection
    config = situation.config
    assert situation.pose is not None
    height_m = request.height_m or max(config.goto.takeoff_height_m, traits.takeoff_height_m)
    x, y, _ = situation.pose.position_enu_m
    target = (x, y, situation.ground_enu_m + height_m)
    rejection = check_target(target, None, situation.ground_enu_m, config.volume)
    if rejection is not None:
        return rejection
    goto = replace(config.goto, takeoff_height_m=height_m, takeoff_height_min_m=height_m)
    return admit_point(GotoGoal(target, situation.pose.yaw_enu_rad), goto, situation)


TAKEOFF = TaskKind(TAKEOFF_ACTION_NAME, TakeoffRequest, _admit)
