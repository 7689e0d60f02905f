"""The camera, the gimbal and the gripper of a simulated ArduPilot, as recorded of a real one."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from sitl_support.ground_station import GroundStation

EQUIPPED = {"CAM1_TYPE": 1.0, "MNT1_TYPE": 1.0, "GRIP_ENABLE": 1.0}
ACCEPTED, FAILED = 0, 4


def station_of(**parameters: float) -> GroundStation:
    config = VehicleConfig(vehicle="copter", ready_after_s=0.5, parameters=parameters)
    station = GroundStation(Simulation([config], seed=1))
    station.run(2.0)
    return station


@pytest.mark.parametrize(
    ("command", "params", "without"),
    [
        (mav.MAV_CMD_IMAGE_START_CAPTURE, (0, 0, 1), FAILED),
        (mav.MAV_CMD_DO_DIGICAM_CONTROL, (0, 0, 0, 0, 1), ACCEPTED),
        (mav.MAV_CMD_DO_SET_CAM_TRIGG_DIST, (5, 0, 1), ACCEPTED),
        (mav.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, (255, 190, -1, -1), FAILED),
        (mav.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, (-30, 20, math.nan, math.nan, 12), FAILED),
        (mav.MAV_CMD_DO_MOUNT_CONTROL, (-45, 0, 30, 0, 0, 0, 2), FAILED),
        (mav.MAV_CMD_DO_GRIPPER, (1, 1), FAILED),
    ],
)
def test_the_answers_tell_who_has_a_device(
    command: int, params: tuple[float, ...], without: int
) -> None:
    assert station_of(**EQUIPPED).command(command, *params) == ACCEPTED
    assert station_of().command(command, *params) == without


def test_the_gimbal_reports_its_angles_from_the_nose() -> None:
    station = station_of(**EQUIPPED)
    point = mav.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
    assert station.command(point, -30, 20, math.nan, math.nan, 12) == ACCEPTED
    station.command(mav.MAV_CMD_REQUEST_MESSAGE, 285)
    status = station.last("GIMBAL_DEVICE_ATTITUDE_STATUS")
    w, x, y, z = status.q
    assert status.flags == 44
    pitch_rad = math.asin(2.0 * (w * y - z * x))
    yaw_rad = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    assert (math.degrees(pitch_rad), math.degrees(yaw_rad)) == pytest.approx((-30.0, 20.0))
    assert station.command(point, -95, 0, math.nan, math.nan, 12) == FAILED, "beyond its limits"
