"""Requested waypoints, checked and resolved into the map frame. No ROS."""

from __future__ import annotations

import math
from functools import partial

from navigation_bridge.goals.act_requests import check_acts, check_equipment, resolve_acts
from navigation_bridge.goals.point_requests import (
    SPEED_MIN_M_S,
    check_geodetic,
    on_ground,
    volume_for,
)
from navigation_bridge.goals.requests import (
    LAPS_MAX,
    AltitudeReference,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection, check_target
from navigation_core.tasks.waypoint import RouteWaypoint

WAYPOINTS_MAX = 1000
# The rest of an interrupted route is checked leg by leg, over all laps, by the thread that flies.
REST_MAX = 10_000
# An ArduPilot stores 650 items or more, and a waypoint may need two more for speed and heading.
MISSION_WAYPOINTS_MAX = 500
# Within less than this, arrival cannot be distinguished from position noise.
RADIUS_MIN_M = 0.05
HOLD_TIME_MAX_S = 3600.0
_NO_TERRAIN = (
    "heights above the ground need a mission and a vehicle that reports its terrain data in "
    "TERRAIN_REPORT; give altitudes above home or above mean sea level."
)


def resolve_waypoints(
    request: WaypointsRequest,
    snapshot: LocatedSnapshot,
    *,
    follows_terrain: bool = False,
) -> tuple[RouteWaypoint, ...] | Rejection:
    """Turn a route into waypoints of the map frame.

    Args:
        request: the client's request.
        snapshot: what is known.
        follows_terrain: whether heights above the ground are accepted.

    Returns:
        The waypoints, or the reason for the rejection of the first invalid one, with its number.
    """
    problem = _problem_of_route(request)
    if problem is not None:
        return Rejection(OutcomeCode.INVALID_WAYPOINTS, problem)
    speed_max_m_s = snapshot.speed_max_m_s
    radius_default_m = snapshot.config.goto.arrival_radius_m
    waypoints = []
    for number, waypoint in enumerate(request.waypoints, start=1):
        above_ground = waypoint.altitude_reference is AltitudeReference.GROUND
        if above_ground and not follows_terrain:
            return Rejection(OutcomeCode.INVALID_WAYPOINTS, f"Waypoint {number}: {_NO_TERRAIN}")
        position = _place(waypoint, snapshot, by_mission=request.by_mission)
        if isinstance(position, Rejection):
            return Rejection(position.code, f"Waypoint {number}: {position.message}")
        speed_m_s = waypoint.max_speed_m_s or request.max_speed_m_s
        waypoints.append(
            RouteWaypoint(
                position_enu_m=position,
                acceptance_radius_m=waypoint.acceptance_radius_m or radius_default_m,
                hold_time_s=waypoint.hold_time_s,
                yaw_enu_rad=waypoint.yaw_enu_rad,
                max_speed_m_s=min(speed_m_s, speed_max_m_s) if speed_m_s > 0.0 else None,
                height_above_ground_m=waypoint.position[2] if above_ground else None,
                acts=resolve_acts(waypoint, partial(_in_map, waypoint, snapshot)),
            )
        )
    return tuple(waypoints)


def _place(
    waypoint: WaypointRequest, snapshot: LocatedSnapshot, *, by_mission: bool
) -> Vector3 | Rejection:
    profile, parameters = snapshot.profile, snapshot.parameters
    rejection = check_waypoint(waypoint) or check_equipment(
        waypoint, profile, parameters, by_mission=by_mission
    )
    if rejection is not None:
        return rejection
    ground_enu_m, traits = snapshot.ground_enu_m, snapshot.traits
    place = _in_map(waypoint, snapshot, waypoint.position)
    position = on_ground(place, ground_enu_m, traits)
    if isinstance(position, Rejection):
        return position
    volume = volume_for(snapshot.config.volume, traits)
    return check_target(position, None, ground_enu_m, volume) or position


def _problem_of_route(request: WaypointsRequest) -> str | None:
    count = len(request.waypoints)
    if count == 0:
        return "The route has no waypoints; send at least one."
    if count > WAYPOINTS_MAX:
        return f"The route has {count} waypoints; send at most {WAYPOINTS_MAX}."
    if request.laps > LAPS_MAX:
        return f"The route has {request.laps} laps; send at most {LAPS_MAX}."
    total = count * max(request.laps, 1)
    if request.first >= total:
        return f"first is {request.first}; the route has {total} waypoints over all laps."
    if request.first and total - request.first > REST_MAX:
        left = total - request.first
        return f"The rest has {left} waypoints over all laps; send at most {REST_MAX}."
    if request.interrupted_id not in (0, request.route_id):
        return (
            f"The route is not the one that was interrupted: its route_id is {request.route_id}, "
            f"and interrupted_id is {request.interrupted_id}."
        )
    return _problem_of_turning(request) or _problem_of_speed(request.max_speed_m_s)


def _problem_of_turning(request: WaypointsRequest) -> str | None:
    rate_rad_s = request.yaw_rate_rad_s
    if not math.isfinite(rate_rad_s):
        return f"yaw_rate is {rate_rad_s}; give a finite number, or 0 for the usual yaw."
    if rate_rad_s == 0.0:
        return None
    if request.by_mission:
        return f"yaw_rate is {rate_rad_s:g} rad/s; only a route by setpoints has one."
    for number, waypoint in enumerate(request.waypoints, start=1):
        if waypoint.yaw_enu_rad is not None:
            return f"Waypoint {number} has a yaw, and the route a yaw_rate; give one of them."
    return None


def _problem_of_speed(speed_m_s: float) -> str | None:
    if not math.isfinite(speed_m_s) or speed_m_s < 0.0 or 0.0 < speed_m_s < SPEED_MIN_M_S:
        return (
            f"max_speed is {speed_m_s:g} m/s; give at least {SPEED_MIN_M_S:g} m/s, or 0 for the "
            "default."
        )
    return None


def check_waypoint(waypoint: WaypointRequest) -> Rejection | None:
    """Check a route without a vehicle: numbers, speed, radius, hold time."""
    numbers = {
        **{f"position.{axis}": part for axis, part in zip("xyz", waypoint.position, strict=True)},
        "acceptance_radius": waypoint.acceptance_radius_m,
        "hold_time": waypoint.hold_time_s,
        "yaw": waypoint.yaw_enu_rad or 0.0,
        "max_speed": waypoint.max_speed_m_s,
    }
    for name, number in numbers.items():
        if not math.isfinite(number):
            text = f"{name} is {number}; every number must be finite."
            return Rejection(OutcomeCode.INVALID_NUMBER, text)
    problem = _problem_of_speed(waypoint.max_speed_m_s)
    radius_m = waypoint.acceptance_radius_m
    if radius_m < 0.0 or 0.0 < radius_m < RADIUS_MIN_M:
        problem = (
            f"acceptance_radius is {radius_m:g} m; give at least {RADIUS_MIN_M:g} m, or 0 for the "
            "default."
        )
    elif not 0.0 <= waypoint.hold_time_s <= HOLD_TIME_MAX_S:
        problem = f"hold_time is {waypoint.hold_time_s:g} s; give 0 to {HOLD_TIME_MAX_S:g} s."
    if problem is not None:
        return Rejection(OutcomeCode.INVALID_WAYPOINTS, problem)
    is_geodetic = waypoint.altitude_reference is not None
    rejection = check_geodetic(waypoint.position) if is_geodetic else None
    return rejection or check_acts(waypoint)


def _in_map(waypoint: WaypointRequest, snapshot: LocatedSnapshot, position: Vector3) -> Vector3:
    """Return a position of the waypoint's frame in the map frame."""
    if waypoint.altitude_reference is None:
        return position
    place = snapshot.enu(position)
    if waypoint.altitude_reference is AltitudeReference.AMSL:
        return place
    above_home = waypoint.altitude_reference is AltitudeReference.HOME
    below_m = snapshot.home_z_enu_m if above_home else snapshot.ground_enu_m
    return (place[0], place[1], below_m + position[2])
