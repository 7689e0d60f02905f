"""Follow: keep a place beside a target that moves."""

from __future__ import annotations

import math

from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.point_requests import check_speed
from navigation_bridge.goals.requests import FollowRequest, FollowYaw, OffsetFrame
from navigation_bridge.names import FOLLOW_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.steering_admission import check_steered
from navigation_bridge.tasks.target_admission import topic_fault
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.geometry import norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.steering.follow_target import FollowTarget
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.steering.target_guide import (
    DISTANCE_MARGIN_M,
    FollowTerms,
    YawRule,
)
from navigation_core.tasks.task import Task

__all__ = ["FOLLOW_TARGET"]

_LOST_TIMEOUT_S, _LOST_TIMEOUT_MAX_S = 10.0, 600.0
# To catch typing errors.
_OFFSET_MAX_M = 500.0
_SYSTEM_MAX = 255
_YAWS = {
    FollowYaw.TARGET: YawRule.TARGET,
    FollowYaw.TANGENT: YawRule.TANGENT,
    FollowYaw.KEEP: YawRule.KEEP,
}


def _check_source(request: FollowRequest, snapshot: LocatedSnapshot) -> Rejection | None:
    """Return why a target has no source, or more than one, or None."""
    source, text = request.source, None
    given = [bool(source.topic), bool(source.frame), source.system_id != 0]
    if sum(given) != 1:
        text = (
            f"{sum(given)} of pose_topic, tracked_frame and target_system are given; give exactly "
            "one."
        )
    elif source.topic:
        text = topic_fault("pose_topic", source.topic, request.topic_types)
    elif not 0 <= source.system_id <= _SYSTEM_MAX:
        text = f"target_system is {source.system_id}; give 1 to {_SYSTEM_MAX}."
    elif source.system_id and source.system_id == snapshot.state.system_id:
        text = f"target_system is {source.system_id}, which is this vehicle's own."
    return None if text is None else Rejection(OutcomeCode.INVALID_TARGET, text)


def _check_numbers(request: FollowRequest) -> Rejection | None:
    """Return why a request has a number that makes no sense, or None."""
    numbers = {
        **{f"offset.{axis}": n for axis, n in zip("xyz", request.offset_m, strict=True)},
        "least_distance": request.least_distance_m,
        "max_duration": request.max_duration_s,
        "lost_timeout": request.lost_timeout_s,
    }
    bad = [f"{name} is {number}" for name, number in numbers.items() if not math.isfinite(number)]
    text = None
    if bad:
        text = f"{', '.join(bad)}; every number must be finite."
    elif norm(request.offset_m) > _OFFSET_MAX_M:
        text = f"offset is {norm(request.offset_m):.0f} m long; at most {_OFFSET_MAX_M:g} m."
    elif min(request.least_distance_m, request.max_duration_s) < 0.0:
        text = "least_distance and max_duration may not be negative."
    elif not 0.0 <= request.lost_timeout_s <= _LOST_TIMEOUT_MAX_S:
        text = f"lost_timeout is {request.lost_timeout_s:g} s; give 0 to {_LOST_TIMEOUT_MAX_S:g} s."
    elif request.offset_frame is None:
        text = "offset_frame is neither OFFSET_TARGET (0) nor OFFSET_MAP (1)."
    elif request.yaw is None:
        text = "yaw_mode is none of YAW_TARGET (0), YAW_TANGENT (1) and YAW_KEEP (2)."
    if text is not None:
        return Rejection(OutcomeCode.INVALID_NUMBER, text)
    return check_speed(request.max_speed_m_s)


def _terms(request: FollowRequest, snapshot: LocatedSnapshot) -> FollowTerms | Rejection:
    """Return how the target is followed, or why it cannot be from there."""
    obstacles, flies = snapshot.config.obstacles, snapshot.traits.flies
    least_m = request.least_distance_m or obstacles.vehicle_radius_m + obstacles.margin_m
    forward, left, up = request.offset_m
    away_m = norm((forward, left, up if flies else 0.0))
    text = None
    if least_m < obstacles.vehicle_radius_m:
        text = (
            f"least_distance is {least_m:g} m, less than vehicle_radius_m "
            f"({obstacles.vehicle_radius_m:g} m)."
        )
    elif away_m < least_m + DISTANCE_MARGIN_M:
        where = "" if flies else " over ground"
        text = (
            f"offset leads {away_m:.2f} m from the target{where}; give at least "
            f"{DISTANCE_MARGIN_M:g} m more than least_distance, {least_m:g} m."
        )
    if text is not None:
        return Rejection(OutcomeCode.INVALID_NUMBER, text)
    return FollowTerms(
        request.offset_m,
        request.offset_frame is OffsetFrame.TARGET,
        least_m,
        request.max_duration_s or math.inf,
        request.lost_timeout_s or _LOST_TIMEOUT_S,
        _YAWS[request.yaw or FollowYaw.TARGET],
    )


def _admit(request: FollowRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    rejection = _check_source(request, snapshot) or _check_numbers(request)
    rejection = rejection or check_steered(snapshot, "following", "follow a target")
    if rejection is not None:
        return rejection
    following = _terms(request, snapshot)
    if isinstance(following, Rejection):
        return following
    config, traits, goto = snapshot.config, snapshot.traits, snapshot.goto
    asked_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s)
    speed_m_s = asked_m_s or goto.limits.speed_horizontal_m_s
    # The path is not known before: avoidance is on as soon as any obstacle may be.
    avoidance = avoidance_of(snapshot.knows_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        flight = FlightTerms(goto, handover, traits, avoidance)
        margin_m = config.safety.fence_margin_m
        terms = VelocityTerms(flight, config.volume, margin_m, max_speed_m_s=speed_m_s)
        return FollowTarget(terms, following)

    return Admitted(
        f"target of {request.source}, at up to {speed_m_s:.3g} m/s",
        None,
        make_task,
        plan=FlightPlan((), (speed_m_s,), straight=False),
        followed=request.source,
    )


FOLLOW_TARGET = TaskKind(FOLLOW_ACTION_NAME, FollowRequest, _admit)
