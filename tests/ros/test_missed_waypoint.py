"""A route of a rover that cannot meet one of its waypoints, as a ROS 2 client sees its result."""

from __future__ import annotations

from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Point

from custom_interfaces.action import NavigateWaypoints
from custom_interfaces.msg import GoalCode, Waypoint
from tests.support.ros.ros_flight import Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_missed_waypoint")]


def test_the_result_lists_what_was_missed(tmp_path: Path) -> None:
    flight = Flight(tmp_path, simulator=("--vehicle", "rover"))
    try:
        # The second is within the turning circle of who comes from the first.
        points = [(8.0, 0.0, 1.0), (8.0, 1.0, 0.1), (16.0, 0.0, 1.0)]
        waypoints = [
            Waypoint(position=Point(x=x, y=y), acceptance_radius=radius_m)
            for x, y, radius_m in points
        ]
        record = flight.send(NavigateWaypoints.Goal(waypoints=waypoints))
        result = flight.wait_for_result(record)
        assert record.status == GoalStatus.STATUS_ABORTED, result.message
        assert result.error_code == GoalCode.WAYPOINT_MISSED
        assert result.message.startswith("WAYPOINT_MISSED: Flew 2 of 3 waypoints.")
        assert not result.success
        assert result.waypoints_reached == 2
        assert list(result.waypoints_missed) == [1]
        assert result.next_index == 3
        assert result.route_id > 0
    finally:
        flight.close()
