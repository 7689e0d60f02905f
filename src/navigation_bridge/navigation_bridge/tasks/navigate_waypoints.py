"""NavigateWaypoints: a route by setpoints, as a mission, or by a plane."""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_bridge.configuration.settings import MissedWaypoint
from navigation_bridge.goals.admitted import Admitted, FlightPlan, may_move
from navigation_bridge.goals.obstacle_admission import avoidance_of, check_obstacles
from navigation_bridge.goals.requests import WaypointsRequest
from navigation_bridge.goals.route_requests import MISSION_WAYPOINTS_MAX, resolve_waypoints
from navigation_bridge.names import WAYPOINTS_ACTION_NAME
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.geometry import horizontal_norm
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.intents import Handover
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.task import Task
from navigation_core.tasks.watching.mission import FlyMission
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.watching.plane_route import circle_max_m
from navigation_core.tasks.waypoint import Route, RouteWaypoint

__all__ = ["NAVIGATE_WAYPOINTS", "admit_plane"]

# Assumed speed of a plane without a requested one (FW_AIRSPD_TRIM; ArduPlane's is higher).
_PLANE_M_S = 15.0
_NO_YAW = "The orientation was ignored: a plane circles its target."
_AIRSPEED = "A plane's max_speed is an airspeed; the ground speed depends on the wind."
_NO_SPEED = "max_speed was ignored: the speed of this plane cannot be commanded."


def _admit(request: WaypointsRequest, snapshot: LocatedSnapshot) -> Admitted | Rejection:
    """Return the admitted route for this vehicle, or the first reason for rejection."""
    rejection = may_move(snapshot)
    if rejection is not None:
        return rejection
    config, traits = snapshot.config, snapshot.traits
    rules = snapshot.profile.missions
    if request.by_mission and rules is None:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"Missions are not supported on {snapshot.profile.name}; use setpoints.",
        )
    waypoints = resolve_waypoints(
        request,
        snapshot,
        follows_terrain=(
            request.by_mission
            and rules is not None
            and rules.terrain
            and snapshot.state.terrain_ready is True
        ),
    )
    if isinstance(waypoints, Rejection):
        return waypoints
    route = Route(waypoints, max(request.laps, 1), request.first, request.route_id)
    one_lap = range(min(route.total, len(waypoints)))
    targets = tuple(route.at(index).position_enu_m for index in one_lap)
    warnings = check_obstacles(targets, request.avoid_obstacles, request.by_mission, snapshot)
    if isinstance(warnings, Rejection):
        return warnings
    if request.by_mission:
        return _mission(request, route, snapshot, warnings)
    rejection = _check_turning(request, snapshot)
    if rejection is not None:
        return rejection
    if not traits.hovers:
        return admit_plane(route, snapshot, warnings)

    avoidance = avoidance_of(request.avoid_obstacles, snapshot)

    def make_task(handover: Handover) -> Task:
        terms = FlightTerms(
            snapshot.goto, handover, traits, avoidance, snapshot.bounds, request.yaw_rate_rad_s
        )
        turns_back = config.on_missed_waypoint is MissedWaypoint.TURN_BACK
        return fly_route(route, terms, turns_back)

    return Admitted(
        f"route of {_named(route)}",
        waypoints[-1].position_enu_m,
        make_task,
        warnings,
        replace(
            _plan(route, snapshot.goto.limits.speed_horizontal_m_s, avoidance is None),
            margin_m=traits.target_margin_m,
        ),
    )


def _check_turning(request: WaypointsRequest, snapshot: LocatedSnapshot) -> Rejection | None:
    """Return why this vehicle does not turn on and on while it flies the route, or None."""
    rate_rad_s, traits = abs(request.yaw_rate_rad_s), snapshot.traits
    most_rad_s = snapshot.goto.limits.yaw_rate_rad_s
    if rate_rad_s > 0.0 and not (traits.flies and traits.hovers):
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {traits.name} has the yaw of its path; only copters fly a route with a yaw_rate.",
        )
    if rate_rad_s > most_rad_s:
        return Rejection(
            OutcomeCode.INVALID_NUMBER,
            f"yaw_rate is {request.yaw_rate_rad_s:g} rad/s; this server turns with at most "
            f"{most_rad_s:.3g} rad/s (parameter yaw_rate_deg_s).",
        )
    return None


def _plan(route: Route, speed_m_s: float, straight: bool = True) -> FlightPlan:
    # The rest of an interrupted route is flown once, however many laps it has.
    waypoints, laps = (route.flown, 1) if route.first else (route.waypoints, route.laps)
    return FlightPlan(
        tuple(waypoint.position_enu_m for waypoint in waypoints),
        tuple(waypoint.max_speed_m_s or speed_m_s for waypoint in waypoints),
        laps,
        math.fsum(waypoint.stay_s for waypoint in waypoints),
        straight,
    )


def _mission(
    request: WaypointsRequest, route: Route, snapshot: LocatedSnapshot, warnings: tuple[str, ...]
) -> Admitted | Rejection:
    acts = sum(len(waypoint.acts) for waypoint in route.flown)
    if route.total + acts > MISSION_WAYPOINTS_MAX:
        with_acts = f" and {acts} acts" if acts else ""
        return Rejection(
            OutcomeCode.INVALID_WAYPOINTS,
            f"The mission has {route.total} waypoints{with_acts} over all laps; the limit is "
            f"{MISSION_WAYPOINTS_MAX}. Use setpoints.",
        )
    config, traits = snapshot.config.goto, snapshot.traits
    rejection = None if traits.hovers else _check_circles(route.waypoints, snapshot)
    if rejection is not None:
        return rejection
    # A plane keeps its own airspeed unless another is requested.
    speed_m_s = config.limits.speed_horizontal_m_s if traits.hovers else None
    if request.max_speed_m_s > 0.0:
        speed_m_s = min(request.max_speed_m_s, snapshot.speed_max_m_s)
    return Admitted(
        f"mission of {_named(route)}",
        route.waypoints[-1].position_enu_m,
        lambda _handover: FlyMission(route, config, traits, speed_m_s),
        warnings,
        _plan(route, speed_m_s or config.limits.speed_horizontal_m_s),
    )


def _check_circles(
    waypoints: tuple[RouteWaypoint, ...], snapshot: LocatedSnapshot, circle_m: float = 0.0
) -> Rejection | None:
    """Reject a waypoint that a plane cannot circle: too low, or too close to the limit."""
    traits, ground_m = snapshot.traits, snapshot.ground_enu_m
    # It flies its usual circle in a pause.
    radius_m, volume = max(traits.circle_radius_m, circle_m), snapshot.config.volume
    for number, waypoint in enumerate(waypoints, start=1):
        height_m = waypoint.position_enu_m[2] - ground_m
        if height_m < traits.height_min_m:
            name = f"Waypoint {number}" if len(waypoints) > 1 else "The target"
            return Rejection(
                OutcomeCode.UNSUPPORTED_VEHICLE,
                f"{name} is {height_m:.1f} m above the ground; a {traits.name} cannot hover and "
                f"circles its targets, so give at least {traits.height_min_m:g} m.",
            )
        away_m, circle_m = horizontal_norm(waypoint.position_enu_m), circle_max_m(radius_m)
        if away_m + circle_m > volume.radius_max_m:
            return Rejection(
                OutcomeCode.OUTSIDE_VOLUME,
                f"Waypoint {number} is {away_m:.0f} m from the map origin and the loiter circle "
                f"extends {circle_m:.0f} m further; the flight volume ends at "
                f"{volume.radius_max_m:g} m.",
            )
    return None


def admit_plane(
    route: Route, snapshot: LocatedSnapshot, warnings: tuple[str, ...], circle_m: float = 0.0
) -> Admitted | Rejection:
    """Return the goal of a plane, which is sent from point to point and circles the last.

    `circle_m` is the radius of that circle, 0 for its usual one.
    """
    waypoints = route.waypoints
    traits, ground_m = snapshot.traits, snapshot.ground_enu_m
    rejection = _check_circles(waypoints, snapshot, circle_m)
    if rejection is not None:
        return rejection
    if any(waypoint.yaw_enu_rad is not None for waypoint in waypoints):
        warnings += (_NO_YAW,)
    if any(waypoint.max_speed_m_s is not None for waypoint in waypoints):
        known = snapshot.profile.speed_command is not None
        warnings += (_AIRSPEED if known else _NO_SPEED,)
    config = snapshot.config.goto
    # It turns back only from a safe height, and climbs to the target's on the leg.
    first_m = route.at(0).position_enu_m[2] - ground_m
    takeoff_m = min(first_m, max(config.takeoff_height_m, traits.takeoff_height_m))
    return Admitted(
        f"circle about the last of {_named(route)}",
        waypoints[-1].position_enu_m,
        lambda _handover: FlyPlane(route, config, traits, takeoff_m),
        warnings,
        _plan(route, _PLANE_M_S),
    )


NAVIGATE_WAYPOINTS = TaskKind(WAYPOINTS_ACTION_NAME, WaypointsRequest, _admit)


def _named(route: Route) -> str:
    laps = f", {route.laps} laps" if route.laps > 1 else ""
    rest = f", from waypoint {route.numbers((0,))} on" if route.first else ""
    return f"{len(route.waypoints)} waypoints{laps}{rest}"
