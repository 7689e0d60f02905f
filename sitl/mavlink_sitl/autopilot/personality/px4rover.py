"""PX4 v1.17 for cars with steered front wheels, and for boats with the same modules.

No recording exists. Parameters are those of the firmware's own simulated rover (airframe
10045, `sihsim_rover_ackermann`) and of its defaults for boats.
"""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.parameters import ParameterSpec
from mavlink_sitl.autopilot.personality.parameters import table
from mavlink_sitl.autopilot.personality.px4 import (
    COMMON_PARAMETERS,
    available_modes,
    flown_modes,
    in_order,
)
from mavlink_sitl.autopilot.personality.px4copter import PX4COPTER


def _parameters(accept_m: float, **others: float) -> tuple[ParameterSpec, ...]:
    return in_order(
        (*COMMON_PARAMETERS, *table("px4rover")),
        NAV_ACC_RAD=accept_m,
        RTL_DESCEND_ALT=30.0,
        RTL_RETURN_ALT=60.0,
        **others,
    )


PX4ROVER = replace(
    PX4COPTER,
    name="PX4 rover",
    kind="px4rover",
    mav_type=10,
    modes=flown_modes(needs_position=False),
    available_modes=available_modes(altctl=0, posctl=0, orbit=0),
    whole="px4_rover",
    parameters=_parameters(0.5),
)
PX4BOAT = replace(
    PX4ROVER,
    name="PX4 boat",
    kind="px4boat",
    mav_type=11,
    parameters=_parameters(
        2.0,
        PP_LOOKAHD_GAIN=2.0,
        PP_LOOKAHD_MAX=20.0,
        PP_LOOKAHD_MIN=4.0,
        RA_ACC_RAD_MAX=10.0,
        RA_MAX_STR_ANG=0.7,
        RA_WHEEL_BASE=0.5,
        RO_ACCEL_LIM=1.0,
        RO_DECEL_LIM=0.5,
        RO_JERK_LIM=2.0,
        RO_MAX_THR_SPEED=5.0,
        RO_SPEED_LIM=4.0,
        RO_YAW_P=1.5,
        RO_YAW_RATE_LIM=45.0,
    ),
)
"""The firmware has no such boat; limits are those that the simulated hull can keep"""
