"""What PX4 v1.17 is whatever it flies: numbers of modes, flags, capabilities."""

from __future__ import annotations


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

MAIN_AUTO = 4

BY_ITSELF, BY_HAND, BY_COMPUTER = 0x1C, 0x50, 0x10
"""base_mode: AUTO, GUIDED and STABILIZE; MANUAL_INPUT and STABILIZE; STABILIZE"""

CAPABILITIES = 0x0002 | 0x0004 | 0x0008 | 0x0010 | 0x0080 | 0x0800 | 0xE000
"""PARAM_FLOAT, MISSION_INT, COMMAND_INT, PARAM_ENCODE_BYTEWISE, SET_POSITION_TARGET_LOCAL_NED,
FLIGHT_TERMINATION, MAVLINK2, MISSION_FENCE, MISSION_RALLY. The recorded firmware says 0xE8FF:
it has MISSION_FLOAT, FTP and SET_ATTITUDE_TARGET, too, which are not modelled."""
