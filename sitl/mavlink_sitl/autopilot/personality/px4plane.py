"""PX4 v1.17 for a fixed-wing aeroplane with a runway.

No recording exists. Parameters are those of the firmware's own simulated aeroplane (airframe
10041, `sihsim_airplane`) and of its fixed-wing defaults.
"""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.common.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality.px4 import (
    COMMON_PARAMETERS,
    available_modes,
    flown_modes,
    in_order,
)
from mavlink_sitl.autopilot.personality.px4copter import PX4COPTER

_INT32 = ParameterType.INT32


_OWN = (
    ParameterSpec("FW_AIRSPD_MAX", 20.0),
    ParameterSpec("FW_AIRSPD_MIN", 10.0),
    ParameterSpec("FW_AIRSPD_TRIM", 15.0),
    ParameterSpec("FW_LND_AIRSPD", -1.0),
    ParameterSpec("FW_LND_ANG", 5.0),
    ParameterSpec("FW_LND_FLALT", 0.5),
    ParameterSpec("FW_LND_FL_SINK", 0.25),
    ParameterSpec("FW_LND_FL_TIME", 1.0),
    ParameterSpec("FW_R_LIM", 50.0),
    ParameterSpec("FW_TKO_AIRSPD", -1.0),
    ParameterSpec("FW_T_ALT_TC", 5.0),
    ParameterSpec("FW_T_CLMB_MAX", 5.0),
    ParameterSpec("FW_T_CLMB_R_SP", 3.0),
    ParameterSpec("FW_T_SINK_R_SP", 2.0),
    ParameterSpec("FW_WING_HEIGHT", 0.5),
    ParameterSpec("FW_WING_SPAN", 3.0),
    ParameterSpec("LNDFW_AIRSPD_MAX", 6.0),
    ParameterSpec("LNDFW_TRIG_TIME", 2.0),
    ParameterSpec("LNDFW_VEL_XY_MAX", 5.0),
    ParameterSpec("MIS_TAKEOFF_ALT", 25.0),
    ParameterSpec("NAV_FW_ALT_RAD", 10.0),
    ParameterSpec("NAV_LOITER_RAD", 80.0),
    ParameterSpec("NPFG_DAMPING", 0.7),
    ParameterSpec("NPFG_PERIOD", 10.0),
    ParameterSpec("NPFG_SW_DST_MLT", 0.32),
    ParameterSpec("RTL_LOITER_RAD", 80.0),
    ParameterSpec("RWTO_MAX_THR", 1.0),
    ParameterSpec("RWTO_RAMP_TIME", 2.0),
    ParameterSpec("RWTO_ROT_AIRSPD", -1.0),
    ParameterSpec("RWTO_TKOFF", 1.0, _INT32),
)

PX4PLANE = replace(
    PX4COPTER,
    name="PX4 plane",
    kind="px4plane",
    mav_type=1,
    modes=flown_modes(needs_position=False),
    available_modes=available_modes(posctl=3),
    parameters=in_order(
        (*COMMON_PARAMETERS, *_OWN),
        COM_DISARM_PRFLT=-1.0,
        MIS_TKO_LAND_REQ=2.0,
        NAV_ACC_RAD=10.0,
        RTL_DESCEND_ALT=100.0,
        RTL_LAND_DELAY=-1.0,
        RTL_RETURN_ALT=100.0,
        RTL_TYPE=1.0,
    ),
)
