"""Detects commands to a recorded vehicle on a link that is not in the recording.

A recording of one of several links has everything that the vehicle sent on it, but only those
commands that came on it. In a replay the vehicle does not get the commands of the other links.
"""

from __future__ import annotations

from comparison.recording import Recording
from mavlink_sitl.mavlink.codec import dialect

NOTE = (
    "it was also commanded on a link that is not in the recording; most differences come from that"
)
_COMMANDS = ("COMMAND_LONG", "COMMAND_INT")
_ARMING = frozenset(
    (
        dialect.MAV_CMD_COMPONENT_ARM_DISARM,
        dialect.MAV_CMD_MISSION_START,
        dialect.MAV_CMD_DO_MOTOR_TEST,
    )
)
LATEST_ANSWER_S = 2.0
"""An answer this soon after the first record may be to a command from before it"""
_STICKS = ("RC_CHANNELS_OVERRIDE", "MANUAL_CONTROL")
"""A pilot arms with them"""


def commanded_elsewhere(recording: Recording) -> bool:
    """Whether it answers, or obeys, commands that nobody in the recording sent."""
    records = sorted([*recording.sent, *recording.real], key=lambda record: record[0])
    own, asked = recording.own, set[int]()
    sticks = False
    was_armed = True
    for time_s, message in records:
        kind = message.get_type()
        if (message.get_srcSystem(), message.get_srcComponent()) != own:
            sticks |= kind in _STICKS
            if kind in _COMMANDS:
                asked.add(message.command)
            elif kind == "SET_MODE":
                asked.add(dialect.MAV_CMD_DO_SET_MODE)
        elif kind == "COMMAND_ACK" and message.command not in asked:
            if time_s > recording.begin_s + LATEST_ANSWER_S:
                return True
        elif kind == "HEARTBEAT":
            armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
            if armed and not was_armed and not sticks and asked.isdisjoint(_ARMING):
                return True
            was_armed = armed
    return False
