"""The server's topics, as a ROS 2 subscriber sees them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geographic_msgs.msg import GeoPoseStamped
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix, NavSatStatus
from tf2_msgs.msg import TFMessage

from custom_interfaces.msg import GoalEvent, VehicleStatus
from drone_navigation.qos import LATCHED_QOS
from mavlink_vehicle.positions.earth import earth_position_m
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]


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


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec * 10**9 + stamp.nanosec)


def test_the_tree_of_frames_is_connected_and_places_the_vehicle_in_map(flight: Flight) -> None:
    moving: list[Any] = []
    still: list[Any] = []
    poses: list[PoseStamped] = []
    geodetic: list[GeoPoseStamped] = []
    grids: list[OccupancyGrid] = []
    flight.subscribe(TFMessage, "/tf", lambda item: moving.extend(item.transforms), 100)
    flight.subscribe(
        TFMessage, "/tf_static", lambda item: still.extend(item.transforms), LATCHED_QOS
    )
    flight.subscribe(PoseStamped, f"{SERVER_NODE_NAME}/pose", poses.append, 10)
    flight.subscribe(GeoPoseStamped, f"{SERVER_NODE_NAME}/geo_pose", geodetic.append, 10)
    flight.subscribe(OccupancyGrid, f"{SERVER_NODE_NAME}/obstacle_grid", grids.append, LATCHED_QOS)
    flight.wait(lambda: len(poses) > 20 and len(grids) > 2 and len(moving) > 40, 20.0, "the tree")

    parents: dict[str, set[str]] = {}
    for one in (*moving, *still):
        parents.setdefault(one.child_frame_id, set()).add(one.header.frame_id)
    assert parents == {
        "map": {"earth"}, "odom": {"map"}, "base_link": {"odom"}, "gps": {"base_link"},
    }  # fmt: skip

    # The tree at the stamp of a pose is that pose, and the stamp is not that of its arrival.
    pairs: dict[int, dict[str, Any]] = {}
    for one in moving:
        pairs.setdefault(_nanoseconds(one.header.stamp), {})[one.child_frame_id] = one.transform
    placed = [pose for pose in poses if len(pairs.get(_nanoseconds(pose.header.stamp), ())) == 2]
    assert len(placed) > 10
    for pose in placed:
        tree = pairs[_nanoseconds(pose.header.stamp)]
        odom, inner, place = tree["odom"], tree["base_link"], pose.pose.position
        assert odom.rotation.w == pytest.approx(1.0)
        found = [getattr(odom.translation, a) + getattr(inner.translation, a) for a in "xyz"]
        assert found == pytest.approx([place.x, place.y, place.z], abs=1e-6)
        assert inner.rotation == pose.pose.orientation
    stamps = [_nanoseconds(pose.header.stamp) for pose in poses]
    assert all(earlier < later for earlier, later in pairwise(stamps))

    place = geodetic[-1].pose.position
    assert (place.latitude, place.longitude) == pytest.approx((-35.363262, 149.165237), abs=1e-4)
    (earth,) = {one.child_frame_id: one for one in still if one.child_frame_id == "map"}.values()
    moved = earth.transform.translation
    origin = earth_position_m(place.latitude, place.longitude, place.altitude)
    assert math.dist((moved.x, moved.y, moved.z), origin) < 50.0
    info = grids[-1].info
    assert len(grids[-1].data) == info.width * info.height
    assert info.width * info.resolution == pytest.approx(200.0)
