"""What the server publishes, as a ROS 2 subscriber sees it."""

from __future__ import annotations

import math
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus

from custom_interfaces.msg import GoalEvent, VehicleStatus
from drone_navigation.qos import LATCHED_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = pytest.mark.xdist_group("ros_actions")


def test_the_vehicle_the_plan_and_the_goal_can_be_watched(flight: Flight) -> None:
    heard: dict[str, list[Any]] = {}
    for name, kind, qos in (
        ("pose", PoseStamped, 10),
        ("odometry", Odometry, 10),
        ("fix", NavSatFix, 10),
        ("battery", BatteryState, 10),
        ("plan", Path, LATCHED_QOS),
        ("vehicle_status", VehicleStatus, LATCHED_QOS),
        ("goal_events", GoalEvent, 10),
        ("/diagnostics", DiagnosticArray, 10),
    ):
        topic = name if name.startswith("/") else f"{SERVER_NODE_NAME}/{name}"
        flight.subscribe(kind, topic, heard.setdefault(name, []).append, qos)
    record = flight.send(navigate_goal(6.0, 3.0, 3.0))
    flight.wait_for_result(record)
    flight.wait(lambda: not heard["plan"][-1].poses, 5.0, "the end of the plan")

    where = heard["pose"][-1].pose.position
    assert math.dist((where.x, where.y, where.z), (6.0, 3.0, 3.0)) < 1.0
    assert heard["pose"][-1].header.frame_id == "map"
    assert heard["odometry"][-1].child_frame_id == "base_link"
    assert max(item.twist.twist.linear.x for item in heard["odometry"]) > 0.5
    assert heard["fix"][-1].status.status >= NavSatStatus.STATUS_FIX
    assert heard["fix"][-1].latitude == pytest.approx(-35.363, abs=0.001)
    assert 0.0 < heard["battery"][-1].percentage <= 1.0
    plan = next(path for path in heard["plan"] if path.poses)
    end = plan.poses[-1].pose.position
    assert (end.x, end.y, end.z) == pytest.approx((6.0, 3.0, 3.0))

    modes = [status.mode for status in heard["vehicle_status"]]
    assert "GUIDED" in modes
    assert heard["vehicle_status"][-1].connected
    assert heard["vehicle_status"][-1].autopilot == "ArduCopter"
    assert heard["vehicle_status"][-1].armed

    events = [(item.event, item.what) for item in heard["goal_events"]]
    assert events[0] == ("ACCEPTED", "")
    assert ("STATUS", "NAVIGATING") in events
    assert events[-1] == ("ENDED", "SUCCESS")
    assert len({item.goal_id for item in heard["goal_events"]}) == 1

    status = heard["/diagnostics"][-1].status[0]
    assert status.level == DiagnosticStatus.OK, status.message
    values = {item.key: item.value for item in status.values}
    assert float(values["messages per second"]) > 20.0
    assert values["round trip"].endswith(" ms")
