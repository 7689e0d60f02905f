"""Missions that are flown more than once, and commands that change where they continue."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.plans.plans import MissionState
from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    DENIED,
    FAILED,
    GUIDED,
    LOITER,
    RTL,
    VELOCITY,
    GroundStation,
    copter,
    flying,
)
from sitl_support.kinds import ROVER_AUTO, ROVER_GUIDED, kind, rover
from sitl_support.missions import HOME, METRE, home, item, take_off, upload, waypoint

START, JUMP_TAG = mav.MAV_CMD_MISSION_START, mav.MAV_CMD_DO_JUMP_TAG
SET_HOME, SET_CURRENT = mav.MAV_CMD_DO_SET_HOME, mav.MAV_CMD_DO_SET_MISSION_CURRENT
THERE = item(mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, anywhere=True)
ARM_AND_TAKE_OFF = {"AUTO_OPTIONS": 3.0, "RTL_LOIT_TIME": 500.0, "RTL_ALT": 500.0}


def begun_items(station: GroundStation) -> list[str]:
    return [text for text in station.texts() if text.startswith("Mission: ")]


def fly_it(station: GroundStation) -> None:
    """From the ground to the ground."""
    assert station.arm() == ACCEPTED
    assert station.command(START) == ACCEPTED
    station.run_until(lambda: not station.vehicle.firmware.armed, 90.0)


@pytest.mark.parametrize("last", ["RTL", "LAND"])
def test_the_same_mission_is_flown_twice_in_auto(last: str) -> None:
    """By MISSION_START, without another mode or upload between."""
    down = THERE if last == "RTL" else item(mav.MAV_CMD_NAV_LAND, anywhere=True)
    station = copter(parameters=ARM_AND_TAKE_OFF).ready()
    assert upload(station, [home(), take_off(5), waypoint(6, 0, 5), down]) == 0
    assert station.mode(AUTO) == ACCEPTED
    for _ in range(2):
        station.log.clear()
        fly_it(station)
        assert [m.seq for m in station.messages("MISSION_ITEM_REACHED")][:2] == [1, 2]
        assert station.vehicle.firmware.mode.spec.number == AUTO


def test_disarmed_under_way_the_mission_begins_again() -> None:
    """The firmware resets it when it is disarmed, and continues from the first item."""
    station = copter(parameters=ARM_AND_TAKE_OFF).ready()
    assert upload(station, [home(), take_off(5), waypoint(6, 0, 5), THERE]) == 0
    station.mode(AUTO)
    fly_it(station)
    station.run(0.5)
    assert begun_items(station)[-1] == "Mission: 1 Takeoff"
    station.interval(42, 10.0)
    station.run(5.0)
    assert station.last("MISSION_CURRENT").seq == 1
    assert station.position[2] > -0.2, "and waits on the ground"


@pytest.mark.parametrize(("restart", "seq"), [(0.0, 3), (1.0, 1)])
def test_mis_restart_says_where_auto_continues(restart: float, seq: int) -> None:
    station = flying(8.0, {"MIS_RESTART": restart})
    places = [waypoint(6, 0, 8), waypoint(6, 6, 8), waypoint(40, 6, 8)]
    assert upload(station, [home(), *places]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run_until(lambda: station.vehicle.plans.current == 3)
    station.mode(GUIDED)
    station.run(1.0)
    assert station.mode(AUTO) == ACCEPTED
    assert begun_items(station)[-1] == f"Mission: {seq} WP"


def test_a_rovers_mission_begins_again_with_mis_restart() -> None:
    station = rover({"MIS_RESTART": 1.0})
    assert upload(station, [home(), waypoint(6, 0), waypoint(30, 0)]) == 0
    station.mode(ROVER_AUTO)
    station.run_until(lambda: station.vehicle.plans.current == 2)
    station.mode(ROVER_GUIDED)
    station.mode(ROVER_AUTO)
    assert begun_items(station)[-1] == "Mission: 1 WP"


# Take-off.


def test_a_take_off_below_the_present_height_stays_there() -> None:
    """It never flies downwards; the next item follows at once."""
    station = flying(12.0)
    assert upload(station, [home(), take_off(3), waypoint(10, 0, 12), THERE]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run_until(lambda: station.vehicle.plans.current == 2)
    assert station.position[2] == pytest.approx(-12.0, abs=0.5)
    station.run(3.0)
    assert station.position[2] == pytest.approx(-12.0, abs=0.5)


@pytest.mark.parametrize("up_m", [-5.0, 0.0, 0.3])
def test_a_take_off_from_the_ground_climbs_a_metre_at_least(up_m: float) -> None:
    station = copter(parameters=ARM_AND_TAKE_OFF).ready()
    assert upload(station, [home(), take_off(up_m), waypoint(0, 0, 4), THERE]) == 0
    station.mode(AUTO)
    station.arm()
    station.command(START)
    station.run_until(lambda: station.vehicle.plans.current == 2, 15.0)
    assert -1.3 < station.position[2] < -0.8


def test_a_take_offs_height_counts_from_home() -> None:
    """Home is 10 m below the vehicle here."""
    station = copter(parameters=ARM_AND_TAKE_OFF).ready()
    below_m = station.vehicle.config.home.altitude_amsl_m - 10.0
    assert station.command_int(SET_HOME, 0, x=HOME[0], y=HOME[1], z=below_m) == ACCEPTED
    assert upload(station, [home(), take_off(16), THERE]) == 0
    station.mode(AUTO)
    assert station.arm() == ACCEPTED
    station.command(START)
    station.run_until(lambda: station.vehicle.plans.current == 2, 20.0)
    assert station.position[2] == pytest.approx(-6.0, abs=0.4)


# Home.


@pytest.mark.parametrize("form", ["long", "int"])
def test_a_home_that_was_set_outlives_arming_and_rtl_goes_there(form: str) -> None:
    station = copter(parameters={"RTL_LOIT_TIME": 500.0, "RTL_ALT": 500.0}).ready()
    x, up_m = HOME[0] + round(12 * METRE), station.vehicle.config.home.altitude_amsl_m
    if form == "long":
        place = (x / 1e7, HOME[1] / 1e7, up_m)
        assert station.command(SET_HOME, 0, 0, 0, 0, *place) == ACCEPTED
    else:
        assert station.command_int(SET_HOME, 0, x=x, y=HOME[1], z=up_m) == ACCEPTED
    station.take_off(6.0)
    assert station.last("HOME_POSITION").latitude == pytest.approx(x, abs=40)
    assert station.mode(RTL) == ACCEPTED
    station.run_until(lambda: not station.vehicle.firmware.armed, 60.0)
    assert math.dist(station.position[:2], (12.0, 0.0)) < 1.0, "floats have a metre for degrees"


def test_a_home_that_nobody_set_moves_to_where_it_is_armed() -> None:
    station = rover()
    station.setpoint(0xDF8, (8.0, 0.0, 0.0))
    station.run(12.0)
    assert station.command(400, 0) == ACCEPTED
    assert station.arm() == ACCEPTED
    assert station.last("HOME_POSITION").latitude > HOME[0] + 6 * METRE
    assert station.command(SET_HOME, 1) == ACCEPTED
    station.setpoint(0xDF8, (0.0, 0.0, 0.0))
    station.run(12.0)
    station.command(400, 0)
    station.arm()
    assert station.last("HOME_POSITION").latitude > HOME[0] + 6 * METRE, "it is locked now"


# Jumps.


TAGGED = [
    home(),
    waypoint(8, 0, 8),
    waypoint(30, 0, 8),
    item(mav.MAV_CMD_JUMP_TAG, params=(7.0,), anywhere=True),
    waypoint(0, 8, 8),
    waypoint(0, 30, 8),
]


@pytest.mark.parametrize("form", ["long", "int"])
def test_the_command_jumps_to_a_tag(form: str) -> None:
    station = flying(8.0)
    assert upload(station, TAGGED) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run(1.0)
    jump = station.command if form == "long" else lambda *p: station.command_int(p[0], 3, *p[1:])
    assert jump(JUMP_TAG, 8) == FAILED, "no such tag"
    assert jump(JUMP_TAG, 70000) == DENIED
    assert jump(JUMP_TAG, 7) == ACCEPTED
    assert station.last("MISSION_CURRENT").seq == 4
    station.run_until(lambda: station.vehicle.plans.current == 5, 30.0)
    assert station.position[1] > 6.0


def test_a_tag_is_where_auto_will_begin() -> None:
    station = flying(8.0)
    assert upload(station, TAGGED) == 0
    assert station.command(JUMP_TAG, 7) == ACCEPTED
    assert station.mode(LOITER) == ACCEPTED
    assert station.mode(AUTO) == ACCEPTED
    assert begun_items(station)[-1] == "Mission: 4 WP"


def test_set_current_with_reset_has_the_jumps_begin_again() -> None:
    back = item(mav.MAV_CMD_DO_JUMP, params=(1.0, 1.0), anywhere=True)
    station = flying(8.0)
    assert upload(station, [home(), waypoint(4, 0, 8), back, waypoint(0, 4, 8)]) == 0
    station.mode(AUTO)
    plans = station.vehicle.plans
    station.run_until(lambda: plans.current == 3, 40.0)
    assert plans.jumps == {2: 1}
    assert station.command(SET_CURRENT, 1, 0) == ACCEPTED
    assert plans.jumps == {2: 1}
    assert station.command(SET_CURRENT, 99, 1) == DENIED
    assert station.command(SET_CURRENT, 1, 1) == ACCEPTED
    assert plans.jumps == {}
    assert station.last("MISSION_CURRENT").seq == 1


# Items that differ by kind of vehicle.


@pytest.mark.parametrize("bounds", [(6.0, 0, 0, 0), (0, 0, 0, 4.0)], ids=["time", "too far"])
def test_a_rover_obeys_a_companion_until_a_limit(bounds: tuple[float, ...]) -> None:
    station = kind("rover")
    limits = item(mav.MAV_CMD_DO_GUIDED_LIMITS, params=bounds, anywhere=True)
    guided = item(mav.MAV_CMD_NAV_GUIDED_ENABLE, params=(1.0,), anywhere=True)
    assert upload(station, [home(), limits, guided, waypoint(0, 8)]) == 0
    assert station.mode(ROVER_AUTO) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(1.5)
    assert station.vehicle.plans.current == 2
    for _ in range(12):
        station.setpoint(VELOCITY, velocity=(1.5, 0.0, 0.0))
        station.run(0.5)
    assert station.position[0] > 2.0
    station.run_until(lambda: station.vehicle.plans.current == 3, 5.0)
    station.run_until(lambda: math.dist(station.position[:2], (0.0, 8.0)) < 2.0, 30.0)


@pytest.mark.parametrize("vehicle", ["copter", "rover", "plane"])
def test_items_that_need_a_companion_are_taken_and_passed_over(vehicle: str) -> None:
    """DO_GUIDED_LIMITS bounds what a companion may do in a copter's NAV_GUIDED_ENABLE."""
    limits = item(mav.MAV_CMD_DO_GUIDED_LIMITS, params=(10.0,), anywhere=True)
    assert upload(kind(vehicle), [home(), limits, waypoint(5, 5)]) == 0


# The item in force before AUTO.


def test_the_current_item_is_the_next_one_to_fly_to() -> None:
    station = flying(8.0)
    assert upload(station, TAGGED) == 0
    assert station.command(JUMP_TAG, 7) == ACCEPTED
    assert station.last("MISSION_CURRENT").seq == 4


def test_where_nothing_to_fly_to_follows_the_command_fails() -> None:
    station = flying(8.0)
    assert upload(station, [*TAGGED[:3], item(mav.MAV_CMD_JUMP_TAG, params=(7.0,))]) == 0
    assert station.command(JUMP_TAG, 7) == FAILED
    assert station.vehicle.plans.current == 0


def test_a_jump_to_nowhere_ends_the_mission() -> None:
    station = flying(8.0)
    nowhere = item(mav.MAV_CMD_DO_JUMP_TAG, params=(17.0, 1.0), anywhere=True)
    assert upload(station, [home(), waypoint(2, 0, 8), nowhere, waypoint(30, 0, 8)]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run(15.0)
    assert station.position[0] < 5.0
    assert station.vehicle.plans.state is MissionState.COMPLETE
