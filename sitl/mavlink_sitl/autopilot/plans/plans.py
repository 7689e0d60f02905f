"""The uploaded mission, fence and rally points of one vehicle.

Storage that outlives a reboot, as the parameters do. The rules of the transfer are
`mavlink.mission_transfer`'s, of flying it `autopilot.auto`'s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from mavlink_sitl.geodesy import GeoPoint, LocalFrame

AMSL_FRAMES = (0, 2, 5)


class PlanType(IntEnum):
    """The numbers are MAV_MISSION_TYPE's."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


class Cmd(IntEnum):
    """The items that do something here; the numbers are MAV_CMD's."""

    WAYPOINT = 16
    LOITER_UNLIM = 17
    LOITER_TURNS = 18
    LOITER_TIME = 19
    RTL = 20
    LAND = 21
    TAKEOFF = 22
    LOITER_TO_ALT = 31
    SPLINE = 82
    VTOL_TAKEOFF = 84
    VTOL_LAND = 85
    GUIDED_ENABLE = 92
    DELAY = 93
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    JUMP = 177
    CHANGE_SPEED = 178
    SET_HOME = 179
    SET_SERVO = 183
    LAND_START = 189
    SET_REVERSE = 194
    SET_ROI_LOCATION = 195
    SET_ROI_NONE = 197
    SET_ROI = 201
    DIGICAM_CONTROL = 203
    MOUNT_CONTROL = 205
    TRIGGER_DISTANCE = 206
    FENCE_ENABLE = 207
    GRIPPER = 211
    AUX_FUNCTION = 218
    GUIDED_LIMITS = 222
    JUMP_TAG = 600
    DO_JUMP_TAG = 601
    GIMBAL_PITCHYAW = 1000
    GIMBAL_CONFIGURE = 1001
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    FENCE_RETURN_POINT = 5000
    POLYGON_INCLUSION = 5001
    POLYGON_EXCLUSION = 5002
    CIRCLE_INCLUSION = 5003
    CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100


@dataclass(frozen=True)
class PlanItem:
    """One item as MISSION_ITEM_INT has it.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: param1..param4.
        x: latitude, 1e7 degrees.
        y: longitude, 1e7 degrees.
        z: altitude in the frame, metres.
        autocontinue: as sent.
    """

    command: int
    frame: int = 3
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    x: int = 0
    y: int = 0
    z: float = 0.0
    autocontinue: int = 1

    @property
    def has_place(self) -> bool:
        """Whether it names a place; zeros name none."""
        return bool(self.x or self.y)

    @property
    def is_amsl(self) -> bool:
        """Whether its altitude counts from sea level, not from home."""
        return self.frame in AMSL_FRAMES

    def level_m(self, frame: LocalFrame) -> tuple[float, float]:
        """Its place in a local frame, north and east."""
        return frame.to_local(GeoPoint(self.x / 1e7, self.y / 1e7, 0.0))[:2]


class MissionState(IntEnum):
    """The numbers are MISSION_STATE's."""

    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


@dataclass
class Plan:
    """One list of items.

    Attributes:
        items: in the order of their sequence numbers.
        identity: what MISSION_CURRENT and opaque_id say; 0 for none.
        changes: grows with every change.
    """

    items: list[PlanItem] = field(default_factory=list)
    identity: int = 0
    changes: int = 0

    def replace(self, items: list[PlanItem], identity: int = 0) -> None:
        """Put another list in its place."""
        self.items = items
        self.identity = identity
        self.changes += 1

    def put(self, place: int, item: PlanItem) -> None:
        """Put an item into its place, at most one beyond the end."""
        self.items[place : place + 1] = [item]
        self.changes += 1


@dataclass
class Plans:
    """All that is stored.

    Attributes:
        mission: the list of AUTO. With ArduPilot item 0 is home, whatever was sent.
        fence: inclusion and exclusion areas.
        rally: where RTL may go instead of home.
        current: sequence number of the mission's item in force.
        state: of the mission, once there is one.
        jumps: how often each DO_JUMP has been taken.
        begins: the current item as it was set, and the next item to fly to at that time.
    """

    mission: Plan = field(default_factory=Plan)
    fence: Plan = field(default_factory=Plan)
    rally: Plan = field(default_factory=Plan)
    current: int = 0
    state: MissionState = MissionState.NOT_STARTED
    jumps: dict[int, int] = field(default_factory=dict)
    begins: tuple[int, int] = (0, 0)

    def of(self, plan_type: int) -> Plan:
        """The list of a type."""
        return (self.mission, self.fence, self.rally)[plan_type]

    def place_of_tag(self, tag: int) -> int | None:
        """Where the mission's first JUMP_TAG of a number is; item 0 is home, and none."""
        for place, item in enumerate(self.mission.items):
            if place and item.command == Cmd.JUMP_TAG and item.params[0] == tag:
                return place
        return None

    @property
    def first_to_do(self) -> int:
        """Where the mission continues: at the current item, or with what comes before it."""
        begin, current = self.begins
        return begin if current == self.current else self.current

    def rewind(self) -> None:
        """Restart at the first item next time, as after disarming."""
        self.current = 0
        self.begins = (0, 0)
        self.jumps.clear()

    def keep_place(self, current: int | None) -> None:
        """Another mission begins at the item marked as current, or at the old one's number.

        A shorter one at its last item. So it was seen of PX4, in flight; on the ground disarming
        has gone back to the beginning.
        """
        place = self.current if current is None else current
        self.forget_progress()
        self.current = max(min(place, len(self.mission.items) - 1), 0)

    def forget_progress(self) -> None:
        """Another mission: nothing of it has been flown."""
        self.rewind()
        self.state = MissionState.NOT_STARTED
