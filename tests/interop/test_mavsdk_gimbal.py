"""MAVSDK's plugin for gimbals, unmodified from PyPI, with the gimbal of the simulated PX4.

Its set_roi_location sends nothing to a PX4, and reports an error (observed with MAVSDK 4.1).
"""

from __future__ import annotations

import math

import pytest

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from mavsdk.plugins.gimbal import ControlMode, Gimbal, GimbalMode, SendMode

from tests.interop.test_mavsdk import connected
from tests.support.stations.mavsdk_station import WAIT_S, wait, within

pytestmark = pytest.mark.wide


def test_the_gimbal_is_found_controlled_pointed_and_released() -> None:
    with connected("--autopilot", "px4", "--param", "MNT_MODE_IN=4") as flight:
        gimbal = Gimbal(flight.system)
        wait(lambda: bool(gimbal.gimbal_list().gimbals), "a gimbal")
        (found,) = gimbal.gimbal_list().gimbals
        number = found.gimbal_id

        def is_near(pitch_deg: float, yaw_deg: float) -> bool:
            there = gimbal.get_attitude(number).euler_angle_forward
            return math.dist((there.pitch_deg, there.yaw_deg), (pitch_deg, yaw_deg)) < 2.0

        def in_control() -> bool:
            return bool(gimbal.get_control_status(number).control_mode == ControlMode.PRIMARY)

        # Each but a streamed one raises without the vehicle's consent.
        within(WAIT_S, lambda: gimbal.take_control(number, ControlMode.PRIMARY))
        wait(in_control, "the control")
        turn = (number, 0.0, -30.0, 20.0, GimbalMode.YAW_FOLLOW)
        within(WAIT_S, lambda: gimbal.set_angles(*turn, SendMode.ONCE))
        wait(lambda: is_near(-30.0, 20.0), "the angles")
        turn = (number, 0.0, 10.0, -40.0, GimbalMode.YAW_FOLLOW)
        within(WAIT_S, lambda: gimbal.set_angles(*turn, SendMode.STREAM))
        wait(lambda: is_near(10.0, -40.0), "the streamed angles")
        within(WAIT_S, lambda: gimbal.release_control(number))
        wait(lambda: not in_control(), "the release")
