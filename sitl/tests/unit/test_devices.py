"""Outputs, switches, calibrations and requests of the simulated ArduPilot, in detail."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    DENIED,
    FAILED,
    STABILIZE,
    UNSUPPORTED,
    GroundStation,
    copter,
    flying,
)
from sitl_support.kinds import kind
from sitl_support.missions import home, item, upload, waypoint

KINDS = ["copter", "rover", "boat", "plane"]
SERVO = mav.MAV_CMD_DO_SET_SERVO
AUX, INTERVAL, REQUEST = mav.MAV_CMD_DO_AUX_FUNCTION, mav.MAV_CMD_SET_MESSAGE_INTERVAL, 512
LOW, MIDDLE, HIGH = 0, 1, 2


@pytest.fixture(name="ground")
def on_the_ground() -> GroundStation:
    return copter().ready()


def requested(station: GroundStation, message_id: int, kind_: str) -> mav.MAVLink_message:
    assert station.command(REQUEST, message_id) == ACCEPTED
    return station.last(kind_)


# Outputs.


@pytest.mark.parametrize(
    ("vehicle", "own", "free"),
    [("copter", 4, 5), ("rover", 3, 2), ("boat", 1, 4), ("plane", 4, 5)],
)
def test_an_output_in_use_is_no_servo_for_others(vehicle: str, own: int, free: int) -> None:
    station = kind(vehicle)
    assert station.command(SERVO, own, 1900) == FAILED
    assert station.texts()[-1] == f"ServoRelayEvent: Channel {own} is already in use"
    assert station.command(SERVO, 17, 1900) == FAILED
    assert station.command(SERVO, free, 1900) == ACCEPTED
    raw = requested(station, 36, "SERVO_OUTPUT_RAW")
    assert getattr(raw, f"servo{free}_raw") == 1900


def test_items_of_a_mission_move_outputs_and_switches() -> None:
    station = flying(8.0)
    do = [
        item(SERVO, params=(10.0, 1900.0), anywhere=True),
        item(AUX, params=(11.0, 2.0), anywhere=True),
    ]
    assert upload(station, [home(), *do, waypoint(6, 0, 8), waypoint(9, 0, 8)]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run(1.0)
    assert requested(station, 36, "SERVO_OUTPUT_RAW").servo10_raw == 1900
    assert station.vehicle.firmware.fence.enabled


# Switches.


def test_the_emergency_stop_lets_it_fall_and_forbids_arming() -> None:
    station = flying(6.0)
    assert station.command(AUX, 31, HIGH) == ACCEPTED
    station.run(3.0)
    assert station.position[2] > -1.0
    station.command(400, 0, 21196)
    assert station.arm() == FAILED
    assert station.texts()[-1] == "Arm: Motors Emergency Stopped"
    assert station.command(AUX, 31, LOW) == ACCEPTED
    assert station.arm() == ACCEPTED


@pytest.mark.parametrize("vehicle", KINDS)
def test_a_switch_arms_and_disarms(vehicle: str) -> None:
    station = kind(vehicle)
    assert station.command(AUX, 153, HIGH) == ACCEPTED
    assert station.vehicle.firmware.armed
    assert station.command(AUX, 153, MIDDLE) == ACCEPTED
    assert station.vehicle.firmware.armed
    assert station.command(AUX, 153, LOW) == ACCEPTED
    assert not station.vehicle.firmware.armed


def test_a_switch_of_a_mode_leads_back_when_it_is_low() -> None:
    station = flying(6.0)
    assert station.command(AUX, 18, HIGH) == ACCEPTED
    assert station.last("HEARTBEAT").custom_mode == 9
    assert station.command(AUX, 4, LOW) == ACCEPTED, "not in RTL, so nothing changes"
    assert station.last("HEARTBEAT").custom_mode == 9
    assert station.command(AUX, 18, LOW) == ACCEPTED
    assert station.last("HEARTBEAT").custom_mode == STABILIZE


@pytest.mark.parametrize(
    ("function", "position", "result"),
    [(4, 3, DENIED), (999, 2, FAILED), (53, 2, FAILED), (9, 2, ACCEPTED)],
)
def test_other_switches_are_answered_as_by_the_firmware(
    ground: GroundStation, function: int, position: int, result: int
) -> None:
    """53 is STEERING, a rover's mode; 9 a camera's trigger."""
    assert ground.command(AUX, function, position) == result


def test_switches_of_mission_and_gps(ground: GroundStation) -> None:
    assert upload(ground, [home(), waypoint(5, 5)]) == 0
    assert ground.command(AUX, 58, HIGH) == ACCEPTED
    assert requested(ground, 42, "MISSION_CURRENT").total == 0
    assert ground.command(AUX, 65, HIGH) == ACCEPTED
    ground.run(1.0)
    assert requested(ground, 24, "GPS_RAW_INT").fix_type < 3
    assert ground.command(AUX, 65, LOW) == ACCEPTED
    ground.run(1.0)
    assert requested(ground, 24, "GPS_RAW_INT").fix_type >= 3


# Calibration.


@pytest.mark.parametrize("vehicle", KINDS)
def test_what_is_calibrated_is_saved_and_told(vehicle: str) -> None:
    station = kind(vehicle)
    for params, name in (
        ((0, 0, 1), "BARO1_GND_PRESS"),
        ((0, 0, 0, 0, 4), "INS_ACCOFFS_X"),
        ((0, 0, 0, 0, 2), "AHRS_TRIM_X"),
    ):
        station.log.clear()
        assert station.command(mav.MAV_CMD_PREFLIGHT_CALIBRATION, *params) == ACCEPTED
        assert name in {m.param_id for m in station.messages("PARAM_VALUE")}
    assert station.command(mav.MAV_CMD_PREFLIGHT_CALIBRATION) == UNSUPPORTED


def test_a_rovers_motor_test_has_limits_and_leaves_its_mode_as_it_was() -> None:
    station = kind("rover")
    station.mode(4)  # HOLD
    test = mav.MAV_CMD_DO_MOTOR_TEST
    for params, why in (
        ((9, 0, 10, 1), "invalid motor (9)"),
        ((1, 7, 10, 1), "invalid throttle type: 7"),
        ((1, 1, 2300, 1), "pwm (2300) too high"),
        ((1, 0, 101, 1), "percentage (101) too high"),
    ):
        assert station.command(test, *params) == FAILED
        assert station.texts()[-1] == f"Motor Test: {why}"
    assert station.command(test, 1, 1, 1700, 1.0) == ACCEPTED
    station.run(0.8)
    assert math.hypot(*station.velocity) > 0.1
    station.run(8.0)
    assert station.arm() == ACCEPTED
    begin = station.position
    station.run(3.0)
    assert math.dist(begin, station.position) < 0.1, "nothing drives on"


# Requests.


def counted(station: GroundStation, message: str, seconds: float = 10.0) -> int:
    station.log.clear()
    station.run(seconds)
    return len(station.messages(message))


def test_an_interval_of_zero_gives_the_groups_rate_back(ground: GroundStation) -> None:
    ground.send(mav.MAVLink_request_data_stream_message(1, 1, 10, 2, 1))
    assert counted(ground, "ATTITUDE") == pytest.approx(20, abs=1)
    assert ground.command(INTERVAL, 30, 50_000) == ACCEPTED
    assert counted(ground, "ATTITUDE") == pytest.approx(200, abs=1)
    assert ground.command(INTERVAL, 30, 0) == ACCEPTED
    assert counted(ground, "ATTITUDE") == pytest.approx(20, abs=1)
    assert ground.command(INTERVAL, 30, -1) == ACCEPTED
    assert counted(ground, "ATTITUDE", 2.0) == 0
    assert ground.command(INTERVAL, 30, 0) == ACCEPTED
    assert counted(ground, "ATTITUDE") == pytest.approx(20, abs=1)
    ground.send(mav.MAVLink_request_data_stream_message(1, 1, 10, 2, 0))
    assert counted(ground, "ATTITUDE", 2.0) == 0


def test_an_interval_of_zero_stops_what_no_group_sends(ground: GroundStation) -> None:
    ground.interval(31, 10.0)
    assert ground.command(INTERVAL, 31, 0) == ACCEPTED
    assert counted(ground, "ATTITUDE_QUATERNION", 2.0) == 0


def test_a_receiver_in_param3_is_denied(ground: GroundStation) -> None:
    assert ground.command(INTERVAL, 30, 100_000, 1) == DENIED


def test_the_heartbeat_has_an_interval_too(ground: GroundStation) -> None:
    assert ground.command(INTERVAL, 0, 200_000) == ACCEPTED
    assert counted(ground, "HEARTBEAT") == pytest.approx(50, abs=1)
    ground.command(mav.MAV_CMD_GET_MESSAGE_INTERVAL, 0)
    assert ground.last("MESSAGE_INTERVAL").interval_us == 200_000
    assert ground.command(INTERVAL, 0, 0) == ACCEPTED
    assert counted(ground, "HEARTBEAT") == pytest.approx(10, abs=1)
    assert ground.command(INTERVAL, 0, -1) == ACCEPTED
    assert counted(ground, "HEARTBEAT", 3.0) == 0


@pytest.mark.parametrize("message_id", [436, 397, 395, 300, 410])
def test_what_the_firmware_does_not_send_is_denied(ground: GroundStation, message_id: int) -> None:
    """CURRENT_MODE, COMPONENT_METADATA, ..., as recorded of some: no ap_message."""
    assert ground.command(REQUEST, message_id) == FAILED
    assert ground.command(INTERVAL, message_id, 100_000) == DENIED


@pytest.mark.parametrize(
    ("vehicle", "capabilities"), [("copter", 0xFBEF), ("rover", 0xF1EF), ("plane", 0xF36F)]
)
def test_capabilities_are_those_of_the_real_firmware(vehicle: str, capabilities: int) -> None:
    station = GroundStation(Simulation([VehicleConfig(vehicle=vehicle)], seed=1))
    station.run(3.0)
    assert requested(station, 148, "AUTOPILOT_VERSION").capabilities == capabilities


def test_a_reset_battery_counts_on_from_there() -> None:
    station = flying(5.0)
    station.run(5.0)
    assert station.command(mav.MAV_CMD_BATTERY_RESET, 1, 50) == ACCEPTED
    station.run(0.5)
    assert requested(station, 147, "BATTERY_STATUS").battery_remaining == pytest.approx(50, abs=1)
    station.run(60.0)
    assert requested(station, 147, "BATTERY_STATUS").battery_remaining < 49
    assert station.command(mav.MAV_CMD_BATTERY_RESET, 2, 90) == ACCEPTED, "another battery"
    station.run(0.5)
    assert requested(station, 147, "BATTERY_STATUS").battery_remaining < 49
