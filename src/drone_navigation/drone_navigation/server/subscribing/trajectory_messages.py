"""Conversions of trajectories of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from geometry_msgs.msg import Quaternion, Twist, Vector3
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from custom_interfaces.action import FollowTrajectory
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.frames.transform_tree import Placed
from mavlink_vehicle.positions.frames import quaternion_multiply, quaternion_turn
from navigation_bridge.goals.point_requests import yaw_enu_rad
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP
from navigation_core.geometry import Vector3 as Vector
from navigation_core.trajectories.timed_point import TimedPoint

__all__ = ["placed_in_time", "request_from_trajectory", "request_of"]


def request_from_trajectory(
    goal: FollowTrajectory.Goal, request: type[TrajectoryRequest] = TrajectoryRequest
) -> TrajectoryRequest:
    """Return the request that a FollowTrajectory goal makes."""
    return request_of(goal.trajectory, request)


def request_of(
    message: MultiDOFJointTrajectory,
    request: type[TrajectoryRequest] = TrajectoryRequest,
    axes: Placed | None = None,
) -> TrajectoryRequest:
    """Return a trajectory as a request, or with why it is none; its stamp is not looked at.

    Args:
        message: the trajectory.
        request: what is made of it.
        axes: pose of its frame in the map, in whose axes the points are then; None to leave them.
    """
    frame_id = message.header.frame_id if axes is None else FRAME_MAP
    if len(message.joint_names) > 1:
        names = ", ".join(message.joint_names)
        return request(frame_id, fault=f"It has the joints {names}; give one.")
    points: list[TimedPoint] = []
    for number, point in enumerate(message.points):
        made = _point(point, axes or Placed())
        if isinstance(made, str):
            return request(frame_id, fault=f"Point {number} {made}.")
        points.append(made)
    return request(frame_id, tuple(points))


def placed_in_time(
    request: TrajectoryRequest, message: MultiDOFJointTrajectory, access: BridgeAccess
) -> TrajectoryRequest:
    """Return a request in `map` or `base_link`, with the time of its stamp.

    One in another frame is turned into `map`, with the transform of the time of its stamp.
    """
    stamp = message.header.stamp
    stamp_s = stamp.sec + 1e-9 * stamp.nanosec
    request = replace(request, frame_id=access.frames.plain(request.frame_id))
    if request.points and request.frame_id not in ("", FRAME_MAP, FRAME_BASE_LINK):
        axes = access.trajectory_frames.axes(message.header.frame_id, stamp_s)
        if isinstance(axes, str):
            return replace(request, frame_fault=axes)
        request = request_of(message, type(request), axes)
    if stamp_s == 0.0:
        return request
    now_s = 1e-9 * access.node.get_clock().now().nanoseconds
    return replace(request, begins_s=access.clock.now() - (now_s - stamp_s))


def _point(message: MultiDOFJointTrajectoryPoint, axes: Placed) -> TimedPoint | str:
    """Return a point in the axes that a pose places its own in, or what is wrong with it."""
    for name in ("transforms", "velocities", "accelerations"):
        count = len(getattr(message, name))
        if count > 1 or (count == 0 and name == "transforms"):
            return f"has {count} {name}; give one"
    transform = message.transforms[0]
    turn: Quaternion = transform.rotation
    yaw = None
    if any((turn.x, turn.y, turn.z, turn.w)):
        w, x, y, z = quaternion_multiply(axes.turn, (turn.w, turn.x, turn.y, turn.z))
        yaw = yaw_enu_rad((x, y, z, w))
        if yaw is None:
            return "has a rotation without a yaw; give all zeros for the direction of travel"
    time = message.time_from_start
    turns = [quaternion_turn(axes.turn, _vector(twist.angular)) for twist in message.velocities]
    return TimedPoint(
        time.sec + 1e-9 * time.nanosec,
        axes.of(_vector(transform.translation)),
        _linear(message.velocities, axes),
        _linear(message.accelerations, axes),
        yaw,
        turns[0][2] if turns else 0.0,
    )


def _linear(twists: Sequence[Twist], axes: Placed) -> Vector | None:
    """Return the linear part in the other axes, if there is one."""
    return quaternion_turn(axes.turn, _vector(twists[0].linear)) if twists else None


def _vector(message: Vector3) -> Vector:
    return (message.x, message.y, message.z)
