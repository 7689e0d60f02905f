"""FollowVelocity: follow the velocity commands of a topic."""

from __future__ import annotations

from navigation_bridge.goals.admitted import Admitted, FlightPlan
from navigation_bridge.goals.obstacle_admission import avoidance_of
from navigation_bridge.goals.point_requests import check_speed
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.names import VELOCITY_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.steering_admission import check_steered
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.steering.follow_velocity import FollowVelocity
from navigation_core.tasks.steering.plane_course import CourseTerms, FlyPlaneCourse
from navigation_core.tasks.steering.steersman import VelocityTerms
from navigation_core.tasks.task import Task

__all__ = ["FOLLOW_VELOCITY"]

_PLANE_OBSTACLES = "A plane is guided by its own autopilot; obstacles are not avoided."


def _admit(request: VelocityRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    rejection = check_speed(request.max_speed_m_s) or check_steered(
        snapshot, "a velocity command", ""
    )
    if rejection is not None:
        return rejection
    if not snapshot.traits.hovers:
        return _admit_plane(request, snapshot)
    config, traits, goto = snapshot.config, snapshot.traits, snapshot.goto
    asked_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s)
    speed_m_s = asked_m_s or goto.limits.speed_horizontal_m_s
    # A client that steers plans no path: avoidance is on as soon as any obstacle may be known.
    avoidance = avoidance_of(snapshot.knows_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        return FollowVelocity(
            VelocityTerms(
                FlightTerms(goto, handover, traits, avoidance),
                config.volume,
                config.safety.fence_margin_m,
                config.commands.timeout_s,
                speed_m_s,
            )
        )

    return Admitted(
        f"velocity commands at up to {speed_m_s:g} m/s",
        None,
        make_task,
        plan=FlightPlan((), (speed_m_s,), straight=False),
    )


def _admit_plane(request: VelocityRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    """Return the goal of a plane, which flies a course at an airspeed."""
    config, traits = snapshot.config, snapshot.traits
    if not traits.reposition_keeps_mode:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {snapshot.profile.name} cannot follow velocity commands: each place that it is "
            "sent to would take its mode from a pilot; send it targets.",
        )
    least_m_s, greatest_m_s = traits.airspeed_min_m_s, traits.airspeed_max_m_s
    if not least_m_s:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            "The least and the greatest airspeed of this plane have not been read from it yet; "
            "without them it is sent to targets only.",
        )
    if 0.0 < request.max_speed_m_s < least_m_s:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"max_speed is {request.max_speed_m_s:g} m/s; the least airspeed of this plane is "
            f"{least_m_s:g} m/s.",
        )
    asked_m_s = request.max_speed_m_s or snapshot.goto.limits.speed_horizontal_m_s
    speed_m_s = min(max(asked_m_s, least_m_s), greatest_m_s)
    terms = CourseTerms(config.goto, traits, snapshot.bounds, config.commands.timeout_s, speed_m_s)
    return Admitted(
        f"course and climb by velocity commands at up to {speed_m_s:g} m/s",
        None,
        lambda _handover: FlyPlaneCourse(terms),
        (_PLANE_OBSTACLES,) if snapshot.knows_obstacles else (),
        plan=FlightPlan((), (speed_m_s,), straight=False),
    )


FOLLOW_VELOCITY = TaskKind(VELOCITY_ACTION_NAME, VelocityRequest, _admit)
