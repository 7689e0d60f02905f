"""PX4 v1.17 for all vehicle types: mode numbers, flags, capabilities, and what is a kind's own.

The multicopter is as it was recorded (`tlogs/px4`). No recordings of the others exist: parameters
are those of the firmware's own simulated aeroplane (airframe 10041, `sihsim_airplane`) and rover
(10045, `sihsim_rover_ackermann`), and of its defaults for fixed wings and boats.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mavlink_sitl.autopilot.parameters import ParameterSpec
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.personality.parameters import table
from mavlink_sitl.autopilot.plans.plan_rules import PX4_PLANS
from mavlink_sitl.geodesy import PX4


def custom_mode(main: int, sub: int = 0) -> int:
    """HEARTBEAT.custom_mode: the main mode in the third byte, the sub mode in the fourth."""
    return main << 16 | sub << 24


MANUAL = custom_mode(1)
ALTCTL = custom_mode(2)
POSCTL = custom_mode(3)
MISSION = custom_mode(4, 4)
LOITER = custom_mode(4, 3)
RTL = custom_mode(4, 5)
OFFBOARD = custom_mode(6)
TAKEOFF = custom_mode(4, 2)
LAND = custom_mode(4, 6)
ORBIT = custom_mode(3, 1)
FOLLOW_TARGET = custom_mode(4, 8)
PRECLAND = custom_mode(4, 9)

TERMINATION = custom_mode(10)
BY_STICKS = (MANUAL, ALTCTL, POSCTL)

MAIN_POSCTL, MAIN_AUTO = 3, 4
POSITION_SLOW = 2
"""A sub mode of POSCTL"""

MODE_NAMES = {
    MANUAL: "Manual",
    ALTCTL: "Altitude",
    POSCTL: "Position",
    MISSION: "Mission",
    LOITER: "Hold",
    RTL: "Return",
    custom_mode(3, 2): "Position Slow",
    custom_mode(11): "Altitude Cruise",
    custom_mode(5): "Acro",
    TERMINATION: "Termination",
    OFFBOARD: "Offboard",
    custom_mode(7): "Stabilized",
    TAKEOFF: "Takeoff",
    LAND: "Land",
    ORBIT: "Orbit",
    FOLLOW_TARGET: "Follow Target",
    PRECLAND: "Precision Landing",
    **{custom_mode(4, 10 + number): f"External {number}" for number in range(1, 9)},
}
"""Names of the modes in texts"""

BY_ITSELF, BY_HAND, BY_COMPUTER = 0x1C, 0x50, 0x10
"""base_mode: AUTO, GUIDED and STABILIZE; MANUAL_INPUT and STABILIZE; STABILIZE"""

CAPABILITIES = 0xE8FF
"""MISSION_FLOAT, PARAM_FLOAT, MISSION_INT, COMMAND_INT, PARAM_ENCODE_BYTEWISE, FTP,
SET_ATTITUDE_TARGET, SET_POSITION_TARGET_LOCAL_NED, FLIGHT_TERMINATION, MAVLINK2, MISSION_FENCE,
MISSION_RALLY, as recorded"""


def flown_modes(*, needs_position: bool) -> dict[int, ModeSpec]:
    """Return the modes that are flown here; the first one is that of power-up without a receiver.

    A car can be put into ALTCTL while disarmed, but never runs it: it has no height to hold.
    """
    modes = (
        ModeSpec(LOITER, "AUTO.LOITER", "px4_hold", True, True, base_flags=BY_ITSELF),
        ModeSpec(MANUAL, "MANUAL", "px4_manual", False, True, base_flags=BY_HAND),
        ModeSpec(ALTCTL, "ALTCTL", "px4_altitude", False, True, base_flags=BY_HAND),
        ModeSpec(POSCTL, "POSCTL", "px4_position", True, True, base_flags=BY_HAND),
        ModeSpec(MISSION, "AUTO.MISSION", "px4_mission", True, True, base_flags=BY_ITSELF),
        ModeSpec(RTL, "AUTO.RTL", "px4_return", True, base_flags=BY_ITSELF),
        ModeSpec(
            OFFBOARD, "OFFBOARD", "px4_offboard", needs_position, True, base_flags=BY_COMPUTER
        ),
        ModeSpec(
            TAKEOFF, "AUTO.TAKEOFF", "px4_takeoff", needs_position, True, base_flags=BY_ITSELF
        ),
        ModeSpec(LAND, "AUTO.LAND", "px4_land", base_flags=BY_ITSELF),
    )
    return {mode.number: mode for mode in modes}


def available_modes(
    altctl: int = 4, posctl: int = 1, orbit: int = 2
) -> tuple[tuple[int, int, int, str], ...]:
    """AVAILABLE_MODES as recorded for a multicopter: custom mode, standard mode, properties, name.

    Args:
        altctl: standard mode of ALTCTL; 0 where there is none, and then it has a name.
        posctl: the same of POSCTL.
        orbit: the same of orbit.
    """
    return (
        (MANUAL, 0, 1, "Manual"),
        (ALTCTL, altctl, 0, "" if altctl else "Altitude"),
        (POSCTL, posctl, 0, "" if posctl else "Position"),
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
        (FOLLOW_TARGET, 0, 1, "Follow Target"),
        (PRECLAND, 0, 1, "Precision Landing"),
        (ORBIT, orbit, 1, "" if orbit else "Orbit"),
        (custom_mode(4, 10), 0, 1, "VTOL Takeoff"),
        *((custom_mode(4, sub), 0, 2, "(Mode not available)") for sub in range(11, 19)),
    )


COMMON_PARAMETERS = table("px4")
"""The parameters of every kind of vehicle, with a multicopter's default values"""


def in_order(specs: Iterable[ParameterSpec], **defaults: float) -> tuple[ParameterSpec, ...]:
    """Parameters by name, as the firmware lists them; some with another default.

    The parameters that an airframe sets are always in the list.
    """
    known = sorted(specs, key=lambda spec: spec.name)
    return tuple(
        replace(spec, default=defaults[spec.name], listed=True) if spec.name in defaults else spec
        for spec in known
    )


_OF_COPTERS = (
    ModeSpec(ORBIT, "ORBIT", "px4_orbit", True, base_flags=BY_COMPUTER),
    ModeSpec(
        FOLLOW_TARGET,
        "AUTO.FOLLOW_TARGET",
        "px4_follow_target",
        True,
        base_flags=BY_COMPUTER,
    ),
    ModeSpec(PRECLAND, "AUTO.PRECLAND", "px4_precland", True, base_flags=BY_ITSELF),
)
"""Not to be armed in; not AUTO in base_mode, as sticks may change what they do (read in the
firmware)"""

PX4COPTER = Personality(
    name="PX4 multicopter",
    mav_type=2,
    mav_autopilot=12,
    capabilities=CAPABILITIES,
    flight_sw_version=17891583,
    flight_custom_version="d6f12ad1",
    modes={**flown_modes(needs_position=True), **{mode.number: mode for mode in _OF_COPTERS}},
    parameters=in_order((*COMMON_PARAMETERS, *table("px4copter"))),
    whole="px4_copter",
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
    says_impacts=False,
)

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


def _of_rovers(accept_m: float, **others: float) -> tuple[ParameterSpec, ...]:
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
    parameters=_of_rovers(0.5),
)
PX4BOAT = replace(
    PX4ROVER,
    name="PX4 boat",
    kind="px4boat",
    mav_type=11,
    parameters=_of_rovers(
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
