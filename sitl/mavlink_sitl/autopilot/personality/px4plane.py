"""PX4 v1.17 for a fixed-wing aeroplane with a runway.

No recording exists. Parameters are those of the firmware's own simulated aeroplane (airframe
10041, `sihsim_airplane`) and of its fixed-wing defaults.
"""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.personality.parameters import table
from mavlink_sitl.autopilot.personality.px4 import (
    COMMON_PARAMETERS,
    available_modes,
    flown_modes,
    in_order,
)
from mavlink_sitl.autopilot.personality.px4copter import PX4COPTER

PX4PLANE = replace(
    PX4COPTER,
    name="PX4 plane",
    kind="px4plane",
    mav_type=1,
    modes=flown_modes(needs_position=False),
    available_modes=available_modes(posctl=3),
    whole="px4_plane",
    parameters=in_order(
        (*COMMON_PARAMETERS, *table("px4plane")),
        COM_DISARM_PRFLT=-1.0,
        MIS_TKO_LAND_REQ=2.0,
        NAV_ACC_RAD=10.0,
        RTL_DESCEND_ALT=100.0,
        RTL_LAND_DELAY=-1.0,
        RTL_RETURN_ALT=100.0,
        RTL_TYPE=1.0,
    ),
)
