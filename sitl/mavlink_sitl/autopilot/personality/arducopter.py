"""ArduCopter 4.7-dev of May 2025, as it was recorded."""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.personality import (
    ModeSpec,
    Personality,
    Sensors,
    shared,
)
from mavlink_sitl.autopilot.personality.parameters import table

_MODES = (
    ModeSpec(0, "STABILIZE", "stabilize", armable=True),
    ModeSpec(1, "ACRO", "stabilize", armable=True),
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
    ModeSpec(21, "SMARTRTL", "smart_rtl", True, position_controlled=True),
    ModeSpec(27, "AUTO RTL", "auto_rtl", True, position_controlled=True),
)

# Defaults are the firmware's where it has one and the recordings do not say otherwise.
_PARAMETERS = (*shared.COMMON, *shared.HEIGHT_FENCE, *shared.SIM_WIND, *table("arducopter"))

ARDUCOPTER = Personality(
    name="ArduCopter",
    mav_type=2,
    mav_autopilot=3,
    capabilities=0xFBEF,
    flight_sw_version=0x04070000,
    flight_custom_version="cef8bcef",
    modes={mode.number: mode for mode in _MODES},
    parameters=_PARAMETERS,
    whole="ardupilot_copter",
    boot=shared.boot("arducopter"),
    ready_s=41.64,
    gps_fix_s=9.9,
    battery_ready_s=2.6,
    origin_s=20.03,
    first_heartbeat_s=1.0,
    standby_s=2.46,
    streams=shared.streams(),
    sensors=Sensors(
        present=0x5361FC0F,
        enabled=0x5241800F,
        healthy=0x4741800F,
        by_mode={
            "STABILIZE": shared.LEVEL | shared.YAW,
            "ALT_HOLD": shared.LEVEL | shared.YAW | shared.HEIGHT,
            "ACRO": shared.RATES | shared.YAW,
        },
        otherwise=shared.FLOWN,
    ),
    shortest_interval_us=3125,
    saved=shared.saved(1.93, 3.46, calibrations_s=(1.93, 2.46)),
    estimators=("EKF3 IMU0", "EKF3 IMU1"),
    banner=("ArduCopter V4.7.0-dev (cef8bcef)", "Frame: QUAD/PLUS"),
    aloft_texts=tuple(f"EKF3 IMU{i} MAG0 in-flight yaw alignment complete" for i in (0, 1)),
)

TRAVELLER = replace(
    ARDUCOPTER,
    boot_mode=16,
    aloft_texts=(),
    armed_text="Throttle armed",
    disarmed_text="Throttle disarmed",
)
"""Common part of the personalities of rovers, boats and planes"""
