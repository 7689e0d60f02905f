"""The vehicles that can be rehearsed, and the parameters that decide their flights."""

from __future__ import annotations

from navigation_bridge.configuration.parameter_table import PARAMETERS

__all__ = ["KINDS", "SERVER_PARAMETERS", "VEHICLE_PARAMETERS"]

KINDS = {
    "ArduCopter": ("copter", "ardupilot"),
    "PX4 multicopter": ("copter", "px4"),
    "ArduRover": ("rover", "ardupilot"),
    "ArduRover boat": ("boat", "ardupilot"),
    "PX4 rover": ("rover", "px4"),
    "PX4 boat": ("boat", "px4"),
}
"""Kind and firmware of the simulator, by the name in the server's status"""

SERVER_PARAMETERS = tuple(spec.name for spec in PARAMETERS if spec.rehearsed)
"""The server's parameters that decide a flight"""

_ARDUPILOT = (
    "BATT_CAPACITY", "FENCE_ENABLE", "FENCE_TYPE", "FENCE_RADIUS", "FENCE_MARGIN", "FENCE_ACTION",
)  # fmt: skip
_ARDUROVER = (
    *_ARDUPILOT, "CRUISE_SPEED", "WP_SPEED", "WP_RADIUS", "RTL_SPEED", "TURN_RADIUS",
    "ATC_ACCEL_MAX", "ATC_STR_RAT_MAX", "ATC_TURN_MAX_G", "FS_GCS_TIMEOUT",
    "FS_ACTION",
)  # fmt: skip
_PX4 = (
    "SIM_BAT_DRAIN", "SIM_BAT_MIN_PCT", "GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST",
    "COM_OF_LOSS_T", "COM_OBL_RC_ACT", "NAV_DLL_ACT", "COM_DL_LOSS_T", "RTL_RETURN_ALT",
    "RTL_DESCEND_ALT", "RTL_LAND_DELAY",
)  # fmt: skip
_PX4_ROVER = (
    *_PX4, "RO_SPEED_LIM", "RO_ACCEL_LIM", "RO_DECEL_LIM", "RO_JERK_LIM", "RO_YAW_RATE_LIM",
    "RA_WHEEL_BASE", "RA_MAX_STR_ANG",
)  # fmt: skip
VEHICLE_PARAMETERS = {
    "ArduCopter": (
        *_ARDUPILOT, "FENCE_ALT_MAX", "FENCE_ALT_MIN", "WPNAV_SPEED", "WPNAV_SPEED_UP",
        "WPNAV_SPEED_DN", "WPNAV_ACCEL", "WPNAV_ACCEL_Z", "WPNAV_RADIUS", "PSC_JERK_XY",
        "PSC_JERK_Z", "GUID_TIMEOUT", "LAND_SPEED", "LAND_SPEED_HIGH", "LAND_ALT_LOW", "RTL_ALT",
        "RTL_SPEED", "RTL_LOIT_TIME", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT",
    ),
    "PX4 multicopter": (
        *_PX4, "MIS_TAKEOFF_ALT", "MPC_ACC_HOR", "MPC_ACC_UP_MAX", "MPC_JERK_AUTO",
        "MPC_LAND_SPEED", "MPC_TKO_RAMP_T", "MPC_TKO_SPEED", "MPC_XY_CRUISE", "MPC_XY_P",
        "MPC_XY_VEL_MAX", "MPC_Z_P", "MPC_Z_VEL_MAX_DN", "MPC_Z_VEL_MAX_UP", "MPC_Z_V_AUTO_DN",
        "MPC_Z_V_AUTO_UP",
    ),
    "ArduRover": _ARDUROVER,
    "ArduRover boat": _ARDUROVER,
    "PX4 rover": _PX4_ROVER,
    "PX4 boat": _PX4_ROVER,
}  # fmt: skip
"""The vehicle's parameters that decide a flight, by the name in the server's status"""
