"""Items of missions, fences and rally points: conversion from and to messages, and checks."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import replace

from mavlink_sitl.autopilot.plans.plan_commands import CIRCLES, FENCE, POLYGONS, WITH_HEADING
from mavlink_sitl.autopilot.plans.plan_rules import PX4_DEVICES, PlanRules
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem, PlanType
from mavlink_sitl.mavlink.codec import Message, dialect

OK, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE = 0, 1, 2, 3, 4
INVALID_PARAM1, INVALID_X, INVALID_Y, INVALID_Z, INVALID_SEQUENCE = 6, 10, 11, 12, 13
DENIED = 14
"""MAV_MISSION_RESULT, as far as it is used"""

_AREAS = POLYGONS | CIRCLES | {Cmd.RALLY_POINT}
_PLACES = WITH_HEADING | FENCE | _AREAS | {Cmd.SET_HOME, Cmd.SET_ROI, Cmd.SET_ROI_LOCATION}
_FRAME_MISSION = 2
LEAST_CORNERS = 3
HIGHEST_M = 1e6
BYTE = 255
NOT_GIVEN = 2**31 - 1
"""x and y of a MISSION_ITEM_INT or COMMAND_INT without a place"""


def degrees_to_int(value: float) -> int:
    """1e7 degrees; what is not a number or too large becomes a value that no check lets pass."""
    if not math.isfinite(value):
        return NOT_GIVEN
    return int(min(max(round(value * 1e7), -(2**31)), 2**31 - 1))


def from_message(message: Message) -> PlanItem:
    """MISSION_ITEM_INT or MISSION_ITEM."""
    x, y = message.x, message.y
    if message.get_type() == "MISSION_ITEM":
        x, y = degrees_to_int(x), degrees_to_int(y)
    params = (message.param1, message.param2, message.param3, message.param4)
    return PlanItem(message.command, message.frame, params, x, y, message.z, message.autocontinue)


def fault(item: PlanItem, plan_type: PlanType, rules: PlanRules) -> int:
    """The MAV_MISSION_RESULT of an item; OK when nothing is wrong with it."""
    if rules.by_frame is not None:
        return _fault_by_frame(item, plan_type, rules.by_frame) or _fault_of_unused(item, rules)
    if item.command not in rules.commands[plan_type]:
        return UNSUPPORTED
    placeless = plan_type is not PlanType.MISSION and item.frame == _FRAME_MISSION
    if item.frame not in rules.frames or placeless:
        return UNSUPPORTED_FRAME
    # The numbers of a fence are looked at when it is complete.
    return OK if plan_type is PlanType.FENCE else _fault_of_numbers(item, rules)


def _fault_of_numbers(item: PlanItem, rules: PlanRules) -> int:
    for i, value in enumerate(item.params):
        free = rules.keeps_nan or item.command in WITH_HEADING
        allowed = i == 3 and free and math.isnan(value)
        if not math.isfinite(value) and not allowed:
            return INVALID_PARAM1 + i
    if item.command in _PLACES:
        if abs(item.x) > 900_000_000:
            return INVALID_X
        if abs(item.y) > 1_800_000_000:
            return INVALID_Y
        # A command without a place does not use z; MAVSDK sends NaN there.
        return OK if math.isfinite(item.z) and abs(item.z) < HIGHEST_M else INVALID_Z
    return OK


def _fault_by_frame(
    item: PlanItem, plan_type: PlanType, by_frame: Mapping[int, frozenset[int]]
) -> int:
    """PX4's checks, seen in uploads of nearly every item: its numbers are not looked at.

    A list of fence points takes waypoints, and circles of any radius; vertices of a polygon with
    fewer than three of them, as each vertex says, are an error (read in the firmware).
    """
    if item.frame not in by_frame:
        return UNSUPPORTED_FRAME
    if item.command not in by_frame[item.frame]:
        return UNSUPPORTED
    if plan_type is PlanType.MISSION and item.command in _AREAS:
        return ERROR
    corner = item.command in POLYGONS
    few = not math.isfinite(item.params[0]) or item.params[0] < LEAST_CORNERS - 0.5
    return ERROR if plan_type is PlanType.FENCE and corner and few else OK


def _fault_of_unused(item: PlanItem, rules: PlanRules) -> int:
    """A param that is set though the command does not use it.

    NaN and 0 are not set, of x and y in a global frame the largest integer alone.
    """
    used = rules.used_params.get(item.command)
    if used is None:
        return OK
    nothing = (NOT_GIVEN,) if item.frame != _FRAME_MISSION else (NOT_GIVEN, 0)
    given = [math.isfinite(value) and value != 0.0 for value in (*item.params, item.z)]
    given[4:4] = [item.x not in nothing, item.y not in nothing]
    faults = (i for i, is_set in enumerate(given) if is_set and i + 1 not in used)
    return next((INVALID_PARAM1 + i for i in faults), OK)


def stored(item: PlanItem, rules: PlanRules) -> PlanItem:
    """As the firmware keeps it."""
    if rules.keeps_nan and item.command in PX4_DEVICES:
        return item
    first, second, third, yaw = (p if math.isfinite(p) else 0.0 for p in item.params)
    if math.isnan(item.params[3]) and rules.keeps_nan:
        yaw = math.nan
    if item.command == Cmd.LOITER_TURNS and rules.by_frame is None:
        first, third, yaw = _rounded_loiter(first, third, yaw)
    if item.command == Cmd.GIMBAL_PITCHYAW and rules.by_frame is None:
        # Observed: -45.5 and 30.25 degrees come back as -45 and 30.
        first, second = float(int(first)), float(int(second))
    return replace(
        item,
        frame=rules.stored_frames.get(item.frame, item.frame),
        params=(first, second, third, yaw),
        z=min(max(item.z, -HIGHEST_M), HIGHEST_M) if math.isfinite(item.z) else 0.0,
    )


def _rounded_loiter(turns: float, radius_m: float, exit_type: float) -> tuple[float, ...]:
    """Turns, radius and exit of NAV_LOITER_TURNS as an ArduPilot has room for: a byte for each.

    Parts of a turn are kept in 256ths, radii above 255 m in tens (AP_Mission).
    """
    part = 256.0 if 0.0 < turns < 1.0 else 1.0
    turns = min(max(int(turns * part), 0), BYTE) / part
    size = abs(radius_m)
    size = float(int(size)) if size <= BYTE else 10.0 * min(int(size / 10.0), BYTE)
    return turns, math.copysign(size, radius_m), float(exit_type > 0.0)


def identity(items: list[PlanItem]) -> int:
    """A number that is another one for another list; 0 for an empty one."""
    if not items:
        return 0
    return zlib.crc32(repr(items).encode("ascii")) or 1


def to_message(
    item: PlanItem, seq: int, current: bool, target: tuple[int, int], plan_type: int, as_int: bool
) -> Message:
    """MISSION_ITEM_INT, or MISSION_ITEM where that was requested."""
    make = dialect.MAVLink_mission_item_int_message
    x: float = item.x
    y: float = item.y
    if not as_int:
        make, x, y = dialect.MAVLink_mission_item_message, item.x / 1e7, item.y / 1e7
    return make(
        *target,
        seq,
        item.frame,
        item.command,
        int(current),
        item.autocontinue,
        *item.params,
        x,
        y,
        item.z,
        plan_type,
    )
