"""Copter mission items other than waypoints: DO_*, CONDITION_*, curves."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import AUTO, GUIDED, GroundStation, copter
from sitl_support.missions import home, item, take_off, upload, waypoint

READY = {"AUTO_OPTIONS": 3.0}


def begun(*items: mav.MAVLink_message) -> GroundStation:
    """A copter that has armed in AUTO and flies the items after a take-off to 6 m."""
    station = copter(parameters=READY).ready()
    assert upload(station, [home(), take_off(6), *items]) == 0
    assert station.mode(AUTO) == 0
    assert station.arm() == 0
    assert station.command(mav.MAV_CMD_MISSION_START) == 0
    station.interval(42, 4.0)
    return station


def do(command: int, *params: float) -> mav.MAVLink_message:
    """An item without a place."""
    return item(command, params=params, anywhere=True)


def reached(station: GroundStation) -> list[int]:
    return [m.seq for m in station.messages("MISSION_ITEM_REACHED")]


def until_reached(station: GroundStation, seq: int) -> float:
    return station.run_until(lambda: seq in reached(station), 90.0)


def yaw_deg(station: GroundStation) -> float:
    return math.degrees(float(station.simulation.truth.yaw_rad[0])) % 360.0


def off_deg(angle: float, wanted: float) -> float:
    return abs(math.remainder(angle - wanted, 360.0))


def test_a_spline_is_flown_straight_and_not_stopped_at() -> None:
    station = begun(item(mav.MAV_CMD_NAV_SPLINE_WAYPOINT, 20, 0, 6), waypoint(20, 20, 6))
    until_reached(station, 1)
    slowest_m_s = math.inf
    while 3 not in reached(station):
        station.run(0.1)
        north, east, _ = station.position
        assert abs(east) < 2.0 or abs(north - 20.0) < 2.0
        if math.dist((north, east), (20, 0)) < 2.0:
            slowest_m_s = min(slowest_m_s, math.hypot(*station.velocity[:2]))
        assert station.now_s < 90.0
    assert slowest_m_s > 0.5
    assert "Mission: 2 SplineWP" in station.texts()


def test_loiter_to_alt_ends_at_its_height() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_TO_ALT, 8, 0, 11), waypoint(0, 0, 11))
    until_reached(station, 2)
    assert -station.position[2] == pytest.approx(11.0, abs=0.5)
    assert math.dist(station.position[:2], (8, 0)) < 1.0


def test_a_condition_holds_up_what_comes_after_it_on_the_same_leg() -> None:
    station = begun(
        do(mav.MAV_CMD_CONDITION_DISTANCE, 10.0),
        do(mav.MAV_CMD_DO_SET_SERVO, 9, 1750),
        waypoint(30, 0, 6),
    )
    station.interval(36, 10.0)
    until_reached(station, 1)
    assert 2 not in reached(station)
    until_reached(station, 2)
    assert station.position[0] == pytest.approx(20.0, abs=1.5)
    station.run(0.5)
    assert station.last("SERVO_OUTPUT_RAW").servo9_raw == 1750
    assert reached(station) == [1, 2], "a servo item is never told"


def test_what_is_not_done_when_its_leg_ends_is_dropped() -> None:
    station = begun(
        do(mav.MAV_CMD_CONDITION_DELAY, 60.0),
        do(mav.MAV_CMD_DO_SET_SERVO, 9, 1750),
        waypoint(8, 0, 6),
        waypoint(0, 0, 6),
    )
    until_reached(station, 5)
    assert reached(station) == [1, 4, 5]
    assert station.vehicle.firmware.outputs.servos_us == {}


def test_condition_yaw_turns_the_way_it_says_until_the_next_waypoint() -> None:
    station = begun(
        do(mav.MAV_CMD_CONDITION_YAW, 90.0, 30.0, -1.0, 0.0),
        waypoint(0, 0, 45),
        waypoint(20, 0, 45),
    )
    until_reached(station, 1)
    began_s, began_deg = station.now_s, yaw_deg(station)
    station.run(1.0)
    assert math.remainder(yaw_deg(station) - began_deg, 360.0) < -10.0, "against the clock"
    until_reached(station, 2)
    assert off_deg(yaw_deg(station), 90.0) < 4.0
    assert station.now_s - began_s > 6.0, "30 degrees a second the long way round"
    until_reached(station, 4)
    assert off_deg(yaw_deg(station), 0.0) < 10.0


def test_a_region_of_interest_is_looked_at_until_it_is_taken_away() -> None:
    station = begun(
        item(mav.MAV_CMD_DO_SET_ROI, 10, 20),
        waypoint(20, 0, 6),
        do(mav.MAV_CMD_DO_SET_ROI_NONE),
        waypoint(30, 0, 6),
    )
    until_reached(station, 4)
    north, east, _ = station.position
    towards = math.degrees(math.atan2(20.0 - east, 10.0 - north))
    assert off_deg(yaw_deg(station), towards) < 8.0
    until_reached(station, 5)
    assert reached(station) == [2, 4, 5]
    assert off_deg(yaw_deg(station), 0.0) < 8.0


def test_a_circle_is_flown_with_the_nose_to_its_centre() -> None:
    station = begun(item(mav.MAV_CMD_NAV_LOITER_TURNS, 10, 0, 6, params=(1.0, 0.0, -5.0)))
    until_reached(station, 1)
    station.run(12.0)
    north, east, _ = station.position
    assert math.dist((north, east), (10, 0)) == pytest.approx(5.0, abs=1.0)
    assert off_deg(yaw_deg(station), math.degrees(math.atan2(-east, 10.0 - north))) < 15.0
    until_reached(station, 2)


def test_home_tags_fence_and_cameras() -> None:
    station = begun(
        item(mav.MAV_CMD_DO_SET_HOME, 7, 0, 3),
        do(mav.MAV_CMD_JUMP_TAG, 77),
        waypoint(6, 0, 6),
        do(mav.MAV_CMD_DO_FENCE_ENABLE, 1),
        do(mav.MAV_CMD_DO_DIGICAM_CONTROL),
        do(mav.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 5.0),
        do(mav.MAV_CMD_DO_JUMP_TAG, 77, 1),
        waypoint(0, 0, 6),
    )
    until_reached(station, 9)
    assert reached(station) == [2, 5, 5, 9]
    assert station.vehicle.firmware.fence.enabled
    home_point = station.vehicle.firmware.navigator.home
    assert home_point is not None
    assert station.vehicle.firmware.navigator.home_ned_m()[0] == pytest.approx(7.0, abs=0.1)
    assert station.last("HOME_POSITION").x == pytest.approx(7.0, abs=0.2)


def test_do_land_start_continues_with_the_landing_sequence() -> None:
    station = copter(parameters=READY).ready()
    assert station.command(mav.MAV_CMD_DO_LAND_START) == 4
    assert "Mode change to AUTO RTL failed: No landing" in "".join(station.texts())
    landing = [do(mav.MAV_CMD_DO_LAND_START), item(mav.MAV_CMD_NAV_LAND, 5, 0)]
    upload(station, [home(), take_off(6), waypoint(50, 0, 6), *landing])
    station.take_off(5.0)
    assert station.command(mav.MAV_CMD_DO_LAND_START) == 0
    station.run_until(lambda: not station.vehicle.firmware.armed, 60.0)
    assert math.dist(station.position[:2], (5, 0)) < 0.7


@pytest.mark.parametrize(
    "command",
    [
        mav.MAV_CMD_NAV_SPLINE_WAYPOINT,
        mav.MAV_CMD_NAV_LOITER_TO_ALT,
        mav.MAV_CMD_DO_SET_HOME,
        mav.MAV_CMD_DO_SET_ROI,
        mav.MAV_CMD_DO_SET_ROI_LOCATION,
    ],
)
def test_a_place_that_is_not_on_earth_is_rejected(command: int) -> None:
    station = copter().ready()
    nowhere = item(command, up_m=5.0)
    nowhere.x = 2_000_000_000
    assert upload(station, [home(), nowhere]) == 10


# The same by command.


def test_condition_yaw_and_regions_of_interest_by_command() -> None:
    station = copter().ready().take_off(5.0)
    assert station.command(mav.MAV_CMD_CONDITION_YAW, 400.0) == 4
    assert station.command(mav.MAV_CMD_CONDITION_YAW, 45.0, 20.0, 1.0, 1.0) == 0
    before = yaw_deg(station)
    station.run(4.0)
    assert off_deg(yaw_deg(station), before + 45.0) < 3.0
    here = station.position
    place = item(north_m=0.0, east_m=50.0)
    roi = mav.MAV_CMD_DO_SET_ROI_LOCATION
    assert station.command(roi, 0, 0, 0, 0, place.x / 1e7, place.y / 1e7, 0.0) == 0
    station.run(5.0)
    assert off_deg(yaw_deg(station), 90.0) < 4.0
    assert station.command_int(roi, 6, x=HOME_AHEAD.x, y=HOME_AHEAD.y) == 0
    station.run(5.0)
    assert off_deg(yaw_deg(station), 0.0) < 4.0
    assert math.dist(station.position, here) < 0.5, "only the nose moves"
    assert station.command(mav.MAV_CMD_DO_SET_ROI_NONE) == 0
    assert station.command_int(roi, 99, x=1, y=1) == 2
    station.mode(GUIDED)


HOME_AHEAD = item(north_m=60.0)


def test_set_home_elsewhere_by_command() -> None:
    station = copter().ready()
    place = item(north_m=30.0)
    home_command = mav.MAV_CMD_DO_SET_HOME
    assert station.command(home_command, 0, 0, 0, 0, place.x / 1e7, place.y / 1e7, 584) == 0
    assert station.vehicle.firmware.navigator.home_ned_m()[0] == pytest.approx(30.0, abs=0.2)
    assert station.command_int(home_command, 6, 0, x=place.x, y=place.y + 1000, z=1.0) == 0
    assert station.vehicle.firmware.navigator.home_ned_m()[2] == pytest.approx(-1.0, abs=0.2)
    assert station.command(home_command, 0, 0, 0, 0, math.nan, 0, 0) == 2
    assert station.command(home_command, 5) == 4


def test_a_waypoint_is_reported_as_reached_under_the_number_of_what_is_done_with_it() -> None:
    station = begun(
        waypoint(6, 0, 6),
        do(mav.MAV_CMD_DO_CHANGE_SPEED, 1.0, 3.0, -1.0),
        waypoint(12, 0, 6),
    )
    until_reached(station, 4)
    assert reached(station) == [1, 3, 4]
    assert "Reached command #2" in station.texts()
    assert {m.seq for m in station.messages("MISSION_CURRENT")} <= {0, 1, 2, 4}
