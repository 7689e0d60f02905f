"""PX4 v1.17 for a multicopter, as it was recorded (`tlogs/px4`)."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.personality.px4 import (
    ALTCTL,
    BY_COMPUTER,
    BY_HAND,
    BY_ITSELF,
    CAPABILITIES,
    LAND,
    LOITER,
    MANUAL,
    MISSION,
    OFFBOARD,
    POSCTL,
    RTL,
    TAKEOFF,
    custom_mode,
)
from mavlink_sitl.autopilot.plan_rules import PX4_PLANS

_INT32 = ParameterType.INT32


_MODES = (
    ModeSpec(LOITER, "AUTO.LOITER", "px4_hold", True, True, base_flags=BY_ITSELF),
    ModeSpec(MANUAL, "MANUAL", "px4_manual", False, True, base_flags=BY_HAND),
    ModeSpec(ALTCTL, "ALTCTL", "px4_altitude", False, True, base_flags=BY_HAND),
    ModeSpec(POSCTL, "POSCTL", "px4_position", True, True, base_flags=BY_HAND),
    ModeSpec(MISSION, "AUTO.MISSION", "px4_mission", True, True, base_flags=BY_ITSELF),
    ModeSpec(RTL, "AUTO.RTL", "px4_return", True, base_flags=BY_ITSELF),
    ModeSpec(OFFBOARD, "OFFBOARD", "px4_offboard", True, True, base_flags=BY_COMPUTER),
    ModeSpec(TAKEOFF, "AUTO.TAKEOFF", "px4_takeoff", True, True, base_flags=BY_ITSELF),
    ModeSpec(LAND, "AUTO.LAND", "px4_land", base_flags=BY_ITSELF),
)
"""The modes that are flown here; the first one is that of power-up without a receiver."""

_AVAILABLE: tuple[tuple[int, int, int, str], ...] = (
    (MANUAL, 0, 1, "Manual"),
    (ALTCTL, 4, 0, ""),
    (POSCTL, 1, 0, ""),
    (MISSION, 6, 1, ""),
    (LOITER, 0, 1, "Hold"),
    (RTL, 5, 1, ""),
    (custom_mode(3, 2), 0, 1, "Position Slow"),
    (custom_mode(11), 0, 0, "Altitude Cruise"),
    (custom_mode(5), 0, 1, "Acro"),
    (custom_mode(10), 0, 3, "Termination"),
    (OFFBOARD, 0, 1, "Offboard"),
    (custom_mode(7), 0, 1, "Stabilized"),
    (TAKEOFF, 8, 1, ""),
    (LAND, 7, 1, ""),
    (custom_mode(4, 8), 0, 1, "Follow Target"),
    (custom_mode(4, 9), 0, 1, "Precision Landing"),
    (custom_mode(3, 1), 2, 1, ""),
    (custom_mode(4, 10), 0, 1, "VTOL Takeoff"),
    *((custom_mode(4, sub), 0, 2, "(Mode not available)") for sub in range(11, 19)),
)
"""AVAILABLE_MODES as recorded: custom mode, standard mode, properties, name"""

_PARAMETERS = (
    ParameterSpec("BAT1_N_CELLS", 4.0, _INT32),
    ParameterSpec("BAT1_V_CHARGED", 4.05),
    ParameterSpec("BAT1_V_EMPTY", 3.6),
    ParameterSpec("BAT_CRIT_THR", 0.07),
    ParameterSpec("BAT_EMERGEN_THR", 0.05),
    ParameterSpec("BAT_LOW_THR", 0.15),
    ParameterSpec("COM_DISARM_LAND", 2.0),
    ParameterSpec("COM_DISARM_PRFLT", 10.0),
    ParameterSpec("COM_DL_LOSS_T", 10.0, _INT32),
    ParameterSpec("COM_LOW_BAT_ACT", 0.0, _INT32),
    ParameterSpec("COM_OBL_RC_ACT", 0.0, _INT32),
    ParameterSpec("COM_OF_LOSS_T", 1.0),
    ParameterSpec("COM_RC_LOSS_T", 0.5),
    ParameterSpec("COM_SPOOLUP_TIME", 1.0),
    ParameterSpec("MIS_TAKEOFF_ALT", 2.5),
    ParameterSpec("MPC_ACC_HOR", 3.0),
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
    ParameterSpec("NAV_DLL_ACT", 0.0, _INT32),
    ParameterSpec("NAV_RCL_ACT", 2.0, _INT32),
    ParameterSpec("RTL_CONE_ANG", 45.0, _INT32),
    ParameterSpec("RTL_DESCEND_ALT", 10.0),
    ParameterSpec("RTL_LAND_DELAY", 0.0),
    ParameterSpec("RTL_MIN_DIST", 10.0),
    ParameterSpec("RTL_RETURN_ALT", 30.0),
    ParameterSpec("SIM_BAT_DRAIN", 60.0),
    ParameterSpec("SIM_BAT_MIN_PCT", 50.0),
    ParameterSpec("SIM_GPS_USED", 10.0, _INT32),
    ParameterSpec("SYS_FAILURE_EN", 0.0, _INT32),
)

PX4COPTER = Personality(
    name="PX4 multicopter",
    mav_type=2,
    mav_autopilot=12,
    capabilities=CAPABILITIES,
    flight_sw_version=17891583,
    flight_custom_version="d6f12ad1",
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    boot=(),
    ready_s=4.4,
    gps_fix_s=0.5,
    battery_ready_s=0.2,
    origin_s=3.8,
    first_heartbeat_s=0.16,
    standby_s=1.0,
    streams={},
    shortest_interval_us=1000,
    available_modes=_AVAILABLE,
    plan_rules=PX4_PLANS,
    kind="px4copter",
    armed_text="Armed by external command",
    disarmed_text="Disarmed by external command",
)
