"""Goals that programs fly, made of plain numbers; their ends as exceptions."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import BatteryState, NavSatFix

from custom_interfaces.action import NavigateWaypoints, Orbit
from custom_interfaces.msg import VehicleStatus, Waypoint
from drone_navigation.client.events import Ended
from drone_navigation.programs import goal_messages as goals
from drone_navigation.programs.async_vehicle import AsyncVehicle
from drone_navigation.programs.errors import error_of
from drone_navigation.programs.reported_state import reported_state
from drone_navigation.server import conversions as convert
from navigation_bridge.goals.requests import NavigateRequest

COORDINATES = st.floats(-1e6, 1e6)


@given(COORDINATES, COORDINATES, COORDINATES, st.none() | st.floats(-360.0, 360.0))
def test_the_server_reads_the_position_and_the_yaw_that_a_program_gave(
    x: float, y: float, z: float, yaw_deg: float | None
) -> None:
    goal = goals.point((x, y, z), "map", yaw_deg, 2.5, True).goal
    request = convert.request_from_goal(goal, NavigateRequest)
    assert request.position == (x, y, z)
    assert request.avoid_obstacles
    assert request.max_speed_m_s == 2.5
    qx, qy, qz, qw = request.orientation_xyzw
    assert (qx, qy) == (0.0, 0.0)
    if yaw_deg is None:
        assert (qz, qw) == (0.0, 0.0)
    else:
        assert math.isclose(math.cos(math.radians(yaw_deg)), qw * qw - qz * qz, abs_tol=1e-6)


@pytest.mark.parametrize(
    ("frame", "number"),
    [("map", Waypoint.FRAME_MAP), ("wgs84", Waypoint.FRAME_GEODETIC_AMSL)],
)
def test_a_route_has_its_waypoints_in_order_and_in_its_frame(frame: str, number: int) -> None:
    given_m = [(1, 2, 3), (4, 5, 6)]
    sent = goals.route(given_m, frame, 1.5, 0, False, 3, True)
    assert sent.waypoints == 2
    route = sent.goal
    assert isinstance(route, NavigateWaypoints.Goal)
    positions = [(w.position.x, w.position.y, w.position.z) for w in route.waypoints]
    assert positions == given_m
    assert {w.frame for w in route.waypoints} == {number}
    assert {w.hold_time for w in route.waypoints} == {1.5}
    assert (route.laps, route.execution) == (3, route.EXECUTION_MISSION)


def test_what_no_action_knows_is_an_error_before_anything_is_sent() -> None:
    with pytest.raises(ValueError, match="not in 'base_link'"):
        goals.route([(1, 2, 3)], "base_link", 0, 0, False, 1, False)
    with pytest.raises(ValueError, match="centre, tangent, keep"):
        goals.orbit((0, 0), 5, None, 1, 0, "sideways", False)


def test_an_orbit_without_a_height_keeps_the_altitude() -> None:
    kept, given_m = (goals.orbit((1, 2), -5, h, 1, 0, "keep", False).goal for h in (None, 4))
    assert isinstance(kept, Orbit.Goal)
    assert isinstance(given_m, Orbit.Goal)
    assert math.isnan(kept.height)
    assert given_m.height == 4.0
    assert (kept.radius, kept.yaw_mode) == (-5.0, Orbit.Goal.YAW_KEEP)


def test_the_methods_that_the_page_names_are_those_of_both_vehicles() -> None:
    page = (Path(__file__).parents[3] / "docs/programs.md").read_text("utf-8")
    table = page.split("| Method | Result |")[1].split("\n\n")[0]
    cells = "".join(row.split("|")[1] for row in table.splitlines() if row.startswith("| `"))
    named = set(re.findall(r"`(\w+)", cells))
    public = {name for name in vars(AsyncVehicle) if not name.startswith("_")}
    assert named == public - {"link"}


def test_the_page_has_a_row_for_each_of_the_examples_that_run() -> None:
    page = (Path(__file__).parents[3] / "docs/programs.md").read_text("utf-8")
    table = page.split("| Example | Here |")[1].split("\n\n")[0]
    cells = "".join(row.split("|")[1] for row in table.splitlines() if row.startswith("| `"))
    named = re.findall(r"`(\w+)`", cells)
    assert len(named) == len(set(named)) == 33


def ended(state: str, code: str) -> Ended:
    return Ended(1, state, code, f"{code}: It is over.", False, (1.0, 2.0, 3.0), 4.0)


def test_only_a_success_is_no_error() -> None:
    assert error_of(ended("SUCCEEDED", "SUCCESS")) is None
    for state, code in (("ABORTED", "NO_PATH"), ("CANCELED", "CANCELED")):
        end = ended(state, code)
        error = error_of(end)
        assert error is not None
        assert (error.code, error.message, error.end) == (code, "It is over.", end)
        assert str(error) == f"{code}: It is over."


def test_what_is_not_reported_is_none() -> None:
    state = reported_state(VehicleStatus(), None, None, None)
    assert not state.connected
    assert state.position_enu_m is state.battery_percent is state.global_position is None
    assert state.mode is None


def test_the_state_has_the_position_in_the_map_and_on_the_globe() -> None:
    pose = PoseStamped()
    pose.pose.position.x = 1.0
    status = VehicleStatus(connected=True, position_valid=True, mode="GUIDED")
    fix = NavSatFix(latitude=47.0, longitude=8.0, altitude=500.0)
    state = reported_state(status, pose, BatteryState(percentage=0.5), fix)
    assert state.position_enu_m == (1.0, 0.0, 0.0)
    assert state.global_position == (47.0, 8.0, 500.0)
    assert state.battery_percent == 50.0
    assert state.mode == "GUIDED"
