"""ArduRover 4.7-dev of May 2025, as it was recorded; for cars and for boats."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.common.parameters import ParameterSpec, ParameterType
from mavlink_sitl.autopilot.personality import (
    NOT_MODELLED,
    BootStep,
    ModeSpec,
    Personality,
    Sensors,
)
from mavlink_sitl.autopilot.personality.arducopter import ARDUCOPTER
from mavlink_sitl.autopilot.personality.shared import (
    ATTITUDE,
    COMMON,
    PLACE,
    RATES,
    YAW,
    saved_barometers,
    saved_calibrations,
    saved_source,
    streams,
)
from mavlink_sitl.autopilot.plans.plan_rules import ARDUPILOT_PLANS

_INT8 = ParameterType.INT8
_INT16 = ParameterType.INT16

MANUAL_INPUT, AUTONOMOUS = 0x40, 0x08
"""Of HEARTBEAT.base_mode: in modes that a pilot drives, in modes that the firmware drives"""


def _driven(number: int, name: str, behaviour: str) -> ModeSpec:
    return ModeSpec(number, name, behaviour, armable=True, base_flags=MANUAL_INPUT)


def _by_itself(number: int, name: str, behaviour: str, armable: bool = True) -> ModeSpec:
    return ModeSpec(number, name, behaviour, True, armable, base_flags=AUTONOMOUS)


_MODES = (
    _driven(0, "MANUAL", "manual"),
    _driven(1, "ACRO", "acro"),
    _driven(3, "STEERING", "acro"),
    ModeSpec(4, "HOLD", "hold", armable=True, base_flags=0),
    _by_itself(5, "LOITER", "loiter"),
    _by_itself(9, "CIRCLE", "circle"),
    _by_itself(10, "AUTO", "auto"),
    _by_itself(11, "RTL", "rtl", armable=False),
    _by_itself(12, "SMART_RTL", "smart_rtl", armable=False),
    _by_itself(15, "GUIDED", "guided"),
)

# Defaults are the firmware's where it has one and the recordings do not say otherwise.
_PARAMETERS = (
    *COMMON,
    ParameterSpec("ATC_ACCEL_MAX", 1.0),
    ParameterSpec("ATC_STR_RAT_MAX", 120.0),
    ParameterSpec("ATC_TURN_MAX_G", 0.6),
    ParameterSpec("CIRC_RADIUS", 20.0),
    ParameterSpec("CIRC_SPEED", 0.0),
    ParameterSpec("CRUISE_SPEED", 5.0),
    ParameterSpec("FENCE_TYPE", 6.0, _INT8),
    ParameterSpec("FS_ACTION", 2.0, _INT8),
    ParameterSpec("FS_EKF_ACTION", 1.0, _INT8),
    ParameterSpec("FS_GCS_ENABLE", 0.0, _INT8),
    ParameterSpec("FS_GCS_TIMEOUT", 5.0),
    ParameterSpec("FS_THR_ENABLE", 1.0, _INT8),
    ParameterSpec("FS_TIMEOUT", 1.5),
    ParameterSpec("LOIT_RADIUS", 2.0),
    ParameterSpec("PSC_POS_P", 0.2),
    ParameterSpec("RALLY_INCL_HOME", 1.0, _INT8),
    ParameterSpec("RALLY_LIMIT_KM", 0.5),
    ParameterSpec("RTL_SPEED", 0.0),
    ParameterSpec("SRTL_ACCURACY", 2.0),
    ParameterSpec("SRTL_POINTS", 300.0, _INT16),
    ParameterSpec("TURN_RADIUS", 0.9),
    ParameterSpec("WP_ACCEL", 0.0),
    ParameterSpec("WP_JERK", 0.0),
    ParameterSpec("WP_RADIUS", 2.0),
    ParameterSpec("WP_SPEED", 0.0),
)

_BOOT = (
    BootStep(1.73, "Barometer 1 calibration complete"),
    BootStep(1.73, "Barometer 2 calibration complete"),
    BootStep(1.75, "Beginning INS calibration. Do not move vehicle"),
    BootStep(2.37, "ArduPilot Ready"),
    BootStep(2.37, "AHRS: DCM active"),
    BootStep(4.39, "EKF3 IMU0 initialised"),
    BootStep(4.39, "EKF3 IMU1 initialised"),
    BootStep(6.00, "EKF3 IMU0 tilt alignment complete"),
    BootStep(6.00, "EKF3 IMU1 tilt alignment complete"),
    BootStep(6.07, "EKF3 IMU0 MAG0 initial yaw alignment complete"),
    BootStep(6.07, "EKF3 IMU1 MAG0 initial yaw alignment complete"),
    BootStep(9.67, "GPS 1: probing for u-blox at 230400 baud"),
    BootStep(9.70, "GPS 1: detected u-blox"),
    BootStep(19.88, "EKF3 IMU0 origin set"),
    BootStep(19.88, "EKF3 IMU1 origin set"),
    BootStep(19.96, "Field Elevation Set: {elevation:.0f}m"),
    BootStep(42.10, "EKF3 IMU0 is using GPS"),
    BootStep(42.10, "EKF3 IMU1 is using GPS"),
    BootStep(42.10, "AHRS: EKF3 active"),
)

ARDUROVER = replace(
    ARDUCOPTER,
    name="ArduRover",
    kind="rover",
    mav_type=10,
    capabilities=0xF1EF & ~NOT_MODELLED,
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    plan_rules=ARDUPILOT_PLANS,
    boot=_BOOT,
    saved=(*saved_barometers(1.73), *saved_calibrations(1.85, 2.37), *saved_source(3.40)),
    ready_s=42.10,
    gps_fix_s=9.75,
    battery_ready_s=2.4,
    origin_s=19.88,
    standby_s=2.365,
    boot_mode=16,
    boot_flags=MANUAL_INPUT,
    streams=streams(raw_controller=(34,)),
    sensors=Sensors(
        present=0x1321DC0F,
        enabled=0x1201800F,
        healthy=0x0301810F,
        by_mode={
            "MANUAL": 0,
            "HOLD": 0,
            "ACRO": RATES | ATTITUDE,
            "STEERING": RATES | ATTITUDE,
        },
        otherwise=RATES | ATTITUDE | YAW | PLACE,
        estimator_needs_gps=True,
    ),
    aloft_texts=(),
    armed_text="Throttle armed",
    disarmed_text="Throttle disarmed",
)

ARDUBOAT: Personality = replace(ARDUROVER, name="ArduRover (boat)", kind="boat", mav_type=11)
