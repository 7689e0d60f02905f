"""ArduCopter 4.7-dev of May 2025, as it was recorded."""

from __future__ import annotations

from mavlink_sitl.autopilot.common.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality import (
    NOT_MODELLED,
    BootStep,
    ModeSpec,
    Personality,
    Sensors,
)
from mavlink_sitl.autopilot.personality.shared import (
    ATTITUDE,
    COMMON,
    HEIGHT,
    HEIGHT_FENCE,
    PLACE,
    RATES,
    SIM_WIND,
    YAW,
    saved_barometers,
    saved_calibrations,
    saved_source,
    streams,
)
from mavlink_sitl.autopilot.plans.plan_rules import ARDUPILOT_PLANS

SET_ATTITUDE_TARGET = 0x0040
"""A capability that other vehicle types do not have here"""

_INT8 = ParameterType.INT8
_INT16 = ParameterType.INT16
_INT32 = ParameterType.INT32

_MODES = (
    ModeSpec(0, "STABILIZE", "stabilize", armable=True),
    ModeSpec(2, "ALT_HOLD", "alt_hold", armable=True),
    ModeSpec(3, "AUTO", "auto", requires_position=True, position_controlled=True),
    ModeSpec(4, "GUIDED", "guided", True, armable=True, position_controlled=True),
    ModeSpec(5, "LOITER", "loiter", True, armable=True, position_controlled=True),
    ModeSpec(6, "RTL", "rtl", True, position_controlled=True),
    ModeSpec(7, "CIRCLE", "circle", True, position_controlled=True),
    ModeSpec(9, "LAND", "land", position_controlled=True),
    ModeSpec(16, "POSHOLD", "loiter", True, armable=True, position_controlled=True),
    ModeSpec(17, "BRAKE", "brake", True, position_controlled=True),
    ModeSpec(18, "THROW", "throw", True, armable=True),
)

# Defaults are the firmware's where it has one and the recordings do not say otherwise.
_PARAMETERS = (
    *COMMON,
    *HEIGHT_FENCE,
    *SIM_WIND,
    ParameterSpec("AUTO_OPTIONS", 0.0, _INT32),
    ParameterSpec("AVOID_ENABLE", 3.0, _INT8),
    ParameterSpec("CIRCLE_RADIUS", 1000.0),
    ParameterSpec("CIRCLE_RATE", 20.0),
    ParameterSpec("DISARM_DELAY", 10.0, _INT8),
    ParameterSpec("FENCE_TYPE", 7.0, _INT8),
    ParameterSpec("FS_EKF_ACTION", 1.0, _INT8),
    ParameterSpec("FS_GCS_ENABLE", 0.0, _INT8),
    ParameterSpec("FS_GCS_TIMEOUT", 5.0),
    ParameterSpec("FS_THR_ENABLE", 1.0, _INT8),
    ParameterSpec("GUID_TIMEOUT", 3.0),
    ParameterSpec("LAND_ALT_LOW", 1000.0, _INT16),
    ParameterSpec("LAND_SPEED", 50.0, _INT16),
    ParameterSpec("LAND_SPEED_HIGH", 0.0, _INT16),
    ParameterSpec("PILOT_ACCEL_Z", 250.0, _INT16),
    ParameterSpec("PILOT_SPEED_DN", 0.0, _INT16),
    ParameterSpec("PILOT_SPEED_UP", 250.0, _INT16),
    ParameterSpec("PSC_JERK_XY", 5.0),
    ParameterSpec("PSC_JERK_Z", 5.0),
    ParameterSpec("RALLY_LIMIT_KM", 0.3),
    ParameterSpec("RTL_ALT", 1500.0, _INT32),
    ParameterSpec("RTL_LOIT_TIME", 5000.0, _INT32),
    ParameterSpec("RTL_SPEED", 0.0, _INT16),
    ParameterSpec("WPNAV_ACCEL", 250.0),
    ParameterSpec("WPNAV_ACCEL_Z", 100.0),
    ParameterSpec("WPNAV_JERK", 1.0),
    ParameterSpec("WPNAV_RADIUS", 200.0),
    ParameterSpec("WPNAV_SPEED", 1000.0),
    ParameterSpec("WPNAV_SPEED_DN", 150.0),
    ParameterSpec("WPNAV_SPEED_UP", 250.0),
)

_BOOT = (
    BootStep(1.93, "Barometer 1 calibration complete"),
    BootStep(1.93, "Barometer 2 calibration complete"),
    BootStep(2.46, "ArduPilot Ready"),
    BootStep(2.46, "AHRS: DCM active"),
    BootStep(4.46, "EKF3 IMU0 initialised"),
    BootStep(4.46, "EKF3 IMU1 initialised"),
    BootStep(4.46, "AHRS: EKF3 active"),
    BootStep(5.81, "EKF3 IMU0 tilt alignment complete"),
    BootStep(5.81, "EKF3 IMU1 tilt alignment complete"),
    BootStep(5.91, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    BootStep(5.91, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    BootStep(9.81, "GPS 1: probing for u-blox at 230400 baud"),
    BootStep(9.84, "GPS 1: detected u-blox"),
    BootStep(20.03, "EKF3 IMU0 origin set"),
    BootStep(20.06, "Field Elevation Set: {elevation:.0f}m"),
    BootStep(20.22, "EKF3 IMU1 origin set"),
    BootStep(41.64, "EKF3 IMU0 is using GPS"),
    BootStep(41.64, "EKF3 IMU1 is using GPS"),
)

ARDUCOPTER = Personality(
    name="ArduCopter",
    mav_type=2,
    mav_autopilot=3,
    capabilities=0xFBEF & ~NOT_MODELLED | SET_ATTITUDE_TARGET,
    flight_sw_version=0x04070000,
    flight_custom_version="cef8bcef",
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    boot=_BOOT,
    ready_s=41.64,
    gps_fix_s=9.9,
    battery_ready_s=2.6,
    origin_s=20.03,
    first_heartbeat_s=1.0,
    standby_s=2.46,
    streams=streams(),
    sensors=Sensors(
        present=0x5361FC0F,
        enabled=0x5241800F,
        healthy=0x4741800F,
        by_mode={
            "STABILIZE": RATES | ATTITUDE | YAW,
            "ALT_HOLD": RATES | ATTITUDE | YAW | HEIGHT,
        },
        otherwise=RATES | ATTITUDE | YAW | HEIGHT | PLACE,
    ),
    shortest_interval_us=3125,
    plan_rules=ARDUPILOT_PLANS,
    saved=(*saved_barometers(1.93), *saved_calibrations(1.93, 2.46), *saved_source(3.46)),
    estimators=("EKF3 IMU0", "EKF3 IMU1"),
    aloft_texts=tuple(f"EKF3 IMU{i} MAG0 in-flight yaw alignment complete" for i in (0, 1)),
)
