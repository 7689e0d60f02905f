"""Trajectories whose frame stands anywhere in the map, also on its side."""

from __future__ import annotations

import math

import pytest
from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from drone_navigation.server.frames.transform_tree import Placed
from drone_navigation.server.subscribing.trajectory_messages import request_of

_HALF = math.sqrt(0.5)
# x to the east, y down, z to the north: the axes of a camera that looks north.
_CAMERA = Placed((10.0, 20.0, 3.0), (_HALF, -_HALF, 0.0, 0.0))


def message(rotation: Quaternion) -> MultiDOFJointTrajectory:
    """Return a trajectory with one point, whose numbers all differ."""
    turn = Vector3(x=0.7, y=-0.8, z=0.9)
    twist = Twist(linear=Vector3(x=0.1, y=0.2, z=0.3), angular=turn)
    more = Twist(linear=Vector3(x=0.4, y=0.5, z=0.6))
    place = Transform(translation=Vector3(x=1.0, y=2.0, z=3.0), rotation=rotation)
    point = MultiDOFJointTrajectoryPoint(
        transforms=[place], velocities=[twist], accelerations=[more]
    )
    made = MultiDOFJointTrajectory(points=[point])
    made.header.frame_id = "camera"
    return made


def test_points_of_a_tilted_frame_are_turned_with_all_that_belongs_to_them() -> None:
    # The nose along the camera's z, so to the north, and its left along the camera's -x.
    request = request_of(message(Quaternion(x=0.5, y=-0.5, z=0.5, w=0.5)), axes=_CAMERA)
    assert request.frame_id == "map"
    assert not request.fault
    (point,) = request.points
    assert point.position_enu_m == pytest.approx((11.0, 23.0, 1.0))
    assert point.velocity_enu_m_s == pytest.approx((0.1, 0.3, -0.2))
    assert point.acceleration_enu_m_s2 == pytest.approx((0.4, 0.6, -0.5))
    assert point.yaw_enu_rad == pytest.approx(0.5 * math.pi)
    assert point.yaw_rate_rad_s == pytest.approx(0.8)


def test_a_nose_that_points_down_in_the_map_has_no_yaw() -> None:
    # Along the camera's y.
    request = request_of(message(Quaternion(x=0.0, y=0.0, z=_HALF, w=_HALF)), axes=_CAMERA)
    assert "rotation without a yaw" in request.fault
    assert request_of(message(Quaternion(x=0.0, y=0.0, z=_HALF, w=_HALF))).points
