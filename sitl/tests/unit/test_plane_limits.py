"""Limits of a plane: its throttle, its take-off, the size of its circles and where it turns."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane
from sitl_support.ground_station import ACCEPTED, GroundStation
from sitl_support.kinds import kind
from sitl_support.missions import home, item, take_off, upload

pytestmark = pytest.mark.wide

AUTO, RTL, LOITER, TAKEOFF, GUIDED, CRUISE = 10, 11, 12, 13, 15, 7
SERVO_OUTPUT_RAW = 36


def taking_off(**parameters: float) -> GroundStation:
    """A plane that has just been armed in TAKEOFF."""
    station = kind("plane", parameters)
    assert station.mode(TAKEOFF) == ACCEPTED
    assert station.arm() == ACCEPTED
    return station


def throttle_us(station: GroundStation) -> int:
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, SERVO_OUTPUT_RAW)
    return int(station.last("SERVO_OUTPUT_RAW").servo3_raw)


def circled(station: GroundStation) -> tuple[float, float, float]:
    """The point that it circles, NED."""
    plane = station.vehicle.firmware
    assert isinstance(plane, Plane)
    place = plane.destination_ned_m()
    assert place is not None
    return place


def at_height(station: GroundStation, up_m: float) -> GroundStation:
    station.run_until(lambda: -station.position[2] > up_m, 60.0)
    return station


@pytest.mark.night
@pytest.mark.parametrize(("take_off_percent", "most_percent"), [(80, 100), (100, 70), (0, 85)])
def test_a_take_off_is_flown_with_tkoff_thr_max_or_thr_max(
    take_off_percent: int, most_percent: int
) -> None:
    station = taking_off(TKOFF_THR_MAX=take_off_percent, THR_MAX=most_percent, TKOFF_ALT=80)
    for up_m in (20.0, 45.0):
        expected_us = 1000 + 10 * (take_off_percent or most_percent)
        assert throttle_us(at_height(station, up_m)) == pytest.approx(expected_us, abs=5)
    station.run(30.0)
    assert throttle_us(station) <= 1000 + 10 * most_percent + 1


def test_the_mission_item_takes_off_with_it_too() -> None:
    station = kind("plane", {"TKOFF_THR_MAX": 80.0})
    assert upload(station, [home(), take_off(60), item(north_m=800, up_m=60)]) == 0
    station.mode(AUTO)
    assert station.arm() == ACCEPTED
    assert throttle_us(at_height(station, 30.0)) == pytest.approx(1800, abs=5)


@pytest.mark.night
def test_above_its_level_part_a_take_off_may_need_less_throttle() -> None:
    values = {"TKOFF_OPTIONS": 1.0, "TKOFF_THR_MAX_T": 0.0, "AIRSPEED_CRUISE": 17.0}
    station = taking_off(**values, TKOFF_ALT=100, TKOFF_LVL_ALT=20, TKOFF_THR_MIN=40)
    assert throttle_us(at_height(station, 12.0)) == pytest.approx(2000, abs=5)
    assert 1395 < throttle_us(at_height(station, 70.0)) < 1990
    without_sensor = taking_off(**values, TKOFF_ALT=100, ARSPD_USE=0)
    assert throttle_us(at_height(without_sensor, 70.0)) == pytest.approx(2000, abs=5)


def test_it_does_not_bank_below_tkoff_lvl_alt() -> None:
    station = taking_off(TKOFF_LVL_ALT=40, TKOFF_DIST=30, TKOFF_ALT=90)
    banked = []
    while -station.position[2] < 38.0:
        station.run(0.2)
        banked.append(abs(math.degrees(station.vehicle.firmware.motion.roll_rad)))
    assert max(banked) < 1.0
    station.run(4.0)
    assert abs(math.degrees(station.vehicle.firmware.motion.roll_rad)) > 5.0


def test_thr_min_keeps_the_motor_running() -> None:
    station = at_height(taking_off(THR_MIN=45), 40.0)
    station.run(20.0)
    assert station.mode(GUIDED) == ACCEPTED
    target = item(up_m=25)
    target.current = 3
    station.send(target)
    station.run(2.0)
    assert throttle_us(station) >= 1445


@pytest.mark.night
@pytest.mark.parametrize(("bank_deg", "radius_m"), [(0.0, 106.0), (50.0, 100.0)])
def test_navl1_lim_bank_keeps_a_circle_as_large_as_it_is_asked_for(
    bank_deg: float, radius_m: float
) -> None:
    station = at_height(taking_off(NAVL1_LIM_BANK=bank_deg, WP_LOITER_RAD=100), 45.0)
    station.run(60.0)
    centre = circled(station)
    seen = []
    for _ in range(40):
        station.run(0.5)
        seen.append(math.dist(station.position[:2], centre[:2]))
    assert sum(seen) / len(seen) == pytest.approx(radius_m, abs=1.5)


@pytest.mark.parametrize(
    ("parameters", "climbs_m"),
    [
        ({}, 0.0),
        ({"RTL_CLIMB_MIN": 25.0}, 25.0),
        ({"RTL_CLIMB_MIN": 70.0}, 70.0),
        ({"FLIGHT_OPTIONS": 16.0}, 45.0),
    ],
)
def test_a_return_turns_once_it_has_climbed(parameters: dict[str, float], climbs_m: float) -> None:
    station = at_height(taking_off(**parameters), 45.0)
    station.mode(CRUISE)
    station.run(15.0)
    begun_m = -station.position[2]
    assert station.mode(RTL) == ACCEPTED
    station.run(1.0)
    while abs(math.degrees(station.vehicle.firmware.motion.roll_rad)) < 15.0:
        station.run(0.25)
    assert -station.position[2] - begun_m == pytest.approx(climbs_m + 3.0, abs=6.0)


def test_from_above_a_return_sinks_bit_by_bit_on_its_way() -> None:
    station = at_height(taking_off(RTL_CLIMB_MIN=70), 45.0)
    station.mode(CRUISE)
    station.run(40.0)
    assert station.mode(RTL) == ACCEPTED
    station.run_until(lambda: -station.position[2] > 114.0, 60.0)
    begun_m = math.hypot(*station.position[:2])
    station.run_until(lambda: math.hypot(*station.position[:2]) < begun_m / 2.0, 120.0)
    assert -station.position[2] == pytest.approx(107.0, abs=4.0)
    station.run_until(lambda: math.hypot(*station.position[:2]) < 120.0, 120.0)
    assert -station.position[2] == pytest.approx(100.0, abs=3.0)


def test_an_item_marked_as_a_height_changes_the_height_in_guided_only() -> None:
    station = at_height(taking_off(), 45.0)
    station.run(15.0)
    target = item(north_m=500, up_m=90)
    target.current = 3

    def answers() -> list[int]:
        return [m.type for m in station.send(target) if m.get_type() == "MISSION_ACK"]

    assert answers() == [mav.MAV_MISSION_ERROR]
    assert station.mode(GUIDED) == ACCEPTED
    centre = circled(station)
    assert answers() == [mav.MAV_MISSION_ACCEPTED]
    station.run(30.0)
    assert -station.position[2] == pytest.approx(90.0, abs=3.0)
    assert circled(station)[:2] == centre[:2]
