"""Admission of goals: checks a goal and makes its task. No ROS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.admitted import Admitted, Situation
from navigation_bridge.goals.point_requests import check_request
from navigation_bridge.goals.requests import NavigateRequest, Request
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.tasks.registry import task_of
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.searches import Searcher

__all__ = ["admit"]


def admit(
    request: Request,
    tasks: Sequence[TaskKind[Any]],
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    obstacles: ObstacleFeed,
    searcher: Searcher,
    active_goal_id: str | None,
    now: float,
) -> Admitted | Rejection:
    """Return the admitted goal for this vehicle, or the first reason for rejection."""
    if isinstance(request, NavigateRequest):
        rejection = check_request(request)
        if rejection is not None:
            return rejection
    task = task_of(request, tasks)
    situation = _situation(
        vehicle, map_frame, config, obstacles, searcher, task.needs_position, now
    )
    if isinstance(situation, Rejection):
        return situation
    if active_goal_id is not None and not config.replace_active_goal:
        return Rejection(
            OutcomeCode.BUSY,
            f"Goal {active_goal_id} is active and on_new_goal is 'reject'; cancel it first.",
        )
    return task.admit(request, situation)


def _situation(
    vehicle: Vehicle,
    map_frame: MapFrame,
    config: BridgeConfig,
    obstacles: ObstacleFeed,
    searcher: Searcher,
    needs_position: bool,
    now: float,
) -> Situation | Rejection:
    state, profile = vehicle.state, vehicle.profile
    if not vehicle.connected or profile is None:
        return Rejection(
            OutcomeCode.NO_VEHICLE,
            "No autopilot is heard on the link; check link_url and the vehicle's power.",
        )
    if vehicle.is_one_way:
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
    position, pose = state.global_position, map_frame.pose(state)
    if not needs_position:
        age_s = math.inf if pose is None or position is None else now - position.time_s
        return Situation(vehicle, profile, map_frame, pose, age_s, config, obstacles, searcher)
    if pose is None or position is None:
        return Rejection(
            OutcomeCode.NO_POSITION,
            "The autopilot has no valid position yet; wait for its GPS and estimator.",
        )
    age_s, stale_s = now - position.time_s, config.goto.position_stale_s
    if age_s > stale_s:
        return Rejection(
            OutcomeCode.NO_POSITION,
            f"The last GLOBAL_POSITION_INT is {age_s:.1f} s old, and this goal needs one of the "
            f"last {stale_s:g} s; send it again, or check the link and the message rates.",
        )
    return Situation(vehicle, profile, map_frame, pose, age_s, config, obstacles, searcher)
