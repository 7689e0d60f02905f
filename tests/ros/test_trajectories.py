"""Trajectories of another program through real DDS: a goal, and a topic that replaces them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import pytest
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from custom_interfaces.action import FollowTrajectory, Takeoff
from custom_interfaces.msg import GoalCode, GoalEvent
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]

_SPEED_M_S, _RADIUS_M = 1.0, 3.0


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    flight = Flight(tmp_path_factory.mktemp("trajectories"))
    yield flight
    flight.close()


def arc(
    start: Vector3, begin_s: float, end_s: float, frame_id: str = "map"
) -> MultiDOFJointTrajectory:
    """Return a part of a circle through the start, which faces the direction of travel."""
    message = MultiDOFJointTrajectory(joint_names=["base_link"])
    message.header.frame_id = frame_id
    rate = _SPEED_M_S / _RADIUS_M
    for i in range(41):
        time_s = begin_s + (end_s - begin_s) * i / 40.0
        cosine, sine = math.cos(rate * time_s), math.sin(rate * time_s)
        point = MultiDOFJointTrajectoryPoint(
            transforms=[
                Transform(
                    translation=Vector3(
                        x=start.x + _RADIUS_M * (cosine - 1.0),
                        y=start.y + _RADIUS_M * sine,
                        z=start.z,
                    ),
                    rotation=Quaternion(x=0.0, y=0.0, z=0.0, w=0.0),
                )
            ],
            velocities=[Twist(linear=Vector3(x=-_SPEED_M_S * sine, y=_SPEED_M_S * cosine))],
        )
        since_s = time_s - begin_s
        point.time_from_start.sec = int(since_s)
        point.time_from_start.nanosec = int(1e9 * (since_s - int(since_s)))
        message.points.append(point)
    return message


def test_a_trajectory_is_flown_replaced_and_rejected_with_a_code(flight: Flight) -> None:
    events: list[GoalEvent] = []
    flight.subscribe(GoalEvent, f"{SERVER_NODE_NAME}/goal_events", events.append, 10)
    result = flight.wait_for_result(flight.send(Takeoff.Goal(height=4.0)))
    assert result.success, result.message
    pose = result.final_pose.pose.position
    start = Vector3(x=pose.x, y=pose.y, z=pose.z)

    too_far = arc(Vector3(x=start.x + 30.0, y=start.y, z=start.z), 0.0, 6.0)
    assert not flight.send(FollowTrajectory.Goal(trajectory=too_far)).accepted
    flight.wait(lambda: any(e.what == "TRAJECTORY_INVALID" for e in events), 5.0, "a rejection")
    rejected = next(e for e in events if e.what == "TRAJECTORY_INVALID")
    assert "trajectory_start_distance_m" in rejected.message

    record = flight.send(FollowTrajectory.Goal(trajectory=arc(start, 0.0, 8.0)))
    assert record.accepted
    flight.wait_for_status(record, "NAVIGATING")
    flight.wait(lambda: record.feedback[-1].distance_remaining < 5.0, 15.0, "half of the arc")
    assert record.feedback[-1].error < 0.5
    assert record.feedback[-1].time_scale > 0.5

    publisher = flight.advertise(MultiDOFJointTrajectory, f"{SERVER_NODE_NAME}/cmd_trajectory", 1)
    flight.wait(lambda: publisher.get_subscription_count() > 0, 5.0, "the server")
    unknown = arc(start, 0.0, 8.0, "camera")
    publisher.publish(unknown)
    flight.wait(lambda: any("UNKNOWN_FRAME" in e.message for e in events), 5.0, "a remark")
    assert record.feedback[-1].replacements == 0
    position = record.feedback[-1].current_pose.pose.position
    angle = math.atan2(position.y - start.y, position.x - start.x + _RADIUS_M)
    now_s = angle * _RADIUS_M / _SPEED_M_S
    publisher.publish(arc(start, now_s, now_s + 6.0))
    flight.wait(lambda: record.feedback[-1].replacements == 1, 5.0, "the replacement")
    flight.wait_for_status(record, "HOLDING")
    end_m = math.dist(
        (position.x, position.y),
        (
            record.feedback[-1].current_pose.pose.position.x,
            record.feedback[-1].current_pose.pose.position.y,
        ),
    )
    assert 2.0 < end_m < 2.2 * _RADIUS_M
    ended = flight.wait_for_result(record, 60.0)
    assert ended.error_code == GoalCode.TIMEOUT
    assert "ended in motion" in ended.message


_LATE_OR_NOT = r"(Setpoints were up to \d+\.\d\d s late\.)?"


def placed(frame_id: str, x: float, y: float, yaw_rad: float) -> TFMessage:
    """Return the pose of a frame in the map."""
    transform = TransformStamped(child_frame_id=frame_id)
    transform.header.frame_id = "map"
    transform.transform.translation = Vector3(x=x, y=y)
    transform.transform.rotation = Quaternion(z=math.sin(yaw_rad / 2.0), w=math.cos(yaw_rad / 2.0))
    return TFMessage(transforms=[transform])


def test_a_trajectory_in_a_frame_of_tf_is_flown_unless_the_frame_is_missing_or_moves(
    flight: Flight,
) -> None:
    events: list[GoalEvent] = []
    poses: list[Vector3] = []
    flight.subscribe(GoalEvent, f"{SERVER_NODE_NAME}/goal_events", events.append, 10)
    flight.subscribe(
        Odometry,
        f"{SERVER_NODE_NAME}/odometry",
        lambda message: poses.append(message.pose.pose.position),
        10,
    )
    still = flight.advertise(
        TFMessage, "/tf_static", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    )
    moving = flight.advertise(TFMessage, "/tf", 10)
    # x of the frame is north, y is west.
    still.publish(placed("planner", 10.0, -20.0, 0.5 * math.pi))

    def codes() -> list[str]:
        return [event.what for event in events]

    flight.wait(lambda: bool(poses), 5.0, "a pose")
    here = poses[-1]
    start = Vector3(x=here.y + 20.0, y=10.0 - here.x, z=here.z)
    nowhere = arc(start, 0.0, 3.0, "nowhere")
    assert not flight.send(FollowTrajectory.Goal(trajectory=nowhere)).accepted
    flight.wait(lambda: "UNKNOWN_FRAME" in codes(), 5.0, "a rejection")
    assert "no transform from 'nowhere'" in events[-1].message

    record = flight.send(FollowTrajectory.Goal(trajectory=arc(start, 0.0, 6.0, "planner")))
    assert record.accepted, [event.message for event in events]
    flight.wait_for_status(record, "HOLDING")
    angle, flown = 6.0 * _SPEED_M_S / _RADIUS_M, poses[-1]
    # The stop after the last point leads on by up to 1 m.
    end = (
        here.x - _RADIUS_M * math.sin(angle),
        here.y + _RADIUS_M * (math.cos(angle) - 1.0),
    )
    assert math.dist((flown.x, flown.y), end) < 1.2
    # On a busy machine setpoints are late, which is another matter.
    assert re.fullmatch(_LATE_OR_NOT, record.feedback[-1].limited_by)

    publisher = flight.advertise(MultiDOFJointTrajectory, f"{SERVER_NODE_NAME}/cmd_trajectory", 1)
    flight.wait(lambda: publisher.get_subscription_count() > 0, 5.0, "the server")
    for step in range(30):
        message = placed("deck", 0.1 * step, 0.0, 0.0)
        message.transforms[0].header.stamp = flight.node.get_clock().now().to_msg()
        moving.publish(message)
        flight.spin_for(0.05)
    publisher.publish(arc(flown, 0.0, 6.0, "deck"))
    flight.wait(lambda: any("'deck' moves" in e.message for e in events), 5.0, "a remark")
    assert record.feedback[-1].replacements == 0
    flight.cancel(record)
    flight.wait_for_result(record)
