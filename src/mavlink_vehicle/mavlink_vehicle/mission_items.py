"""Items of missions, fences and rally points, and differences between sent and stored items.

https://mavlink.io/en/services/mission.html
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Message, make, mavlink

RELATIVE_ALT = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
AMSL = mavlink.MAV_FRAME_GLOBAL_INT
TERRAIN_ALT = mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT
NO_FRAME = mavlink.MAV_FRAME_MISSION

# Two numbers each for the same frame. Which of them comes back is the firmware's choice:
# PX4 gives 6 for 3, ArduPilot 3 for 6 (observed).
_SAME_FRAME = {
    RELATIVE_ALT: mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    AMSL: mavlink.MAV_FRAME_GLOBAL,
    TERRAIN_ALT: mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT,
}
_YAW = 3
_YAW_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_LAND}
)
_PLACELESS = frozenset(
    {
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_NAV_DELAY,
        mavlink.MAV_CMD_CONDITION_YAW,
        mavlink.MAV_CMD_CONDITION_DELAY,
        mavlink.MAV_CMD_DO_JUMP,
        mavlink.MAV_CMD_DO_CHANGE_SPEED,
        mavlink.MAV_CMD_DO_SET_ROI_NONE,
        mavlink.MAV_CMD_DO_SET_SERVO,
        mavlink.MAV_CMD_DO_SET_ACTUATOR,
        mavlink.MAV_CMD_DO_GRIPPER,
        mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
    }
)
# ArduPilot keeps heights in centimetres, and all numbers travel as float32.
_HEIGHT_TOLERANCE_M = 0.011
_RELATIVE_TOLERANCE = 1e-5
_DEGREES_1E7_TOLERANCE = 1


class MissionType(enum.IntEnum):
    """MAV_MISSION_TYPE: which of the vehicle's lists."""

    MISSION = mavlink.MAV_MISSION_TYPE_MISSION
    FENCE = mavlink.MAV_MISSION_TYPE_FENCE
    RALLY = mavlink.MAV_MISSION_TYPE_RALLY


@dataclass(frozen=True)
class MissionItem:
    """One item, as in MISSION_ITEM_INT.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME; `NO_FRAME` for a command without a place.
        params: param1 to param4; NaN where the command knows an "as you like".
        x: latitude in degrees times 1e7.
        y: longitude in degrees times 1e7.
        z: height in metres, above what the frame says.
    """

    command: int
    frame: int = NO_FRAME
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    y: int = 0
    z: float = 0.0

    def message(
        self, seq: int, target: tuple[int, int], mission_type: MissionType = MissionType.MISSION
    ) -> Message:
        """Build MISSION_ITEM_INT for a system and component."""
        named = {f"param{number}": value for number, value in enumerate(self.params, start=1)}
        return make(
            "MISSION_ITEM_INT",
            target_system=target[0],
            target_component=target[1],
            seq=seq,
            frame=self.frame,
            command=self.command,
            # A PX4 continues at the item that is marked; without one, at the number that the
            # mission before had come to (observed).
            current=1 if seq == 0 and mission_type is MissionType.MISSION else 0,
            autocontinue=1,
            **named,
            x=self.x,
            y=self.y,
            z=self.z,
            mission_type=int(mission_type),
        )


def item_of(message: mavlink.MAVLink_mission_item_int_message) -> MissionItem:
    """Read MISSION_ITEM_INT."""
    return MissionItem(
        message.command,
        message.frame,
        (message.param1, message.param2, message.param3, message.param4),
        message.x,
        message.y,
        message.z,
    )


def has_place(item: MissionItem) -> bool:
    """Return whether an item says where on the earth; 0, 0 is "where you are"."""
    if item.frame == NO_FRAME or item.command in _PLACELESS:
        return False
    return bool(item.x or item.y) and abs(item.x) <= 900_000_000 and abs(item.y) <= 1_800_000_000


HOME_PLACEHOLDER = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL)
"""Sent as item 0 where that is home: the vehicle puts home in its place."""


@dataclass(frozen=True)
class MissionRules:
    """A firmware's rules for missions.

    Attributes:
        home_first: item 0 is home, whatever is sent as such (ArduPilot).
        kept_params: by command, the indices (0 to 3) of the parameters that are kept; the
            others come back as something else. A command that isn't there keeps all.
        keeps_nan: whether NaN in param4 comes back as NaN; else as 0.
        start_command: whether MAV_CMD_MISSION_START starts it. Else the mode alone does.
        rewinds: whether a new mission continues at the number of the item that the old one had
            come to, so that it must be set back to its first item.
        yaw_command: whether a heading is an item of its own (CONDITION_YAW), not a parameter
            of the waypoint.
        terrain: whether heights above the ground are taken.
        takeoff_least_m: a mission with a lower take-off is not flown.
        rally_step_m: the altitude of a rally point is stored in such steps; 0 for any.
        change_text: how the text begins that says that the mission was changed in flight.
        rejections: how the texts begin that say that a stored mission will not be flown.
    """

    home_first: bool = False
    kept_params: Mapping[int, frozenset[int]] = field(default_factory=dict)
    keeps_nan: bool = True
    start_command: bool = False
    rewinds: bool = False
    yaw_command: bool = False
    terrain: bool = False
    takeoff_least_m: float = 0.0
    rally_step_m: float = 0.0
    change_text: str = ""
    rejections: tuple[str, ...] = ()

    @property
    def offset(self) -> int:
        """The number of the first item that is ours."""
        return 1 if self.home_first else 0


def first_difference(
    sent: Sequence[MissionItem], stored: Sequence[MissionItem], rules: MissionRules
) -> str | None:
    """Return the first difference between stored and sent items, apart from permitted changes.

    Both are without home.
    """
    return _first(sent, stored, lambda a, b: _difference(a, b, rules), rules.offset)


def _first(
    sent: Sequence[MissionItem],
    stored: Sequence[MissionItem],
    difference: Callable[[MissionItem, MissionItem], str | None],
    offset: int = 0,
) -> str | None:
    if len(sent) != len(stored):
        return f"{len(stored)} items are stored instead of {len(sent)}"
    for number, (ours, theirs) in enumerate(zip(sent, stored, strict=True), start=offset):
        what = difference(ours, theirs)
        if what is not None:
            return f"item {number} has a different {what}"
    return None


def list_difference(
    sent: Sequence[MissionItem], stored: Sequence[MissionItem], kind: MissionType
) -> str | None:
    """Return the first difference between two fences, or two lists of rally points.

    Compared are, of a fence's item, the command, the number in param1 (corners, or radius) and
    the position; its frame and altitude mean nothing, and ArduPilot gives 0 for them. Of a rally
    point frame, position and altitude.
    """
    return _first(sent, stored, lambda a, b: _list_item_difference(a, b, kind))


def _list_item_difference(ours: MissionItem, theirs: MissionItem, kind: MissionType) -> str | None:
    if ours.command != theirs.command:
        return "command"
    where = _place_difference(ours, theirs)
    if where is not None:
        return where
    if kind is MissionType.FENCE:
        counts = ours.command != mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT
        same = _same_param(ours.params[0], theirs.params[0], is_yaw=False, keeps_nan=True)
        return "param1" if counts and not same else None
    if _SAME_FRAME.get(ours.frame, ours.frame) != _SAME_FRAME.get(theirs.frame, theirs.frame):
        return "frame"
    return None if abs(ours.z - theirs.z) <= _HEIGHT_TOLERANCE_M else "altitude"


def _difference(ours: MissionItem, theirs: MissionItem, rules: MissionRules) -> str | None:
    if ours.command != theirs.command:
        return "command"
    kept = rules.kept_params.get(ours.command, frozenset(range(4)))
    for index in sorted(kept):
        is_yaw = index == _YAW and ours.command in _YAW_COMMANDS
        if not _same_param(ours.params[index], theirs.params[index], is_yaw, rules.keeps_nan):
            return f"param{index + 1}"
    if ours.command in _PLACELESS:
        return None
    if _SAME_FRAME.get(ours.frame, ours.frame) != _SAME_FRAME.get(theirs.frame, theirs.frame):
        return "frame"
    if ours.x or ours.y:  # 0, 0 is "where you are": some put a place there
        where = _place_difference(ours, theirs)
        if where is not None:
            return where
    if not abs(ours.z - theirs.z) <= _HEIGHT_TOLERANCE_M:
        return "height"
    return None


def _place_difference(ours: MissionItem, theirs: MissionItem) -> str | None:
    if abs(ours.x - theirs.x) > _DEGREES_1E7_TOLERANCE:
        return "latitude"
    return "longitude" if abs(ours.y - theirs.y) > _DEGREES_1E7_TOLERANCE else None


def _same_param(ours: float, theirs: float, is_yaw: bool, keeps_nan: bool) -> bool:
    if math.isnan(ours):
        return math.isnan(theirs) or not keeps_nan
    if is_yaw:
        return abs(math.remainder(ours - theirs, 360.0)) < 1e-3
    return math.isclose(ours, theirs, rel_tol=_RELATIVE_TOLERANCE, abs_tol=1e-6)


_ACK_SIZE = 4
_CURRENT_SIZE = 6


def opaque_id(ack: Message) -> int | None:
    """Return MISSION_ACK's number for what is stored now; None where there is none."""
    return _extension(ack, _ACK_SIZE) or None


def mission_id(current: Message) -> int:
    """Return MISSION_CURRENT's number for the stored mission; 0 where there is none."""
    return _extension(current, _CURRENT_SIZE)


def fence_id(current: Message) -> int:
    """Return MISSION_CURRENT's number for the stored fence; 0 where there is none."""
    return _extension(current, _CURRENT_SIZE + 4)


def rally_id(current: Message) -> int:
    """Return MISSION_CURRENT's number for the stored rally points; 0 where there is none."""
    return _extension(current, _CURRENT_SIZE + 8)


def _extension(message: Message, size: int) -> int:
    """Return the uint32 behind the fields that the dialect knows; truncated zeros are 0."""
    frame = bytes(message.get_msgbuf() or b"")
    if frame[:1] != b"\xfd":
        return 0
    payload = frame[10 : 10 + frame[1]]
    return int.from_bytes(payload[size : size + 4], "little")
