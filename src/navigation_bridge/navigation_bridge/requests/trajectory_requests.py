"""The checks of a trajectory that another program has planned, in the map frame. No ROS."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from mavlink_vehicle.positions import frames
from navigation_bridge.goals.point_requests import position_in_map
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.planning.conflicts import first_conflict
from navigation_core.safety.target_checks import check_target
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.trajectories.timed_point import TimedPoint
from navigation_core.trajectories.timed_trajectory import (
    TimedTrajectory,
    TrajectoryFault,
    join,
    plan_timed,
)

__all__ = ["limits_of_trajectories", "resolve_trajectory"]

# Steps in which a trajectory is compared with the bounds of the flight, and their greatest number.
_STEP_S, _STEPS_MAX = 0.2, 3000


def limits_of_trajectories(snapshot: LocatedSnapshot) -> Limits:
    """Return the limits that trajectories keep: the greatest speed that a goal may ask for."""
    return snapshot.goto.limits.with_speed(snapshot.speed_max_m_s)


def resolve_trajectory(
    request: TrajectoryRequest, snapshot: LocatedSnapshot, start: KinematicState
) -> TimedTrajectory | Rejection:
    """Return the trajectory of a request with points, or the first reason against it.

    Args:
        request: the client's request.
        snapshot: what is known.
        start: from where it is joined, in the map frame: the setpoint sent last, or the vehicle.
    """
    if request.fault:
        return _invalid(request.fault)
    if request.frame_id not in ("", FRAME_MAP, FRAME_BASE_LINK):
        why = request.frame_fault or (
            f"Unknown frame '{request.frame_id}' of a trajectory; use '{FRAME_MAP}' or "
            f"'{FRAME_BASE_LINK}'."
        )
        return Rejection(OutcomeCode.UNKNOWN_FRAME, why)
    limits = limits_of_trajectories(snapshot)
    points = [_in_map(point, request.frame_id, snapshot) for point in request.points]
    timed = plan_timed(points, limits, snapshot.config.trajectories.may_slow_down)
    if isinstance(timed, TrajectoryFault):
        return _invalid(timed.text)
    if request.begins_s is not None:
        timed = replace(timed, begins_s=request.begins_s + points[0].time_s)
    return (
        _check_beginning(timed, start, limits, snapshot)
        or _check_bounds(timed, snapshot)
        or _check_obstacles(timed, snapshot)
        or timed
    )


def _invalid(text: str) -> Rejection:
    return Rejection(OutcomeCode.TRAJECTORY_INVALID, f"The trajectory is rejected: {text}")


def _in_map(point: TimedPoint, frame_id: str, snapshot: LocatedSnapshot) -> TimedPoint:
    """Return a point in the map frame; one of base_link counts from the vehicle's pose now."""
    if frame_id != FRAME_BASE_LINK:
        return point
    pose = snapshot.pose
    turned = frames.body_flu_to_enu
    velocity, acceleration = point.velocity_enu_m_s, point.acceleration_enu_m_s2
    yaw = point.yaw_enu_rad
    return TimedPoint(
        point.time_s,
        position_in_map(frame_id, point.position_enu_m, pose, snapshot.enu),
        None if velocity is None else turned(velocity, pose.yaw_enu_rad),
        None if acceleration is None else turned(acceleration, pose.yaw_enu_rad),
        None if yaw is None else frames.normalize_angle(yaw + pose.yaw_enu_rad),
        point.yaw_rate_rad_s,
    )


def _check_beginning(
    timed: TimedTrajectory, start: KinematicState, limits: Limits, snapshot: LocatedSnapshot
) -> Rejection | None:
    begun_s, end_s = timed.begun_s(snapshot.time_s), timed.times_s[-1]
    if begun_s > end_s:
        return _invalid(f"It comes late: its last point was due {begun_s - end_s:.1f} s ago.")
    from_s = max(begun_s, 0.0)
    away_m = distance(start.position_enu_m, timed.trajectory.sample(from_s).position_enu_m)
    most_m = snapshot.config.trajectories.start_distance_m
    if not away_m <= most_m:
        where = "It begins" if from_s == 0.0 else f"Now, {from_s:.1f} s after it began, it is"
        return _invalid(
            f"{where} {away_m:.2f} m from the vehicle; at most {most_m:g} m "
            "(trajectory_start_distance_m)."
        )
    if join(start, timed, from_s, limits) is None:
        x, y, z = start.velocity_enu_m_s
        return _invalid(
            f"It cannot be joined within the limits of speed and acceleration from "
            f"({x:.1f}, {y:.1f}, {z:.1f}) m/s."
        )
    return None


def _positions(timed: TimedTrajectory, from_s: float) -> tuple[list[float], list[Vector3]]:
    """Return times and positions from a time on, up to the stop at the end."""
    end_s = timed.trajectory.duration_s
    count = min(max(math.ceil((end_s - from_s) / _STEP_S), 1), _STEPS_MAX)
    times_s = np.linspace(from_s, end_s, count + 1)
    places = timed.trajectory.samples(times_s)[0].tolist()
    return times_s.tolist(), [(x, y, z) for x, y, z in places]


def _check_bounds(timed: TimedTrajectory, snapshot: LocatedSnapshot) -> Rejection | None:
    """Return where the trajectory, or the brake after it, leaves the flight volume or the fence."""
    times_s, places = _positions(timed, max(timed.begun_s(snapshot.time_s), 0.0))
    ground_m, volume = snapshot.ground_enu_m, snapshot.config.volume
    fence, margin_m = snapshot.own_fence, snapshot.config.safety.fence_margin_m
    for time_s, place in zip(times_s, places, strict=True):
        rejection = check_target(place, None, ground_m, volume)
        if rejection is None and fence is not None:
            rejection = fence.check_target(place, snapshot.home_z_enu_m, margin_m)
        if rejection is not None:
            return _at(time_s, timed, rejection)
    if fence is None:
        return None
    for time_s, (place, following) in zip(times_s, itertools.pairwise(places), strict=False):
        rejection = fence.check_leg(place, following)
        if rejection is not None:
            return _at(time_s, timed, rejection)
    return None


def _at(time_s: float, timed: TimedTrajectory, rejection: Rejection) -> Rejection:
    number = sum(each <= time_s for each in timed.times_s) - 1
    beyond = ", in the stop at its end" if time_s > timed.times_s[-1] else ""
    return Rejection(
        rejection.code,
        f"The trajectory is rejected {time_s:.1f} s after its first point, after point "
        f"{max(number, 0)}{beyond}: {rejection.message}",
    )


def _check_obstacles(timed: TimedTrajectory, snapshot: LocatedSnapshot) -> Rejection | None:
    """Return which known obstacle is too near; what a sensor sees may be gone by then."""
    config = snapshot.config.obstacles
    clearance_m = AvoidanceConfig(
        vehicle_radius_m=config.vehicle_radius_m, margin_m=config.margin_m
    ).conflict_clearance_m
    times_s, places = _positions(timed, max(timed.begun_s(snapshot.time_s), 0.0))
    for obstacle in snapshot.known_obstacles:
        index = first_conflict(np.array(places), Obstacles.of((obstacle,)), clearance_m)
        if index is not None:
            x, y, z = places[index]
            text = (
                f"the known obstacle '{obstacle.name}' is nearer than {clearance_m:g} m to "
                f"({x:.1f}, {y:.1f}, {z:.1f}) m."
            )
            return _at(times_s[index], timed, Rejection(OutcomeCode.NO_PATH, text))
    return None
