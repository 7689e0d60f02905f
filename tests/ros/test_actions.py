"""Take-off, landing, return and the services, by the real server, as a ROS 2 client sees them."""

from __future__ import annotations

import pytest
from action_msgs.msg import GoalStatus

from custom_interfaces.action import Land, ReturnToLaunch, Takeoff
from custom_interfaces.msg import GoalCode
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]


def test_arm_disarm_take_off_pause_and_land(flight: Flight) -> None:
    flight.ground()
    assert flight.call("arm").success
    assert flight.call("disarm").success
    record = flight.send(Takeoff.Goal(height=3.0))
    result = flight.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_SUCCEEDED, result.message
    assert result.error_code == GoalCode.SUCCESS
    assert result.message.startswith("SUCCESS: ")
    assert result.final_pose.pose.position.z == pytest.approx(3.0, abs=0.6)
    assert record.feedback[-1].height == pytest.approx(3.0, abs=0.6)

    again = flight.send(Takeoff.Goal(height=3.0))
    assert not again.accepted
    flight.wait(lambda: bool(flight.rejections), 5.0, "a reason")
    assert flight.rejections[-1].startswith("ALREADY_FLYING: ")

    navigate = flight.send(navigate_goal(25.0, 0.0, 3.0))
    flight.wait_for_status(navigate, "NAVIGATING")
    assert flight.call("pause").success
    flight.wait_for_status(navigate, "PAUSED")
    assert not flight.call("disarm").success  # a goal is active
    assert flight.call("resume").success
    flight.wait_for_status(navigate, "NAVIGATING")

    landing = flight.send(Land.Goal())
    result = flight.wait_for_result(landing)
    assert result.error_code == GoalCode.SUCCESS, result.message
    assert "LANDING" in landing.statuses
    assert flight.wait_for_result(navigate).message.startswith("PREEMPTED: ")
    assert not flight.call("pause").success


def test_a_place_on_earth_and_a_return_that_is_cancelled(flight: Flight) -> None:
    goal = navigate_goal(-35.363261, 149.16523 + 1.1e-4, 584.0 + 4.0)
    goal.target_pose.header.frame_id = "wgs84"
    result = flight.wait_for_result(flight.send(goal))
    assert result.success, result.message
    assert result.final_pose.pose.position.x == pytest.approx(10.0, abs=1.0)
    assert result.final_pose.pose.position.y == pytest.approx(0.0, abs=0.6)

    record = flight.send(ReturnToLaunch.Goal())
    flight.wait_for_status(record, "RETURNING")
    flight.cancel(record)
    result = flight.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED
    assert result.error_code == GoalCode.CANCELED, result.message
    assert flight.call("hold").success
