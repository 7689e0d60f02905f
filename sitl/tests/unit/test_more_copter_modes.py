"""SMARTRTL and AUTO RTL, and other ways to fly a copter."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    FAILED,
    GUIDED,
    LAND,
    POSITION,
    RTL,
    GroundStation,
    copter,
    flying,
)
from sitl_support.missions import home, item, take_off, upload, waypoint
from sitl_support.transmitter import THROTTLE, Transmitter

pytestmark = pytest.mark.wide

SMART_RTL, AUTO_RTL = 21, 27
ALT_HOLD, POSHOLD = 2, 16


def mode(station: GroundStation) -> int:
    station.run(1.1)
    return int(station.last("HEARTBEAT").custom_mode)


# SMARTRTL.


def gone(*places: tuple[float, float, float]) -> GroundStation:
    """One that has been at some places."""
    station = flying(10.0)
    for place in places:
        station.setpoint(POSITION, place)
        while math.dist(station.position, place) > 1.0:
            station.run(0.2)
            assert station.now_s < 300.0
    return station


def test_smart_rtl_flies_back_the_way_it_came_and_lands_and_disarms() -> None:
    station = gone((25.0, 0.0, -10.0), (25.0, 25.0, -18.0))
    assert station.mode(SMART_RTL) == ACCEPTED
    nearest = math.inf
    while station.vehicle.firmware.armed:
        station.run(0.5)
        nearest = min(nearest, math.dist(station.position[:2], (25.0, 0.0)))
        assert station.now_s < 300.0
    assert nearest < 4.0
    assert math.hypot(*station.position[:2]) < 2.5
    assert 4 in station.changes("EXTENDED_SYS_STATE", "landed_state")
    assert mode(station) == SMART_RTL


def test_smart_rtl_leaves_out_a_loop() -> None:
    station = gone((20.0, 0.0, -10.0), (20.0, 30.0, -10.0), (20.0, 0.5, -10.0))
    assert station.mode(SMART_RTL) == ACCEPTED
    furthest = 0.0
    while math.hypot(*station.position[:2]) > 4.0:
        station.run(0.5)
        furthest = max(furthest, station.position[1])
    assert furthest < 6.0


def test_smart_rtl_is_rejected_without_a_path_back() -> None:
    station = copter().ready()
    assert station.mode(SMART_RTL) == FAILED
    assert "Mode change to SMARTRTL failed: init failed" in station.texts()


def test_a_path_with_too_many_points_deactivates_it() -> None:
    station = copter(parameters={"SRTL_POINTS": 4.0}).ready().take_off(10.0)
    for step in range(8):
        station.setpoint(POSITION, (8.0 * step, 8.0 * (step % 2), -10.0))
        station.run(5.0)
    assert "SmartRTL deactivated: buffer full" in station.texts()
    assert station.mode(SMART_RTL) == FAILED


@pytest.mark.parametrize(
    ("enable", "number"), [(1, RTL), (3, LAND), (4, SMART_RTL), (5, SMART_RTL), (7, 17)]
)
def test_a_lost_radio_does_what_fs_thr_enable_says(enable: int, number: int) -> None:
    station = flying(10.0)
    station.vehicle.parameters.set("FS_THR_ENABLE", enable)
    station.vehicle.lose_radio(True)
    assert mode(station) == number


@pytest.mark.parametrize(("action", "number"), [(1, LAND), (2, RTL), (3, SMART_RTL), (6, RTL)])
def test_an_empty_battery_does_what_its_action_says(action: int, number: int) -> None:
    station = flying(10.0)
    station.vehicle.parameters.set("BATT_FS_LOW_ACT", action)
    station.vehicle.parameters.set("BATT_LOW_TIMER", 1.0)
    station.vehicle.parameters.set("SIM_BATT_VOLTAGE", 10.0)
    station.run(2.0)
    assert mode(station) == number


# AUTO RTL.


def with_landing() -> GroundStation:
    station = copter().ready()
    start = item(mav.MAV_CMD_DO_LAND_START)
    items = [home(), take_off(10), waypoint(60, 0), start, waypoint(10, 10), waypoint(0, 10)]
    assert upload(station, items) == 0
    return station.take_off(10.0)


def test_auto_rtl_joins_the_missions_landing_and_is_reported_by_its_own_number() -> None:
    station = with_landing()
    assert station.mode(AUTO_RTL) == ACCEPTED
    assert mode(station) == AUTO_RTL
    station.run_until(lambda: math.dist(station.position[:2], (10.0, 10.0)) < 3.0, 30.0)
    assert station.mode(AUTO) == ACCEPTED
    assert mode(station) == AUTO
    assert station.mode(GUIDED) == ACCEPTED
    assert station.mode(AUTO) == ACCEPTED
    assert mode(station) == AUTO


def test_auto_rtl_is_rejected_without_a_landing_in_the_mission() -> None:
    station = flying(10.0)
    assert station.mode(AUTO_RTL) == FAILED
    assert any("AUTO RTL failed" in text for text in station.texts())
    assert mode(station) == GUIDED


# Take-off by the stick.


@pytest.mark.parametrize("number", [ALT_HOLD, POSHOLD])
def test_a_short_push_of_the_throttle_takes_off_to_pilot_tkoff_alt(number: int) -> None:
    station = copter(parameters={"PILOT_TKOFF_ALT": 700.0}).ready()
    pilot = Transmitter(station)
    assert station.mode(number) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(2.0)
    assert station.position[2] == pytest.approx(0.0, abs=0.1)
    pilot.move({THROTTLE: 1710}, 0.5)
    pilot.move({THROTTLE: 1500}, 15.0)
    assert station.position[2] == pytest.approx(-7.0, abs=0.5)
    pilot.move({THROTTLE: 1700}, 3.0)
    assert station.position[2] < -7.5, "then the stick climbs further"


def test_the_stick_pulled_back_ends_such_a_take_off() -> None:
    station = copter(parameters={"PILOT_TKOFF_ALT": 700.0}).ready()
    pilot = Transmitter(station)
    station.mode(ALT_HOLD)
    station.arm()
    station.run(2.0)
    pilot.move({THROTTLE: 1710}, 3.5)
    pilot.move({THROTTLE: 1400}, 0.3)
    pilot.move({THROTTLE: 1500}, 8.0)
    assert -6.0 < station.position[2] < -0.3


# The yaw of repeated commands.


def test_a_relative_yaw_that_is_repeated_turns_on_at_the_same_rate() -> None:
    rates = []
    for interval_s in (1.0, 0.1):
        station = flying(10.0)
        for _ in range(round(4.0 / interval_s)):
            assert station.command(mav.MAV_CMD_CONDITION_YAW, 60, 0, 1, 1) == ACCEPTED
            station.run(interval_s)
        rates.append(station.vehicle.firmware.motion.yaw_rate_rad_s)
    assert rates[1] > 0.95 * rates[0] > 0.5
