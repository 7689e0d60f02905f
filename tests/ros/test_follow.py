"""A target that is followed, as a ROS 2 client and the command see it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from geometry_msgs.msg import TwistStamped

from custom_interfaces.action import Follow, Takeoff
from custom_interfaces.msg import GoalCode, GoalEvent
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight
from tests.support.ros.target_publisher import TargetPublisher

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_orbit")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


@pytest.fixture
def flight(tmp_path: Path) -> Iterator[Flight]:
    made = Flight(tmp_path)
    yield made
    made.close()


def test_a_topic_and_a_frame_are_followed_and_another_type_is_rejected(flight: Flight) -> None:
    events: list[GoalEvent] = []
    flight.subscribe(GoalEvent, f"{SERVER_NODE_NAME}/goal_events", events.append, 10)
    flight.advertise(TwistStamped, "/twist", 10)
    target = TargetPublisher(flight, (10.0, 5.0))
    assert flight.wait_for_result(flight.send(Takeoff.Goal(height=5.0))).success
    goal = Follow.Goal(pose_topic="/twist", max_duration=6.0, lost_timeout=3.0)
    goal.offset.x, goal.offset.z, goal.offset_frame = -5.0, 5.0, Follow.Goal.OFFSET_MAP
    assert not flight.send(goal).accepted
    flight.wait(lambda: "TwistStamped" in events[-1].message, 10.0, "the reason")
    assert events[-1].what == "INVALID_TARGET"

    for name in ("bad name!", "a//b"):
        goal.pose_topic = name
        assert not flight.send(goal).accepted

    goal.pose_topic = "/target"
    record = flight.send(goal)
    result = flight.wait_for_result(record)
    assert result.error_code == GoalCode.SUCCESS, result.message
    assert record.feedback[0].state == Follow.Feedback.ACQUIRING
    assert record.feedback[-1].state == Follow.Feedback.FOLLOWING
    assert math.isnan(record.feedback[0].distance)
    assert math.isnan(record.feedback[0].target_position.x)
    place = record.feedback[-1].target_position
    assert (place.x, place.y) == pytest.approx((12.0, 5.0), abs=0.2)
    flight.wait(
        lambda: flight.node.count_subscribers("/target") == 0, 10.0, "the end of the subscription"
    )

    goal.pose_topic, goal.tracked_frame, goal.max_duration = "", "tag", 10.0
    result = flight.wait_for_result(flight.send(goal))
    assert result.error_code == GoalCode.SUCCESS, result.message
    position = result.final_pose.pose.position
    assert (position.x, position.y, position.z) == pytest.approx((7.0, 5.0, 5.0), abs=1.0)

    goal.tracked_frame = "nowhere"
    result = flight.wait_for_result(flight.send(goal))
    assert result.error_code == GoalCode.TARGET_LOST
    assert "There is no transform from 'nowhere' to 'map'." in result.message

    words = ["follow", "--topic", "/target", "--offset=-5,0,5", "--offset-frame", "map"]
    more = ["--least-distance", "3", "--target-timeout", "2", "--json"]
    shown = Process("client", [*CLIENT, *words, *more], flight.environment)
    flight.wait(lambda: '"FOLLOWING"' in shown.text, 60.0, "the client's progress")
    target.is_silent = True
    flight.wait(lambda: "TARGET_LOST" in shown.text, 60.0, "the end of the target")
    assert shown.wait(30.0) == 1, shown.text
