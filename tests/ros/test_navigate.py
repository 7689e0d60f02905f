"""Goals flown by the real server on the simulated copter, as a ROS 2 client sees them."""

from __future__ import annotations

import itertools
import math

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal

from custom_interfaces.action import Navigate
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = pytest.mark.xdist_group("ros_navigate")


def _distance(message: Navigate.Result, x: float, y: float, z: float) -> float:
    place = message.final_pose.pose.position
    return math.dist((place.x, place.y, place.z), (x, y, z))


def test_the_course_goal_is_flown_from_the_ground(flight: Flight) -> None:
    flight.ground()
    record = flight.send(navigate_goal(10.0, 5.0, 2.0))
    result = flight.wait_for_result(record)

    assert record.status == GoalStatus.STATUS_SUCCEEDED
    assert result.success
    assert result.message.startswith("SUCCESS: ")
    assert _distance(result, 10.0, 5.0, 2.0) == pytest.approx(result.final_error, abs=0.3)
    assert 0.0 < result.final_error < 0.5
    assert result.final_pose.header.frame_id == "map"
    assert 5.0 < result.total_elapsed_time < 40.0
    order = record.statuses
    assert order.index("TAKING_OFF") < order.index("NAVIGATING")
    # A server that has just been started listens for others before it arms anything. Arming may be
    # over before the next feedback.
    begun = order.index("ARMING" if "ARMING" in order else "TAKING_OFF")
    assert "WAITING_FOR_TRAFFIC" not in order[begun:]
    usual = {"PREPARING", "ARMING", "TAKING_OFF", "NAVIGATING", "SETTLING"}
    assert set(order) <= {*usual, "WAITING_FOR_TRAFFIC"}


def test_feedback_reports_position_distance_time_and_battery(flight: Flight) -> None:
    flight.wait_for_result(flight.send(navigate_goal(10.0, 5.0, 3.0)))
    record = flight.send(navigate_goal(-5.0, 5.0, 3.0))
    flight.wait_for_result(record)

    flying = [f for f in record.feedback if f.current_status == "NAVIGATING"]
    assert len(flying) > 20
    distances = [f.distance_remaining for f in flying]
    assert all(b <= a + 0.2 for a, b in itertools.pairwise(distances))
    assert distances[0] == pytest.approx(15.0, abs=1.5)
    assert all(math.isfinite(f.estimated_time_remaining) for f in flying)
    assert flying[0].estimated_time_remaining > flying[-1].estimated_time_remaining > 0.0
    assert all(0.0 < f.battery_percentage <= 100.0 for f in record.feedback)
    xs = [f.current_pose.pose.position.x for f in flying]
    assert xs[0] > 5.0
    assert xs[-1] < 0.0
    assert all(f.current_pose.header.frame_id == "map" for f in flying)


@pytest.mark.wide
def test_base_link_is_relative_to_the_vehicle(flight: Flight) -> None:
    first = flight.wait_for_result(flight.send(navigate_goal(0.0, 0.0, 3.0)))
    goal = navigate_goal(4.0, 3.0, 0.5)
    goal.target_pose.header.frame_id = "base_link"
    result = flight.wait_for_result(flight.send(goal))

    assert result.success, result.message
    start = first.final_pose.pose.position
    # The goal before asked for yaw 0, so forward is east and left is north.
    assert _distance(result, start.x + 4.0, start.y + 3.0, start.z + 0.5) < 1.2


def test_a_cancel_in_flight_stops_the_vehicle_first(flight: Flight) -> None:
    record = flight.send(navigate_goal(40.0, 0.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(3.0)
    assert flight.cancel(record).return_code == CancelGoal.Response.ERROR_NONE
    result = flight.wait_for_result(record)

    assert record.status == GoalStatus.STATUS_CANCELED
    assert not result.success
    assert result.message.startswith("CANCELED: ")
    assert "CANCELLING" in record.statuses
    velocity = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    assert math.hypot(velocity.vx, velocity.vy) / 100.0 < 0.4
    assert _distance(result, 40.0, 0.0, 4.0) > 10.0
    flight.spin_for(2.0)
    later = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    assert math.hypot(later.vx, later.vy) / 100.0 < 0.3


def test_a_new_goal_replaces_the_old_one(flight: Flight) -> None:
    old = flight.send(navigate_goal(-30.0, 0.0, 4.0))
    flight.wait_for_status(old, "NAVIGATING")
    flight.spin_for(2.0)
    new = flight.send(navigate_goal(5.0, 5.0, 4.0))
    old_result = flight.wait_for_result(old, 5.0)
    new_result = flight.wait_for_result(new)

    assert old.status == GoalStatus.STATUS_ABORTED
    assert old_result.message.startswith("PREEMPTED: ")
    assert "another goal" in old_result.message
    assert new_result.success, new_result.message
    assert new.statuses[0] in ("PREPARING", "NAVIGATING")
    assert "TAKING_OFF" not in new.statuses


def test_cancel_all_ends_the_active_goal(flight: Flight) -> None:
    record = flight.send(navigate_goal(30.0, 5.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    answer = flight.cancel_all()
    assert len(answer.goals_canceling) == 1
    flight.wait_for_result(record)
    assert record.status == GoalStatus.STATUS_CANCELED


def test_the_pilot_wins(flight: Flight) -> None:
    record = flight.send(navigate_goal(30.0, 0.0, 4.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(1.0)
    flight.relay.set_mode(17)  # BRAKE
    result = flight.wait_for_result(record, 10.0)
    assert record.status == GoalStatus.STATUS_ABORTED
    assert result.message.startswith("PILOT_OVERRIDE: ")
    assert "BRAKE" in result.message

    sent = len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED"))
    commands = len(flight.relay.from_server("COMMAND_LONG"))
    flight.spin_for(2.0)
    assert len(flight.relay.from_server("SET_POSITION_TARGET_LOCAL_NED")) == sent
    assert len(flight.relay.from_server("COMMAND_LONG")) == commands

    again = flight.wait_for_result(flight.send(navigate_goal(5.0, 0.0, 4.0)))
    assert again.success, again.message


BAD_GOALS = {
    "INVALID_NUMBER": navigate_goal(math.nan, 0.0, 2.0),
    "NEGATIVE_SPEED": navigate_goal(1.0, 0.0, 2.0, speed=-1.0),
    "BELOW_GROUND": navigate_goal(1.0, 0.0, -2.0),
    "OUTSIDE_VOLUME": navigate_goal(1e6, 0.0, 2.0),
    "UNKNOWN_FRAME": navigate_goal(1.0, 0.0, 2.0),
    "INVALID_ORIENTATION": navigate_goal(1.0, 0.0, 2.0),
}
BAD_GOALS["UNKNOWN_FRAME"].target_pose.header.frame_id = "odom"
BAD_GOALS["INVALID_ORIENTATION"].target_pose.pose.orientation.w = 7.0


@pytest.mark.parametrize("code", BAD_GOALS)
def test_a_bad_goal_is_rejected_with_its_reason(flight: Flight, code: str) -> None:
    flight.spin_for(0.3)
    flight.rejections.clear()
    record = flight.send(BAD_GOALS[code])
    assert record.accepted is False
    flight.wait(lambda: bool(flight.rejections), 5.0, "the reason on last_rejection")
    assert flight.rejections[-1].startswith(f"{code}: ")
    assert flight.server is not None
    flight.server.wait_for(f"Goal rejected: {code}: ", 5.0)


def test_a_goal_without_frame_quaternion_and_speed_is_a_good_goal(flight: Flight) -> None:
    goal = Navigate.Goal()
    goal.target_pose.pose.position.x = 2.0
    goal.target_pose.pose.position.z = 3.0
    goal.target_pose.pose.orientation.w = 0.0
    goal.avoid_obstacles = True
    result = flight.wait_for_result(flight.send(goal))
    assert result.success, result.message
    assert "No obstacle sensor reports" in result.message
