"""ArduPilot 4.7-dev of May 2025, as it was recorded, for all vehicle types.

Parameters' defaults are the firmware's where it has one and the recordings do not say otherwise.
"""

from __future__ import annotations

from dataclasses import replace

from mavlink_sitl.autopilot.personality import ModeSpec, Personality, SavedStep, Sensors, shared
from mavlink_sitl.autopilot.personality.parameters import table

BY_ITSELF, DRIVES_ITSELF, DRIVEN = 0x58, 0x08, 0x40
"""Of HEARTBEAT.base_mode: in modes that a plane flies by itself, that a rover drives by itself, and
that a pilot drives"""


def _by_itself(number: int, name: str, behaviour: str, armable: bool = True) -> ModeSpec:
    return ModeSpec(number, name, behaviour, True, armable, base_flags=BY_ITSELF)


def _driven(number: int, name: str, behaviour: str) -> ModeSpec:
    return ModeSpec(number, name, behaviour, armable=True, base_flags=DRIVEN)


def _driven_at_rates(number: int, name: str, behaviour: str) -> ModeSpec:
    """Driven by the pilot, with a speed or a rate of turn that is controlled."""
    return replace(_driven(number, name, behaviour), requires_velocity=True)


def _drives_itself(number: int, name: str, behaviour: str, armable: bool = True) -> ModeSpec:
    return ModeSpec(number, name, behaviour, True, armable, base_flags=DRIVES_ITSELF)


_COPTER_MODES = (
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

ARDUCOPTER = Personality(
    name="ArduCopter",
    mav_type=2,
    mav_autopilot=3,
    capabilities=0xFBEF,
    flight_sw_version=0x04070000,
    flight_custom_version="cef8bcef",
    modes={mode.number: mode for mode in _COPTER_MODES},
    parameters=(*shared.COMMON, *shared.HEIGHT_FENCE, *shared.SIM_WIND, *table("arducopter")),
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
    shortest_interval_us=3000,
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
    shortest_interval_us=25_000,
)
"""Common part of the personalities of rovers, boats and planes. Their loop has 50 Hz, a copter's
400 Hz; messages come at most at 0.8 of it (cap_message_interval)"""

_PLANE_MODES = (
    ModeSpec(0, "MANUAL", "stick", armable=True),
    ModeSpec(1, "CIRCLE", "circle", armable=True),
    ModeSpec(2, "STABILIZE", "stick", armable=True),
    ModeSpec(4, "ACRO", "stick", armable=True),
    ModeSpec(5, "FLY_BY_WIRE_A", "stick", armable=True),
    ModeSpec(6, "FLY_BY_WIRE_B", "hold_height", armable=True),
    ModeSpec(7, "CRUISE", "cruise", armable=True),
    _by_itself(10, "AUTO", "auto"),
    _by_itself(11, "RTL", "rtl", armable=False),
    _by_itself(12, "LOITER", "loiter"),
    _by_itself(13, "TAKEOFF", "takeoff"),
    _by_itself(15, "GUIDED", "guided"),
)

ARDUPLANE = replace(
    TRAVELLER,
    name="ArduPlane",
    kind="plane",
    mav_type=1,
    capabilities=0xF36F,
    modes={mode.number: mode for mode in _PLANE_MODES},
    parameters=(*shared.COMMON, *shared.HEIGHT_FENCE, *shared.SIM_WIND, *table("arduplane")),
    whole="ardupilot_plane",
    banner=("ArduPlane V4.7.0-dev (cef8bcef)",),
    boot=shared.boot("arduplane"),
    saved=(*shared.saved(1.75, 2.76), SavedStep(3.42, "ARSPD_OFFSET", 2013.95)),
    ready_s=20.51,
    gps_fix_s=9.1,
    battery_ready_s=2.6,
    origin_s=19.49,
    standby_s=1.747,
    boot_flags=0x10,
    streams=shared.streams(raw_sensors=(295,), extra1=(11020,)),
    sensors=Sensors(
        present=0x1361FC1F,
        enabled=0x1241801F,
        healthy=0x0301801F,
        by_mode={
            "MANUAL": 0,
            "ACRO": shared.RATES,
            "STABILIZE": shared.LEVEL,
            "FLY_BY_WIRE_A": shared.LEVEL,
            "FLY_BY_WIRE_B": shared.LEVEL,
            "CRUISE": shared.LEVEL,
        },
        otherwise=shared.FLOWN,
    ),
)

_ROVER_MODES = (
    _driven(0, "MANUAL", "manual"),
    _driven_at_rates(1, "ACRO", "acro"),
    _driven_at_rates(3, "STEERING", "steering"),
    ModeSpec(4, "HOLD", "hold", armable=True, base_flags=0),
    _drives_itself(5, "LOITER", "loiter"),
    _drives_itself(9, "CIRCLE", "circle"),
    _drives_itself(10, "AUTO", "auto"),
    _drives_itself(11, "RTL", "rtl", armable=False),
    _drives_itself(12, "SMART_RTL", "smart_rtl", armable=False),
    _drives_itself(15, "GUIDED", "guided"),
)

ARDUROVER = replace(
    TRAVELLER,
    name="ArduRover",
    kind="rover",
    mav_type=10,
    capabilities=0xF1EF,
    modes={mode.number: mode for mode in _ROVER_MODES},
    parameters=(*shared.COMMON, *table("ardurover")),
    whole="ardupilot_rover",
    banner=("ArduRover V4.7.0-dev (cef8bcef)",),
    boot=shared.boot("ardurover"),
    saved=shared.saved(1.73, 3.40, calibrations_s=(1.85, 2.37)),
    ready_s=42.10,
    gps_fix_s=9.75,
    battery_ready_s=2.4,
    origin_s=19.88,
    standby_s=2.365,
    boot_flags=DRIVEN,
    streams=shared.streams(raw_controller=(34,)),
    sensors=Sensors(
        present=0x1321DC0F,
        enabled=0x1201800F,
        healthy=0x0301810F,
        by_mode={
            "MANUAL": 0,
            "HOLD": 0,
            "ACRO": shared.LEVEL,
            "STEERING": shared.LEVEL,
        },
        otherwise=shared.DRIVEN,
        estimator_needs_gps=True,
    ),
)

ARDUBOAT = replace(ARDUROVER, name="ArduRover (boat)", kind="boat", mav_type=11)
