"""Navigate to a pose, and take off to a height above the ground."""

from __future__ import annotations

from dataclasses import replace

from navigation_bridge.goals.admitted import Admitted, FlightPlan, may_move
from navigation_bridge.goals.obstacle_admission import avoidance_of, check_obstacles
from navigation_bridge.goals.point_requests import resolve
from navigation_bridge.goals.requests import NavigateRequest, TakeoffRequest
from navigation_bridge.names import ACTION_NAME, TAKEOFF_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.navigate_waypoints import admit_plane
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.flying.goto import FlightTerms, GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.task import Task
from navigation_core.tasks.waypoint import Route, RouteWaypoint

__all__ = ["NAVIGATE", "TAKEOFF", "admit_point", "resolve_point"]


def resolve_point(request: NavigateRequest, snapshot: LocatedSnapshot) -> GotoGoal | Rejection:
    """Return the goal of a request in the map frame, or the reason for its rejection."""
    rejection = may_move(snapshot)
    if rejection is not None:
        return rejection
    return resolve(
        request,
        snapshot.pose,
        snapshot.enu,
        snapshot.ground_enu_m,
        snapshot.config.volume,
        snapshot.speed_max_m_s,
        snapshot.traits,
    )


def _admit(request: NavigateRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    goal = resolve_point(request, snapshot)
    if isinstance(goal, Rejection):
        return goal
    warnings = check_obstacles((goal.position_enu_m,), request.avoid_obstacles, False, snapshot)
    if isinstance(warnings, Rejection):
        return warnings
    return admit_point(goal, snapshot.goto, snapshot, warnings, request.avoid_obstacles)


def admit_point(
    goal: GotoGoal,
    config: GotoConfig,
    snapshot: LocatedSnapshot,
    warnings: tuple[str, ...] = (),
    avoid: bool = False,
) -> Admitted | Rejection:
    """Return the admitted flight to one point, which a plane circles."""
    traits = snapshot.traits
    if not traits.hovers:
        waypoint = RouteWaypoint(
            goal.position_enu_m,
            config.arrival_radius_m,
            yaw_enu_rad=goal.yaw_enu_rad,
            max_speed_m_s=goal.max_speed_m_s,
        )
        return admit_plane(Route((waypoint,)), snapshot, warnings)
    x, y, z = goal.position_enu_m
    speed_m_s = goal.max_speed_m_s or config.limits.speed_horizontal_m_s

    avoidance = avoidance_of(avoid, snapshot)

    def make_task(handover: Handover) -> Task:
        terms = FlightTerms(config, handover, traits, avoidance, snapshot.bounds)
        return fly_to(goal, terms)

    return Admitted(
        f"east {x:.2f}, north {y:.2f}, up {z:.2f} m at up to {speed_m_s:g} m/s",
        goal.position_enu_m,
        make_task,
        warnings,
        FlightPlan(
            (goal.position_enu_m,),
            (speed_m_s,),
            straight=avoidance is None,
            margin_m=traits.target_margin_m,
        ),
    )


NAVIGATE = TaskKind(ACTION_NAME, NavigateRequest, _admit)


def _admit_takeoff(request: TakeoffRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
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


TAKEOFF = TaskKind(TAKEOFF_ACTION_NAME, TakeoffRequest, _admit_takeoff)
