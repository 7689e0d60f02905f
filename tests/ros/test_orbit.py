"""A circle, as a ROS 2 client and the command see it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus

from custom_interfaces.action import Orbit
from custom_interfaces.msg import GoalCode
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_orbit")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


def test_laps_and_radius_error_are_reported_and_a_bad_circle_is_rejected(tmp_path: Path) -> None:
    flight = Flight(tmp_path)
    try:
        goal = Orbit.Goal(radius=-5.0, height=4.0, laps=0.5, max_speed=2.5)
        goal.centre.header.frame_id = "map"
        goal.centre.pose.position.x = 8.0
        goal.radius = 0.0
        assert not flight.send(goal).accepted
        goal.radius = -5.0
        record = flight.send(goal)
        result = flight.wait_for_result(record)
        assert record.status == GoalStatus.STATUS_SUCCEEDED, result.message
        assert (result.error_code, result.laps_flown) == (GoalCode.SUCCESS, 0.5)
        assert result.final_error < 0.5
        assert math.hypot(
            result.final_pose.pose.position.x - 8.0, result.final_pose.pose.position.y
        ) == pytest.approx(5.0, abs=0.5)
        errors_m = [feedback.radius_error for feedback in record.feedback]
        assert math.isnan(errors_m[0]), "not on the circle yet"
        assert max(abs(error) for error in errors_m if not math.isnan(error)) < 0.5
        laps = [feedback.laps_flown for feedback in record.feedback]
        assert laps == sorted(laps)

        words = ["orbit", "8", "0", "--radius", "5", "--laps", "0.1", "--straight", "--json"]
        shown = Process("client", [*CLIENT, *words], flight.environment)
        assert shown.wait(90.0) == 0, shown.text
        assert '"laps_flown": 0.1' in shown.text
    finally:
        flight.close()
