"""A plane that is flown by sticks, and by the slow changes of GUIDED."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import ACCEPTED, FAILED, GroundStation
from sitl_support.kinds import kind, plane
from sitl_support.missions import home, item, upload, waypoint
from sitl_support.transmitter import PITCH, ROLL, THROTTLE, YAW, Transmitter

pytestmark = pytest.mark.wide

MANUAL, STABILIZE, FBWA, FBWB, CRUISE, GUIDED = 0, 2, 5, 6, 7, 15
CHANGE_ALTITUDE, CHANGE_HEADING = 43001, 43002
RELATIVE = 6


def height(station: GroundStation) -> float:
    return -station.position[2]


def course(station: GroundStation) -> float:
    return math.degrees(math.atan2(station.velocity[1], station.velocity[0])) % 360.0


def flying(number: int) -> tuple[GroundStation, Transmitter]:
    """At 50 m, with half throttle."""
    station = plane()
    pilot = Transmitter(station)
    pilot.put({THROTTLE: 1550})
    assert station.mode(number) == ACCEPTED
    return station, pilot


@pytest.mark.parametrize("number", [MANUAL, STABILIZE, FBWA])
def test_full_throttle_and_the_pulled_stick_take_off(number: int) -> None:
    station = kind("plane")
    pilot = Transmitter(station)
    assert station.mode(number) == ACCEPTED
    assert station.arm() == ACCEPTED
    pilot.move({THROTTLE: 2000, PITCH: 1500}, 2.0)
    assert math.hypot(*station.velocity[:2]) > 6.0
    assert height(station) == pytest.approx(0.0, abs=0.1)
    pilot.put({PITCH: 1800})
    station.run_until(lambda: height(station) > 40.0, 20.0)
    assert station.last("EXTENDED_SYS_STATE").landed_state == 2


def test_the_elevator_is_reversed_by_rc2_reversed() -> None:
    station = kind("plane", {"RC2_REVERSED": 1.0})
    pilot = Transmitter(station)
    assert station.mode(FBWA) == ACCEPTED
    assert station.arm() == ACCEPTED
    pilot.put({THROTTLE: 2000, PITCH: 1200})
    station.run_until(lambda: height(station) > 20.0, 20.0)


def test_fbwa_banks_as_far_as_its_limit() -> None:
    station, pilot = flying(FBWA)
    station.vehicle.parameters.set("ROLL_LIMIT_DEG", 40.0)
    pilot.move({ROLL: 2000}, 2.0)
    bank = math.degrees(station.vehicle.firmware.motion.roll_rad)
    assert bank == pytest.approx(40.0, abs=2.0)
    pilot.move({ROLL: 1500}, 2.0)
    bank = math.degrees(station.vehicle.firmware.motion.roll_rad)
    assert bank == pytest.approx(0.0, abs=2.0)


def test_fbwa_pitches_as_its_limits_say() -> None:
    station, pilot = flying(FBWA)
    station.vehicle.parameters.set("PTCH_LIM_MAX_DEG", 10.0)
    station.vehicle.parameters.set("PTCH_LIM_MIN_DEG", -5.0)
    pilot.move({PITCH: 2000, THROTTLE: 1800}, 3.0)
    up = math.degrees(math.atan2(-station.velocity[2], math.hypot(*station.velocity[:2])))
    assert up == pytest.approx(10.0, abs=1.5)
    pilot.move({PITCH: 1000}, 3.0)
    up = math.degrees(math.atan2(-station.velocity[2], math.hypot(*station.velocity[:2])))
    assert up == pytest.approx(-5.0, abs=1.5)


@pytest.mark.parametrize("number", [FBWB, CRUISE])
def test_where_the_height_is_held_the_stick_climbs_and_let_go_of_it_holds(number: int) -> None:
    station, pilot = flying(number)
    pilot.move({PITCH: 2000}, 8.0)
    assert -station.velocity[2] == pytest.approx(2.0, abs=0.4)
    pilot.move({PITCH: 1500}, 5.0)
    held = height(station)
    station.run(6.0)
    assert height(station) == pytest.approx(held, abs=2.0)
    station.vehicle.parameters.set("FBWB_ELEV_REV", 1.0)
    pilot.move({PITCH: 2000}, 8.0)
    assert station.velocity[2] == pytest.approx(2.0, abs=0.4)


def test_the_rudder_arms_after_3_s_and_disarms_only_with_arming_rudder_2() -> None:
    station = kind("plane")
    pilot = Transmitter(station)
    pilot.hold_yaw(2000, 2.6)
    assert not station.vehicle.firmware.armed
    pilot.hold_yaw(2000, 3.4)
    assert station.vehicle.firmware.armed
    pilot.hold_yaw(1000, 3.4)
    assert station.vehicle.firmware.armed
    station.vehicle.parameters.set("ARMING_RUDDER", 2.0)
    pilot.hold_yaw(1000, 3.4)
    assert not station.vehicle.firmware.armed


def test_the_yaw_stick_is_mapped() -> None:
    station = kind("plane", {"RCMAP_YAW": 6.0})
    pilot = Transmitter(station)
    pilot.move({6: 2000, YAW: 1500}, 3.4)
    assert station.vehicle.firmware.armed


def test_a_throttle_at_thr_fs_value_is_a_lost_radio() -> None:
    station, _ = flying(FBWA)
    station.vehicle.parameters.set("SIM_RC_FAIL", 2.0)
    station.run(4.0)
    assert any("Failsafe" in text for text in station.texts())
    assert station.vehicle.firmware.mode.spec.name == "CIRCLE"


# Stored items and outputs.


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        ((2.0, 0.0, 80.4, 1.0), (2.0, 0.0, 80.0, 1.0)),
        ((0.3, 0.0, -100.0, 0.0), (76.0 / 256.0, 0.0, -100.0, 0.0)),
        ((300.0, 0.0, 287.0, 0.0), (255.0, 0.0, 280.0, 0.0)),
    ],
)
def test_loiter_turns_are_stored_as_there_is_room(
    sent: tuple[float, ...], kept: tuple[float, ...]
) -> None:
    station = kind("plane")
    turns = item(mav.MAV_CMD_NAV_LOITER_TURNS, 300, 0, 60, sent)
    assert upload(station, [home(), waypoint(0, 0), turns]) == 0
    station.send(mav.MAVLink_mission_request_int_message(1, 1, 2))
    station.run(0.2)
    got = station.last("MISSION_ITEM_INT")
    assert (got.param1, got.param2, got.param3, got.param4) == pytest.approx(kept)


@pytest.mark.parametrize("vehicle", ["plane", "rover", "boat"])
def test_do_set_servo_shows_on_its_output(vehicle: str) -> None:
    station = kind(vehicle)
    station.interval(36, 5.0)
    assert station.command(mav.MAV_CMD_DO_SET_SERVO, 9, 1234) == ACCEPTED
    station.run(0.5)
    assert station.last("SERVO_OUTPUT_RAW").servo9_raw == 1234
    assert station.command(mav.MAV_CMD_DO_SET_SERVO, 1, 1234) == FAILED
