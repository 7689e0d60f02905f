"""PX4 v1.17 for all vehicle types: mode numbers, flags, capabilities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mavlink_sitl.autopilot.parameters import ParameterSpec
from mavlink_sitl.autopilot.personality import ModeSpec
from mavlink_sitl.autopilot.personality.parameters import table


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

TERMINATION = custom_mode(10)

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
    custom_mode(4, 9): "Precision Landing",
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
        (custom_mode(4, 9), 0, 1, "Precision Landing"),
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
