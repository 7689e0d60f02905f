"""Commands for a copter on the ground: motor test, calibration, outputs. From `copter_acks`."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import GroundStation, copter, flying

MOTOR_TEST, CALIBRATE = mav.MAV_CMD_DO_MOTOR_TEST, mav.MAV_CMD_PREFLIGHT_CALIBRATION
ARMED = mav.MAV_MODE_FLAG_SAFETY_ARMED


@pytest.fixture
def ground() -> GroundStation:
    return copter().ready()


def armed(ground: GroundStation) -> bool:
    return bool(ground.last("HEARTBEAT").base_mode & ARMED)


def test_a_motor_test_makes_the_heartbeat_say_armed_for_its_time(ground: GroundStation) -> None:
    assert ground.command(MOTOR_TEST, 1, 0, 5, 1.5) == 0
    assert ground.texts()[-1] == "starting motor test"
    assert ground.command(CALIBRATE, 0, 0, 0, 0, 4) == 4
    assert ground.texts()[-1] == "Disarm to allow calibration"
    assert ground.command(mav.MAV_CMD_RUN_PREARM_CHECKS) == 1
    ground.run(1.1)
    assert armed(ground)
    assert not ground.vehicle.firmware.armed, "nobody armed"
    ground.run(1.5)
    assert ground.texts()[-1] == "finished motor test"
    assert not armed(ground)
    assert ground.command(CALIBRATE, 0, 0, 0, 0, 4) == 0


def test_motors_are_tested_one_after_the_other_clockwise(ground: GroundStation) -> None:
    ground.interval(36, 20.0)
    assert ground.command(MOTOR_TEST, 1, 1, 1300, 1.0, 4) == 0
    ground.run(6.5)
    seen: list[int] = []
    for message in ground.messages("SERVO_OUTPUT_RAW"):
        raw = [getattr(message, f"servo{n}_raw") for n in range(1, 5)]
        turning = [n for n, value in enumerate(raw, 1) if value == 1300]
        assert len(turning) <= 1
        seen += [n for n in turning if seen[-1:] != [n]]
    assert seen == [1, 4, 2, 3]
    assert ground.texts()[-1] == "finished motor test"
    assert ground.position[2] == 0.0


def test_a_motor_test_with_an_impossible_throttle_ends_at_once(ground: GroundStation) -> None:
    assert ground.command(MOTOR_TEST, 1, 1, 9999, 5.0) == 0
    ground.run(0.2)
    assert ground.texts()[-1] == "finished motor test"
    assert ground.command(MOTOR_TEST, 1, 1, math.nan, 5.0) == 2


def test_no_motor_test_in_flight() -> None:
    station = flying(4.0)
    assert station.command(MOTOR_TEST, 1, 0, 5, 1.0) == 4
    assert station.texts()[-1] == "Motor Test: vehicle not landed"


@pytest.mark.parametrize(
    ("params", "result"),
    [
        ((1, 0, 0, 0, 0), 0),
        ((0, 0, 1, 0, 0), 0),
        ((0, 76, 0, 0, 0), 0),
        ((0, 0, 0, 0, 1), 3),
        ((0, 0, 0, 0, 2), 0),
        ((0, 0, 0, 0, 4), 0),
        ((0, 0, 0, 0, 0), 3),
        ((0, 1, 0, 0, 0), 3),
    ],
)
def test_calibration_is_answered(
    ground: GroundStation, params: tuple[float, ...], result: int
) -> None:
    assert ground.command(CALIBRATE, *params) == result


def test_recorded_answers_of_devices(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_DO_SET_ROI_NONE) == 0
    assert ground.command(mav.MAV_CMD_DO_GRIPPER, 1, 1) == 4
    assert ground.command(mav.MAV_CMD_DO_SET_SERVO, 9, 1500) == 0
    assert ground.command(mav.MAV_CMD_SET_EKF_SOURCE_SET, 1) == 0
    assert ground.command(mav.MAV_CMD_DO_SET_SERVO, 1, 1500) == 4, "a motor's"
    ground.interval(36, 10.0)
    ground.run(0.5)
    assert ground.last("SERVO_OUTPUT_RAW").servo9_raw == 1500
