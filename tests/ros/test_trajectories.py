"""Trajectories of another program through real DDS: a goal, and a topic that replaces them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from custom_interfaces.action import FollowTrajectory, Takeoff
from custom_interfaces.msg import GoalCode, GoalEvent
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]

_SPEED_M_S, _RADIUS_M = 1.0, 3.0


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    flight = Flight(tmp_path)
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
