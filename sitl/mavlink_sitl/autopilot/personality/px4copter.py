"""PX4 v1.17 for a multicopter, as it was recorded (`tlogs/px4`)."""

from __future__ import annotations

from mavlink_sitl.autopilot.common.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.px4 import (
    CAPABILITIES,
    COMMON_PARAMETERS,
    available_modes,
    flown_modes,
    in_order,
)
from mavlink_sitl.autopilot.plans.plan_rules import PX4_PLANS
from mavlink_sitl.geodesy import PX4

_INT32 = ParameterType.INT32

_PARAMETERS = (
    *COMMON_PARAMETERS,
    ParameterSpec("MIS_TAKEOFF_ALT", 2.5),
    ParameterSpec("MPC_ACC_HOR", 3.0),
    ParameterSpec("MPC_ACC_UP_MAX", 4.0),
    ParameterSpec("MPC_JERK_AUTO", 4.0),
    ParameterSpec("MPC_LAND_ALT1", 10.0),
    ParameterSpec("MPC_LAND_ALT2", 5.0),
    ParameterSpec("MPC_LAND_ALT3", 1.0),
    ParameterSpec("MPC_LAND_CRWL", 0.3),
    ParameterSpec("MPC_LAND_SPEED", 0.7),
    ParameterSpec("MPC_TKO_RAMP_T", 3.0),
    ParameterSpec("MPC_TKO_SPEED", 1.5),
    ParameterSpec("MPC_VEL_MANUAL", 10.0),
    ParameterSpec("MPC_XY_CRUISE", 5.0),
    ParameterSpec("MPC_XY_P", 0.95),
    ParameterSpec("MPC_XY_VEL_MAX", 12.0),
    ParameterSpec("MPC_Z_P", 1.0),
    ParameterSpec("MPC_Z_VEL_MAX_DN", 1.5),
    ParameterSpec("MPC_Z_VEL_MAX_UP", 3.0),
    ParameterSpec("MPC_Z_V_AUTO_DN", 1.5),
    ParameterSpec("MPC_Z_V_AUTO_UP", 3.0),
)

PX4COPTER = Personality(
    name="PX4 multicopter",
    mav_type=2,
    mav_autopilot=12,
    capabilities=CAPABILITIES,
    flight_sw_version=17891583,
    flight_custom_version="d6f12ad1",
    modes=flown_modes(needs_position=True),
    parameters=in_order(_PARAMETERS),
    boot=(),
    ready_s=4.4,
    gps_fix_s=0.5,
    battery_ready_s=0.2,
    origin_s=3.8,
    first_heartbeat_s=0.16,
    standby_s=1.0,
    streams={},
    shortest_interval_us=1000,
    available_modes=available_modes(),
    plan_rules=PX4_PLANS,
    projection=PX4,
    kind="px4copter",
    armed_text="Armed by external command",
    disarmed_text="Disarmed by external command",
)
