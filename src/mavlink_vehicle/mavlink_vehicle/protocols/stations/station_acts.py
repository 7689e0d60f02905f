"""Reads a ground station's message as an action on the autopilot, if it matters to the goal.

Pure: one message in, at most one act out. It says what is asked, not what the autopilot makes
of it: an ArduPilot answers MISSION_CLEAR_ALL with an error while it flies its mission, and a PX4
has no DO_PAUSE_CONTINUE, but what the station's user wants is clear all the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import StationAct
from mavlink_vehicle.profiles import ModePacking, Profile
from mavlink_vehicle.protocols.operations.command import command_name

_INT32_MAX = 0x7FFFFFFF
_CUSTOM_MODE = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_CHANGE_MODE = mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
_ALL_LISTS = mavlink.MAV_MISSION_TYPE_ALL
_BY_FORCE = 21196
_Command = mavlink.MAVLink_command_long_message | mavlink.MAVLink_command_int_message


@dataclass(frozen=True)
class Act:
    """The requested action; the fields are those of `events.StationActed`."""

    what: StationAct
    how: str
    mode: int | None = None
    command: int | None = None


def is_mission_list(mission_type: int) -> bool:
    """Return whether a MAV_MISSION_TYPE covers the mission itself."""
    return mission_type in (mavlink.MAV_MISSION_TYPE_MISSION, _ALL_LISTS)


def act_of(message: Message, profile: Profile) -> Act | None:
    """Return what a message to the autopilot asks for; None when it does not touch its flight.

    The offer of a new mission (MISSION_COUNT) is no act: that is for the autopilot to take.
    """
    reader = _READERS.get(message.__class__)
    return None if reader is None else reader(message, profile)


def mode_act(mode: int | None, how: str, profile: Profile) -> Act:
    """Return what a change to a mode is: a pause, a resume, or just another mode."""
    if mode is not None:
        if mode == profile.mode_number(profile.hold_mode):
            return Act(StationAct.PAUSED, how, mode)
        flown_by_us = (profile.mission_mode, profile.control_mode)
        if mode in (profile.mode_number(name) for name in flown_by_us):
            return Act(StationAct.CONTINUED, how, mode)
    return Act(StationAct.CHANGED_MODE, how, mode)


def _set_mode(message: mavlink.MAVLink_set_mode_message, profile: Profile) -> Act:
    mode = message.custom_mode if message.base_mode & _CUSTOM_MODE else None
    return mode_act(mode, _mode_sentence("SET_MODE", mode, profile), profile)


def _clear_all(message: mavlink.MAVLink_mission_clear_all_message, _profile: Profile) -> Act | None:
    if not is_mission_list(message.mission_type):
        return None
    return Act(StationAct.CLEARED_MISSION, "MISSION_CLEAR_ALL")


def _set_current(message: mavlink.MAVLink_mission_set_current_message, _profile: Profile) -> Act:
    return Act(StationAct.CHANGED_ITEM, f"MISSION_SET_CURRENT {message.seq}")


def _command(message: _Command, profile: Profile) -> Act | None:
    reader = COMMANDS.get(message.command)
    act = None if reader is None else reader(message, profile)
    return None if act is None else replace(act, command=message.command)


def _do_set_mode(message: _Command, profile: Profile) -> Act:
    mode = _whole(message.param2)
    base_mode = _whole(message.param1)
    if mode is not None and profile.mode_packing is ModePacking.MAIN_AND_SUB:
        mode = (mode & 0xFF) << 16 | ((_whole(message.param3) or 0) & 0xFF) << 24
    if base_mode is None or not base_mode & _CUSTOM_MODE:
        mode = None
    return mode_act(mode, _mode_sentence("DO_SET_MODE", mode, profile), profile)


def _do_set_standard_mode(message: _Command, profile: Profile) -> Act:
    standard = _whole(message.param1)
    names: dict[int | None, str | None] = {
        mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY: profile.return_mode,
        mavlink.MAV_STANDARD_MODE_MISSION: profile.mission_mode,
        mavlink.MAV_STANDARD_MODE_LAND: profile.land_mode,
        mavlink.MAV_STANDARD_MODE_TAKEOFF: profile.takeoff.mode,
    }
    name = names.get(standard)
    how = f"DO_SET_STANDARD_MODE {standard if name is None else name}"
    return mode_act(profile.mode_number(name), how, profile)


def _pause_continue(message: _Command, _profile: Profile) -> Act | None:
    if message.param1 == 0:
        return Act(StationAct.PAUSED, "DO_PAUSE_CONTINUE 0")
    if message.param1 == 1:
        return Act(StationAct.CONTINUED, "DO_PAUSE_CONTINUE 1")
    return None


def _reposition(message: _Command, profile: Profile) -> Act:
    if isinstance(message, mavlink.MAVLink_command_long_message):
        elsewhere = not (math.isnan(message.param5) or math.isnan(message.param6))
    else:
        elsewhere = _INT32_MAX not in (message.x, message.y)
    if not elsewhere:
        return Act(StationAct.PAUSED, "DO_REPOSITION without a position")
    # A PX4 goes there in its hold mode, an ArduPilot in GUIDED.
    in_hold = profile.mode_packing is ModePacking.MAIN_AND_SUB
    changes = bool((_whole(message.param2) or 0) & _CHANGE_MODE)
    mode = profile.mode_number(profile.hold_mode if in_hold else profile.control_mode)
    return Act(StationAct.CHANGED_MODE, "DO_REPOSITION to a position", mode if changes else None)


def _arm_disarm(message: _Command, _profile: Profile) -> Act | None:
    if message.param1 != 0:
        return None
    force = " by force" if message.param2 == _BY_FORCE else ""
    return Act(StationAct.CHANGED_MODE, f"COMPONENT_ARM_DISARM 0 (disarming{force})")


def _flight_termination(message: _Command, _profile: Profile) -> Act | None:
    if not message.param1 >= 0.5:
        return None
    return Act(StationAct.CHANGED_MODE, "DO_FLIGHTTERMINATION")


def _set_mission_current(message: _Command, _profile: Profile) -> Act:
    return Act(StationAct.CHANGED_ITEM, f"DO_SET_MISSION_CURRENT {message.param1:g}")


def _mission_start(_message: _Command, _profile: Profile) -> Act:
    return Act(StationAct.CONTINUED, "MISSION_START")


def _loiter(message: _Command, profile: Profile) -> Act:
    name = "LOITER" if "LOITER" in profile.modes else profile.hold_mode
    return mode_act(profile.mode_number(name), command_name(message.command), profile)


def _going(name: Callable[[Profile], str | None]) -> Callable[[_Command, Profile], Act]:
    def reader(message: _Command, profile: Profile) -> Act:
        mode = profile.mode_number(name(profile))
        return Act(StationAct.CHANGED_MODE, command_name(message.command), mode)

    return reader


def _mode_sentence(message_name: str, mode: int | None, profile: Profile) -> str:
    return message_name if mode is None else f"{message_name} {profile.mode_name(mode)}"


def _whole(value: float) -> int | None:
    return int(value) if math.isfinite(value) and 0.0 <= value < 2.0**32 else None


COMMANDS: dict[int, Callable[[_Command, Profile], Act | None]] = {
    mavlink.MAV_CMD_DO_SET_MODE: _do_set_mode,
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: _do_set_standard_mode,
    mavlink.MAV_CMD_DO_PAUSE_CONTINUE: _pause_continue,
    mavlink.MAV_CMD_DO_REPOSITION: _reposition,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: _arm_disarm,
    mavlink.MAV_CMD_DO_FLIGHTTERMINATION: _flight_termination,
    mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: _set_mission_current,
    mavlink.MAV_CMD_MISSION_START: _mission_start,
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: _loiter,
    mavlink.MAV_CMD_NAV_TAKEOFF: _going(lambda profile: profile.takeoff.mode),
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: _going(lambda profile: profile.takeoff.mode),
    mavlink.MAV_CMD_NAV_LAND: _going(lambda profile: profile.land_mode),
    mavlink.MAV_CMD_NAV_VTOL_LAND: _going(lambda profile: profile.land_mode),
    mavlink.MAV_CMD_DO_LAND_START: _going(lambda _: None),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: _going(lambda profile: profile.return_mode),
    mavlink.MAV_CMD_DO_ORBIT: _going(lambda _: None),
}
"""The functions that read a command, by its number."""
# Each takes the messages of its class.
_READERS: dict[type, Callable[..., Act | None]] = {
    mavlink.MAVLink_command_long_message: _command,
    mavlink.MAVLink_command_int_message: _command,
    mavlink.MAVLink_set_mode_message: _set_mode,
    mavlink.MAVLink_mission_clear_all_message: _clear_all,
    mavlink.MAVLink_mission_set_current_message: _set_current,
}
