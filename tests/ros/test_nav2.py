"""Clients of Nav2 fly a vehicle by navigation_nav2."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import NavSatFix

from custom_interfaces.msg import GoalCode
from drone_navigation.processes import ros_environment
from drone_navigation.qos import STREAM_QOS
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal, new_domain

pytest.importorskip("nav2_msgs", reason="nav2_msgs is not built: run make setup-nav2")

from geographic_msgs.msg import GeoPose
from nav2_msgs import action, srv

from tests.support.ros.nav2_client import (
    ABORTED,
    ACTIONS,
    CANCELED,
    SUCCEEDED,
    Nav2Client,
    pose,
    route,
)

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_nav2")]

ACTIVE = 3
LEAST_M = 3.0
HIGH_M = 6.0


@pytest.fixture(scope="module")
def flown(flight: Flight) -> Iterator[Nav2Client]:
    """A copter, at first on the ground."""
    client = Nav2Client(flight)
    yield client
    client.close()


@pytest.fixture
def nav2(flown: Nav2Client, flight: Flight) -> Nav2Client:
    """The copter as it is, with a server that runs."""
    if flight.server is None or flight.server.returncode is not None:
        flight.server = flight.start_server()
        flight.server.wait_for("Position valid", READY_TIMEOUT_S)
        assert flown.missing() == []
        flown.wait_until_active()
    return flown


@pytest.fixture
def high(nav2: Nav2Client) -> Nav2Client:
    """The copter at a height of 6 m."""
    if not nav2.poses or abs(nav2.place[2] - HIGH_M) > 0.4:
        nav2.flown(action.NavigateToPose.Goal(pose=pose(0.0, 0.0, HIGH_M)))
    return nav2


def near(place: tuple[float, ...], other: tuple[float, ...], within_m: float = 0.8) -> bool:
    return math.dist(place, other) < within_m


def code(number: int, result: Any) -> int:
    """Return a number of GoalCode as a result carries it: 1 and 2 may be Nav2's own."""
    is_taken = number in (1, 2) and hasattr(result, "GOAL_REJECTED")
    return int(result.UNKNOWN) if is_taken else number


def test_all_servers_are_there_and_the_navigator_becomes_active(nav2: Nav2Client) -> None:
    assert nav2.missing() == []
    nav2.wait_until_active()
    assert nav2.call("amcl/get_state").current_state.id == ACTIVE
    told = PoseWithCovarianceStamped()
    told.pose.pose.position.x = 50.0
    nav2.initial_pose.publish(told)
    nav2.process.wait_for("The initial pose is ignored, and 50 m", 10.0)
    assert nav2.poses[-1].header.frame_id == "map"


def test_a_second_one_ends_with_the_reason(nav2: Nav2Client, flight: Flight) -> None:
    assert nav2.missing() == []
    words = ["python", "-m", "drone_navigation.navigation_nav2"]
    second = Process("second", words, flight.environment)
    try:
        assert second.wait(120.0) == 1, second.text
    finally:
        second.stop()
    assert "Another node offers navigate_to_pose in this ROS domain" in second.text


@pytest.mark.night
def test_one_that_discovers_another_late_ends_with_the_reason() -> None:
    environment = ros_environment(new_domain())
    words = ["python", "-m", "drone_navigation.navigation_nav2"]
    first = Process("first", words, environment)
    second = None
    try:
        first.wait_for("Ready for clients of Nav2", 60.0)
        first.signal(signal.SIGSTOP)  # It does not answer, as on an overloaded machine.
        second = Process("second", words, environment)
        second.wait_for("Ready for clients of Nav2", 60.0)
        first.signal(signal.SIGCONT)
        assert second.wait(90.0) == 1, second.text
        assert "Another node offers navigate_to_pose in this ROS domain" in second.text
    finally:
        first.signal(signal.SIGCONT)
        for each in (first, second):
            if each is not None:
                each.stop()


@pytest.mark.night
def test_of_several_that_start_at_once_one_stays() -> None:
    environment = ros_environment(new_domain())
    words = ["python", "-m", "drone_navigation.navigation_nav2"]
    all_three = [Process(name, words, environment) for name in ("first", "second", "third")]
    try:
        until_s = time.monotonic() + 300.0
        while sum(each.returncode is None for each in all_three) > 1 and time.monotonic() < until_s:
            time.sleep(0.1)
        time.sleep(5.0)  # A further end would come at the same moment.
        ended = [each for each in all_three if each.returncode is not None]
        assert len(ended) == 2, [each.text for each in all_three]
        for each in ended:
            assert each.wait(1.0) == 1
            assert "Another node offers navigate_to_pose in this ROS domain" in each.text
    finally:
        for each in all_three:
            each.stop()


def test_a_pose_without_a_height_takes_a_copter_off_and_keeps_its_height(
    nav2: Nav2Client, flight: Flight
) -> None:
    flight.ground()
    record = nav2.flown(action.NavigateToPose.Goal(pose=pose(5.0, 2.0)))
    assert near(nav2.place, (5.0, 2.0, LEAST_M))
    first, last = record.feedback[0], record.feedback[-1]
    assert first.distance_remaining > 4.0
    assert last.distance_remaining < 0.5
    assert last.navigation_time.sec >= 3
    assert first.estimated_time_remaining.sec > last.estimated_time_remaining.sec
    assert near((last.current_pose.pose.position.x, last.current_pose.pose.position.y), (5.0, 2.0))
    if hasattr(last, "position_tracking_error"):
        # A straight path, which the vehicle faces.
        beside_m = [each.position_tracking_error for each in record.feedback]
        assert 0.0 < max(map(abs, beside_m)) < 1.0
        assert abs(record.feedback[len(beside_m) // 2].heading_tracking_error) < 0.3
    nav2.flown(action.NavigateToPose.Goal(pose=pose(5.0, 2.0, 6.0)))
    nav2.flown(action.NavigateToPose.Goal(pose=pose(3.0, 2.0)))
    assert near(nav2.place, (3.0, 2.0, 6.0))


def test_a_new_goal_replaces_the_one_before(high: Nav2Client) -> None:
    nav2 = high
    old = nav2.send(action.NavigateToPose.Goal(pose=pose(30.0, 0.0)))
    new = nav2.send(action.NavigateToPose.Goal(pose=pose(2.0, 0.0)))
    status, result = nav2.wait(old)
    assert (status, result.error_code) == (ABORTED, code(GoalCode.PREEMPTED, result))
    assert result.error_msg.startswith("PREEMPTED: ")
    nav2.wait(new)
    assert near(nav2.place, (2.0, 0.0, 6.0))


def test_a_replacement_that_the_server_rejects_stops_the_vehicle(
    nav2: Nav2Client, flight: Flight
) -> None:
    old = nav2.send(action.NavigateToPose.Goal(pose=pose(30.0, 0.0)))
    flight.wait(lambda: len(old.feedback) > 3, 20.0, "feedback")
    new = nav2.send(action.NavigateToPose.Goal(pose=pose(9000.0, 0.0)))
    status, result = nav2.wait(new)
    assert (status, result.error_code) == (ABORTED, GoalCode.OUTSIDE_VOLUME)
    assert result.error_msg.startswith("OUTSIDE_VOLUME: The target (9000.00, 0.00, ")
    assert nav2.wait(old)[0] == ABORTED
    here = nav2.place
    flight.spin_for(1.5)
    assert near(nav2.place, here, 0.3)


def test_a_cancel_stops_the_vehicle(nav2: Nav2Client, flight: Flight) -> None:
    record = nav2.send(action.NavigateToPose.Goal(pose=pose(30.0, 0.0)))
    flight.wait(lambda: len(record.feedback) > 3, 20.0, "feedback")
    assert flight.cancel(record).goals_canceling
    status, result = nav2.wait(record)
    assert (status, result.error_code) == (CANCELED, code(GoalCode.CANCELED, result))
    here = nav2.place
    flight.spin_for(1.0)
    assert near(nav2.place, here, 0.3)


def test_a_goal_that_others_end_is_aborted_with_their_reason(
    nav2: Nav2Client, flight: Flight
) -> None:
    record = nav2.send(action.NavigateToPose.Goal(pose=pose(30.0, 0.0)))
    flight.wait(lambda: len(record.feedback) > 3, 20.0, "feedback")
    assert flight.call("hold").success
    status, result = nav2.wait(record)
    assert (status, result.error_code) == (ABORTED, code(GoalCode.PREEMPTED, result))
    record = nav2.send(action.NavigateToPose.Goal(pose=pose(30.0, 0.0)))
    flight.wait(lambda: len(record.feedback) > 3, 20.0, "feedback")
    direct = flight.send(navigate_goal(0.0, 0.0, 6.0))
    status, result = nav2.wait(record)
    assert (status, result.error_code) == (ABORTED, code(GoalCode.PREEMPTED, result))
    assert flight.wait_for_result(direct).success


def test_routes_are_flown_pose_by_pose(high: Nav2Client) -> None:
    nav2 = high
    poses = [pose(3.0, 0.0), pose(3.0, 3.0), pose(0.0, 3.0)]
    through = nav2.flown(action.NavigateThroughPoses.Goal(poses=route(poses)))
    if hasattr(through.result, "waypoint_statuses"):
        final = through.result.waypoint_statuses
        assert [each.waypoint_status for each in final] == [final[0].COMPLETED] * 3
        assert [each.waypoint_index for each in final] == [0, 1, 2]
        assert [each.waypoint_pose for each in final] == poses
        first, last = (through.feedback[i].waypoint_statuses for i in (0, -1))
        assert [each.waypoint_status for each in first] == [final[0].PENDING] * 3
        assert [each.waypoint_status for each in last] == [*[final[0].COMPLETED] * 2, 0]
    left = [feedback.number_of_poses_remaining for feedback in through.feedback]
    assert (left[0], left[-1]) == (3, 1)
    assert left == sorted(left, reverse=True)
    assert near(nav2.place, (0.0, 3.0, 6.0))
    goal = action.FollowWaypoints.Goal(poses=poses[:2], number_of_loops=1, goal_index=1)
    followed = nav2.flown(goal)
    assert not followed.result.missed_waypoints
    indices = [feedback.current_waypoint for feedback in followed.feedback]
    changes = [i for n, i in enumerate(indices) if n == 0 or indices[n - 1] != i]
    assert changes == [1, 0, 1]
    assert near(nav2.place, (3.0, 3.0, 6.0))


def test_gps_waypoints_are_flown_at_the_height_that_the_vehicle_has(
    nav2: Nav2Client, flight: Flight
) -> None:
    fixes: list[Any] = []
    flight.subscribe(NavSatFix, "navigation_server/fix", fixes.append, STREAM_QOS)
    flight.wait(lambda: bool(fixes), 10.0, "a fix")
    here, before = fixes[-1], nav2.place
    north = GeoPose()
    north.position.latitude = here.latitude + 4.0 / 111_132.0
    north.position.longitude = here.longitude
    nav2.flown(action.FollowGPSWaypoints.Goal(gps_poses=[north]))
    assert near(nav2.place, (before[0], before[1] + 4.0, before[2]), 1.5)
    north.position.altitude = here.altitude + 2.0
    nav2.flown(action.FollowGPSWaypoints.Goal(gps_poses=[north]))
    assert nav2.place[2] == pytest.approx(before[2] + 2.0, abs=1.5)


def test_behaviours_turn_and_move_as_far_as_requested(nav2: Nav2Client) -> None:
    time_allowance = Duration(sec=30)
    nav2.flown(action.NavigateToPose.Goal(pose=pose(0.0, 0.0, 5.0)))
    spun = nav2.flown(action.Spin.Goal(target_yaw=3.5, time_allowance=time_allowance))
    assert spun.feedback[-1].angular_distance_traveled == pytest.approx(3.5, abs=0.2)
    nav2.flown(action.NavigateToPose.Goal(pose=pose(0.0, 0.0, 5.0)))
    back = Point(x=1.0)
    goal = action.BackUp.Goal(target=back, speed=0.5, time_allowance=time_allowance)
    nav2.flown(goal)
    assert near(nav2.place, (-1.0, 0.0, 5.0), 0.3)
    forward = action.DriveOnHeading.Goal(target=Point(x=0.4), speed=0.3)
    nav2.flown(forward)
    assert near(nav2.place, (-0.6, 0.0, 5.0), 0.3)
    late = nav2.send(action.Spin.Goal(target_yaw=12.0, time_allowance=Duration(sec=1)))
    status, result = nav2.wait(late)
    assert (status, result.error_code) == (ABORTED, action.Spin.Result.TIMEOUT)


def test_paths_and_cost_maps_are_answered(nav2: Nav2Client) -> None:
    goal = action.ComputePathToPose.Goal(goal=pose(10.0, 0.0), start=pose(0.0, 0.0), use_start=True)
    path = nav2.flown(goal).result.path
    assert path.header.frame_id == "map"
    assert path.poses[-1].pose.position.x == 10.0
    if hasattr(goal, "viapoints"):
        goal.viapoints = [pose(5.0, 4.0)]
        north = [each.pose.position.y for each in nav2.flown(goal).result.path.poses]
        assert (max(north), north[-1]) == (4.0, 0.0)
    routed = action.ComputePathThroughPoses.Goal(goals=route([pose(5.0, 4.0), pose(9.0, 0.0)]))
    path = nav2.flown(routed).result.path
    assert max(each.pose.position.y for each in path.poses) == 4.0
    away = nav2.send(action.ComputePathToPose.Goal(goal=pose(9000.0, 0.0)))
    status, result = nav2.wait(away)
    outside = action.ComputePathToPose.Result.GOAL_OUTSIDE_MAP
    assert (status, result.error_code) == (ABORTED, outside)
    for name in ("global", "local"):
        cleared = nav2.call(f"{name}_costmap/clear_entirely_{name}_costmap")
        assert getattr(cleared, "success", True)
        found = nav2.call(f"{name}_costmap/get_costmap").map
        assert len(found.data) == found.metadata.size_x * found.metadata.size_y > 0
    nav2.call("local_costmap/clear_costmap_around_robot", reset_distance=1.0)


def test_paths_are_computed_while_ros_time_stands_still(nav2: Nav2Client, flight: Flight) -> None:
    nav2.close()
    nav2.process = nav2.start("--ros-args", "-p", "use_sim_time:=true")
    try:
        assert nav2.missing() == []
        goal = action.ComputePathToPose.Goal(goal=pose(9.0, 0.0), start=pose(0.0, 0.0))
        goal.use_start = True
        until_s, status = time.monotonic() + patient_s(10.0), ABORTED
        while status == ABORTED and time.monotonic() < until_s:
            # It has to have asked the server for its parameters.
            flight.spin_for(0.5)
            status, result = nav2.wait(nav2.send(goal))
        assert status == SUCCEEDED, result
    finally:
        nav2.close()
        nav2.process = nav2.start()


def test_a_route_without_poses_is_aborted_with_nav2s_own_number(nav2: Nav2Client) -> None:
    status, result = nav2.wait(nav2.send(action.FollowWaypoints.Goal()), 5.0)
    number = getattr(result, "NO_VALID_WAYPOINTS", GoalCode.INVALID_WAYPOINTS)
    assert (status, result.error_code) == (ABORTED, number)
    assert result.error_msg == "INVALID_WAYPOINTS: There are no poses."


NOT_OFFERED = [
    "FollowPath",
    "SmoothPath",
    "AssistedTeleop",
    "DockRobot",
    "UndockRobot",
    "ComputeRoute",
    "ComputeAndTrackRoute",
]


@pytest.mark.parametrize("kind", [n for n in NOT_OFFERED if getattr(action, n, None) in ACTIONS])
def test_what_is_not_offered_is_rejected_at_once_with_a_sentence(
    nav2: Nav2Client, kind: str
) -> None:
    status, result = nav2.wait(nav2.send(getattr(action, kind).Goal()), 5.0)
    assert status == ABORTED
    assert "is not offered." in result.error_msg
    assert result.error_code == getattr(action, kind).Result.UNKNOWN
    loaded = nav2.call("map_server/load_map", map_url="map.yaml")
    assert loaded.result == srv.LoadMap.Response.RESULT_UNDEFINED_FAILURE


@pytest.mark.skipif(not hasattr(action, "FollowObject"), reason="nav2_msgs 1.5 has it")
def test_an_object_is_followed_until_it_is_lost(nav2: Nav2Client, flight: Flight) -> None:
    status, result = nav2.wait(nav2.send(action.NavigateToPose.Goal(pose=pose(2.0, 0.0))))
    assert status == SUCCEEDED, result.error_msg
    record = nav2.send(action.FollowObject.Goal())
    status, result = nav2.wait(record, 10.0)
    assert (status, result.error_code) == (ABORTED, code(GoalCode.INVALID_TARGET, result))
    objects = flight.advertise(PoseStamped, "/object", 10)

    def publish() -> None:
        message = pose(10.0, 0.0)
        message.header.stamp = flight.node.get_clock().now().to_msg()
        objects.publish(message)

    timer = flight.node.create_timer(0.1, publish)
    record = nav2.send(action.FollowObject.Goal(pose_topic="/object"))
    controlling = action.FollowObject.Feedback.CONTROLLING
    flight.wait(
        lambda: any(each.state == controlling for each in record.feedback), 30.0, "the object"
    )
    flight.node.destroy_timer(timer)
    status, result = nav2.wait(record, 60.0)
    assert (status, result.error_code) == (ABORTED, result.FAILED_TO_DETECT_OBJECT)
    assert result.error_msg.startswith("TARGET_LOST: ")


def test_a_pose_of_rviz_is_flown_to_and_a_shutdown_stops_the_vehicle(
    nav2: Nav2Client, flight: Flight
) -> None:
    since = len(nav2.process.lines)
    nav2.goal_pose.publish(pose(2.0, -2.0))
    nav2.process.wait_for("navigate_to_pose succeeded", 60.0, after=since)
    assert near(nav2.place[:2], (2.0, -2.0))
    record = nav2.send(action.NavigateToPose.Goal(pose=pose(40.0, 0.0)))
    flight.wait(lambda: len(record.feedback) > 3, 20.0, "feedback")
    command = srv.ManageLifecycleNodes.Request.SHUTDOWN
    assert nav2.call("lifecycle_manager_navigation/manage_nodes", command=command).success
    status, result = nav2.wait(record)
    assert (status, result.error_code) == (ABORTED, code(GoalCode.CANCELED, result))
    # The next script finds it as the first one did.
    assert nav2.call("bt_navigator/get_state").current_state.id == ACTIVE


def test_its_end_cancels_the_goal_and_a_server_that_ended_is_named(
    nav2: Nav2Client, flight: Flight
) -> None:
    record = nav2.send(action.NavigateToPose.Goal(pose=pose(40.0, 0.0)))
    flight.wait(lambda: len(record.feedback) > 3, 20.0, "feedback")
    since = len(flight.server.lines) if flight.server else 0
    nav2.close()
    assert flight.server is not None
    flight.server.wait_for("CANCELED", 10.0, after=since)
    nav2.process = nav2.start()
    assert nav2.missing() == []
    nav2.wait_until_active()
    flight.server.stop()
    started_s = time.monotonic()
    while nav2.call("amcl/get_state").current_state.id == ACTIVE:
        assert time.monotonic() < started_s + patient_s(20.0)
        flight.spin_for(0.2)
    status, result = nav2.wait(nav2.send(action.NavigateToPose.Goal(pose=pose(1.0, 0.0))))
    assert (status, result.error_code) == (ABORTED, GoalCode.NO_VEHICLE)


def test_a_rover_drives_to_poses_and_rejects_what_it_cannot_do(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    rover = Flight(tmp_path_factory.mktemp("rover"), simulator=("--vehicle", "rover"))
    try:
        client = Nav2Client(rover)
        try:
            assert client.missing() == []
            client.wait_until_active()
            client.flown(action.NavigateToPose.Goal(pose=pose(8.0, 3.0)))
            assert near(client.place[:2], (8.0, 3.0))
            for goal in (action.Spin.Goal(target_yaw=1.57), action.BackUp.Goal(speed=0.1)):
                status, result = client.wait(client.send(goal), 5.0)
                assert (status, result.error_code) == (ABORTED, GoalCode.UNSUPPORTED_VEHICLE)
            forward = action.DriveOnHeading.Goal(target=Point(x=3.0), speed=1.0)
            client.flown(forward)
        finally:
            client.close()
    finally:
        rover.close()


def test_the_demo_flies_a_pose_and_waypoints(tmp_path: Path) -> None:
    demo = Process("demo", ["python", "-m", "drone_navigation.demo_nav2", "--out", str(tmp_path)])
    try:
        assert demo.wait(150.0) == 0, demo.text
    finally:
        demo.stop()
    assert "navigate_to_pose: SUCCEEDED" in demo.text
    assert "follow_waypoints: SUCCEEDED" in demo.text
