"""Conversions of trajectories of other programs."""

from __future__ import annotations

from dataclasses import replace

from geometry_msgs.msg import Quaternion, Vector3
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from custom_interfaces.action import FollowTrajectory
from drone_navigation.server.bridge_access import BridgeAccess
from navigation_bridge.goals.point_requests import yaw_enu_rad
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_core.trajectories.timed_point import TimedPoint

__all__ = ["placed_in_time", "request_from_trajectory", "request_of"]


def request_from_trajectory(
    goal: FollowTrajectory.Goal, request: type[TrajectoryRequest] = TrajectoryRequest
) -> TrajectoryRequest:
    """Return the request that a FollowTrajectory goal makes."""
    return request_of(goal.trajectory, request)


def request_of(
    message: MultiDOFJointTrajectory, request: type[TrajectoryRequest] = TrajectoryRequest
) -> TrajectoryRequest:
    """Return a trajectory as a request, or with why it is none; its stamp is not looked at."""
    frame_id = message.header.frame_id
    if len(message.joint_names) > 1:
        names = ", ".join(message.joint_names)
        return request(frame_id, fault=f"It has the joints {names}; give one.")
    points: list[TimedPoint] = []
    for number, point in enumerate(message.points):
        made = _point(point)
        if isinstance(made, str):
            return request(frame_id, fault=f"Point {number} {made}.")
        points.append(made)
    return request(frame_id, tuple(points))


def placed_in_time(
    request: TrajectoryRequest, message: MultiDOFJointTrajectory, access: BridgeAccess
) -> TrajectoryRequest:
    """Return a request in the plain name of its frame, with the time of its stamp."""
    request = replace(request, frame_id=access.frames.plain(request.frame_id))
    stamp = message.header.stamp
    if stamp.sec == 0 and stamp.nanosec == 0:
        return request
    now_s = 1e-9 * access.node.get_clock().now().nanoseconds
    age_s = now_s - (stamp.sec + 1e-9 * stamp.nanosec)
    return replace(request, begins_s=access.clock.now() - age_s)


def _point(message: MultiDOFJointTrajectoryPoint) -> TimedPoint | str:
    """Return a point in the axes of its frame, or what is wrong with it."""
    for name in ("transforms", "velocities", "accelerations"):
        count = len(getattr(message, name))
        if count > 1 or (count == 0 and name == "transforms"):
            return f"has {count} {name}; give one"
    transform = message.transforms[0]
    turn: Quaternion = transform.rotation
    yaw = None
    if any((turn.x, turn.y, turn.z, turn.w)):
        yaw = yaw_enu_rad((turn.x, turn.y, turn.z, turn.w))
        if yaw is None:
            return "has a rotation without a yaw; give all zeros for the direction of travel"
    time = message.time_from_start
    return TimedPoint(
        time.sec + 1e-9 * time.nanosec,
        _vector(transform.translation),
        _vector(message.velocities[0].linear) if message.velocities else None,
        _vector(message.accelerations[0].linear) if message.accelerations else None,
        yaw,
    )


def _vector(message: Vector3) -> tuple[float, float, float]:
    return (message.x, message.y, message.z)
