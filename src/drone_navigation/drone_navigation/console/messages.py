"""Messages of a page, checked before anything else reads them. No I/O, no clock.

Each message is a JSON object with `type`, the members of its kind and nothing else.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn, TypeAlias

from drone_navigation.console.acts.page_acts import ACTS_MAX, PAGE_ACT, PageAct
from navigation_bridge.configuration.checked_values import (
    FLAG,
    TEXT,
    InvalidValueError,
    Kind,
    RecordMember,
    either,
    items,
    maybe,
    member,
    number,
    one_of,
    record,
    text,
    whole,
)
from navigation_core.geometry import Vector3

__all__ = [
    "Alive",
    "Cancel",
    "ConvertMission",
    "Give",
    "Hold",
    "Message",
    "PageCamera",
    "PageCommand",
    "PageFollow",
    "PageGoal",
    "PagePhoto",
    "PagePoint",
    "PageWaypoint",
    "PlanSurvey",
    "RateLimit",
    "ReadPlan",
    "Rehearse",
    "RehearseTogether",
    "RejectedError",
    "Replay",
    "SavePlan",
    "Take",
    "VehicleMessage",
    "VehicleRoute",
    "parse",
]  # fmt: skip

SIZE_MAX_BYTES = 1_000_000
WAYPOINTS_MAX = 500
TOGETHER_MAX = 32
_VEHICLE = text(200)
_CONFIRMED = {"confirmed": either("slide", "held")}
"""A person slid, or held the space bar: a click alone starts nothing"""
_COORDINATE_M = RecordMember(number(-1e6, 1e6), required=True)


class RejectedError(ValueError):
    """A message is rejected; the text says why."""


@dataclass(frozen=True)
class PageWaypoint:
    """A waypoint in the vehicle's map: ENU metres; hold time in s, 0 to fly through; its acts."""

    position_enu_m: Vector3
    hold_time_s: float
    acts: tuple[PageAct, ...] = ()


_WAYPOINTS = items(
    record(
        lambda x, y, z, hold, acts=(): PageWaypoint((x, y, z), hold, acts),
        x=_COORDINATE_M,
        y=_COORDINATE_M,
        z=_COORDINATE_M,
        hold=RecordMember(number(0, 3600), required=True),
        acts=RecordMember(items(PAGE_ACT, 0, ACTS_MAX)),
    ),
    1,
    WAYPOINTS_MAX,
)

_CORNERS = items(record(lambda x, y: (x, y), x=_COORDINATE_M, y=_COORDINATE_M), 3, WAYPOINTS_MAX)

_HOLES_MAX = 50


@dataclass(frozen=True)
class PageCamera:
    """A camera that looks straight down, the width of its sensor across the lines of a survey.

    Overlaps are shares of a picture.
    """

    sensor_width_mm: float = member(number(0, 1000, exclusive=True), "width")
    sensor_height_mm: float = member(number(0, 1000, exclusive=True), "height")
    focal_length_mm: float = member(number(0, 10_000, exclusive=True), "focal")
    side_overlap: float = member(number(0, 0.98), "side")
    front_overlap: float = member(number(0, 0.98), "front")


_OFFSET_M = number(-1000, 1000)
_SYSTEMS = {str(system) for system in range(1, 256)}


@dataclass(frozen=True)
class Alive:
    """The page is there."""

    kind: ClassVar[str] = "alive"


@dataclass(frozen=True)
class _ForVehicle:
    """A message about a vehicle, by its name."""

    vehicle: str = member(_VEHICLE)


@dataclass(frozen=True)
class Take(_ForVehicle):
    """Ask for control; `over`: from the page that has it."""

    kind: ClassVar[str] = "take"

    over: bool = member(FLAG)


class Give(_ForVehicle):
    """Give control away."""

    kind: ClassVar[str] = "give"


class Hold(_ForVehicle):
    """End the goal and hold. Open to every page."""

    kind: ClassVar[str] = "hold"


class Cancel(_ForVehicle):
    """Cancel all goals, whoever sent them. Open to every page."""

    kind: ClassVar[str] = "cancel"


@dataclass(frozen=True)
class PageCommand(_ForVehicle):
    """A command; height above ground in m for a take-off, 0 for the server's default.

    A landing has the topic of a target, "" for none, whether the vehicle holds without it, and how
    often it searches again.
    """

    kind: ClassVar[str] = "command"

    name: str = member(TEXT)
    height_m: float = 0.0
    target_topic: str = ""
    target_required: bool = False
    retries: int = 0


@dataclass(frozen=True)
class _Order(_ForVehicle):
    """A point, a route, or a circle; speed 0 is the server's default.

    A radius other than 0 is that of a circle around a single waypoint; negative flies it clockwise.
    """

    waypoints: tuple[PageWaypoint, ...] = member(_WAYPOINTS)
    speed_m_s: float = member(number(0, 100), "speed")
    laps: int = member(whole(1, 100))
    avoid_obstacles: bool = member(FLAG, "avoid")
    radius_m: float = member(number(-1000, 1000), "radius")

    def __post_init__(self) -> None:
        """Reject a circle around several waypoints.

        Raises:
            InvalidValueError: it is one.
        """
        if self.radius_m and len(self.waypoints) > 1:
            raise InvalidValueError("A circle goes around one waypoint.")


@dataclass(frozen=True)
class PageGoal(_Order):
    """Go to a point, follow a route, or fly a circle.

    A vehicle that follows a route may turn on and on meanwhile, positive to the right.
    """

    kind: ClassVar[str] = "fly"

    turn_deg_s: float = member(number(-180, 180), "turn", default=0.0)

    def __post_init__(self) -> None:
        """Reject a circle that turns.

        Raises:
            InvalidValueError: it does.
        """
        super().__post_init__()
        if self.radius_m and self.turn_deg_s:
            raise InvalidValueError("A circle is flown with its nose to the centre.")


@dataclass(frozen=True)
class PageFollow(_ForVehicle):
    """Follow a target of a topic, a frame of TF or a MAVLink system, by its name or number.

    The place beside it is ahead, left of and above the target, or in the map to the east, to the
    north and above; a least distance of 0 and a speed of 0 are the server's defaults.
    """

    kind: ClassVar[str] = "follow"

    source: str = member(either("topic", "frame", "system"))
    target: str = member(text(200))
    ahead_m: float = member(_OFFSET_M, "ahead")
    left_m: float = member(_OFFSET_M, "left")
    above_m: float = member(_OFFSET_M, "above")
    least_distance_m: float = member(number(0, 1000), "least")
    speed_m_s: float = member(number(0, 100), "speed")
    in_map: bool = member(FLAG)

    def __post_init__(self) -> None:
        """Reject a target without a name.

        Raises:
            InvalidValueError: it has none, or no number from 1 to 255 for a MAVLink system.
        """
        if not self.target.strip():
            raise InvalidValueError("A target to follow needs its topic, frame or system.")
        if self.source == "system" and self.target not in _SYSTEMS:
            raise InvalidValueError("A MAVLink system is a number from 1 to 255.")


class PagePhoto(_ForVehicle):
    """Take a photo."""

    kind: ClassVar[str] = "photo"


@dataclass(frozen=True)
class PagePoint(_ForVehicle):
    """Point the gimbal at a position of the vehicle's map."""

    kind: ClassVar[str] = "point"

    east_m: float = member(number(-1e6, 1e6), "x")
    north_m: float = member(number(-1e6, 1e6), "y")
    up_m: float = member(number(-1e6, 1e6), "z")


@dataclass(frozen=True)
class Rehearse(_Order):
    """Simulate a goal or a route; moves nothing. `number` comes back with the answer."""

    kind: ClassVar[str] = "rehearse"

    number: int = member(whole(1, 1_000_000_000))


class VehicleRoute(_Order):
    """A goal or a route of one of several vehicles."""


@dataclass(frozen=True)
class RehearseTogether:
    """Simulate goals and routes of several vehicles that begin at once; moves nothing.

    `number` comes back with the answer.
    """

    kind: ClassVar[str] = "rehearse_together"

    routes: tuple[VehicleRoute, ...] = member(items(record(VehicleRoute), 1, TOGETHER_MAX))
    number: int = member(whole(1, 1_000_000_000))


@dataclass(frozen=True)
class ReadPlan(_ForVehicle):
    """Convert a `.plan` file into waypoints of the vehicle's map."""

    kind: ClassVar[str] = "read_plan"

    text: str = member(text(SIZE_MAX_BYTES))


@dataclass(frozen=True)
class PlanSurvey(_ForVehicle):
    """Compute lines over an area of the vehicle's map, which the page then draws; moves nothing.

    Holes are left out. Speed 0 is the server's default, and a spacing of 0 that of the camera.
    """

    kind: ClassVar[str] = "survey"

    corners_enu_m: tuple[tuple[float, float], ...] = member(_CORNERS, "corners")
    height_m: float = member(number(-1e4, 1e4), "height")
    spacing_m: float = member(number(0, 1e4), "spacing")
    speed_m_s: float = member(number(0, 100), "speed")
    holes_enu_m: tuple[tuple[tuple[float, float], ...], ...] = member(
        items(_CORNERS, 0, _HOLES_MAX), "holes"
    )
    camera: PageCamera | None = member(maybe(record(PageCamera)))

    def __post_init__(self) -> None:
        """Reject lines whose distance nothing says.

        Raises:
            InvalidValueError: there is neither a distance nor a camera.
        """
        if self.spacing_m == 0.0 and self.camera is None:
            raise InvalidValueError("A survey needs a distance of its lines, or a camera.")


@dataclass(frozen=True)
class SavePlan(_ForVehicle):
    """Convert waypoints of the vehicle's map into a `.plan` file."""

    kind: ClassVar[str] = "save_plan"

    waypoints: tuple[PageWaypoint, ...] = member(_WAYPOINTS)


@dataclass(frozen=True)
class ConvertMission(_ForVehicle):
    """Convert the mission in the vehicle into a route, or a file."""

    kind: ClassVar[str] = "mission"

    form: str = member(either("route", "file"))


@dataclass(frozen=True)
class Replay(_ForVehicle):
    """Play a recording in the vehicle's place.

    `value` is for "speed" a factor of real time, for "seek" seconds from the start.
    """

    kind: ClassVar[str] = "replay"

    name: str = member(TEXT)
    value: float = 0.0


VehicleMessage: TypeAlias = (
    Take | Give | Hold | Cancel | PageCommand | PageGoal | PageFollow | PagePhoto | PagePoint
    | Rehearse | ReadPlan | SavePlan | ConvertMission | PlanSurvey | Replay
)  # fmt: skip
Message: TypeAlias = Alive | RehearseTogether | VehicleMessage


def _named(kind: type, name: str, confirmed: bool = False, **members: Any) -> dict[str, Kind[Any]]:
    return {name: record(kind, _CONFIRMED if confirmed else {}, {"name": name}, **members)}


_HEIGHT_M = RecordMember(number(0, 10_000), required=True, name="height")
_LANDING = {
    "target_topic": RecordMember(text(200), required=True, name="target"),
    "target_required": RecordMember(FLAG, required=True, name="required"),
    "retries": RecordMember(whole(0, 255), required=True),
}
_SPEED = RecordMember(number(0.1, 100), required=True, name="speed")
_POSITION_S = RecordMember(number(0, 1e7), required=True, name="position")
MESSAGE: Kind[Message] = one_of(
    "type",
    {
        Alive.kind: record(Alive),
        Take.kind: record(Take),
        Give.kind: record(Give),
        Hold.kind: record(Hold),
        Cancel.kind: record(Cancel),
        PageCommand.kind: one_of(
            "name",
            _named(PageCommand, "takeoff", confirmed=True, height_m=_HEIGHT_M)
            | _named(PageCommand, "land", confirmed=True, **_LANDING)
            | _named(PageCommand, "return", confirmed=True)
            | _named(PageCommand, "resume", confirmed=True)
            | _named(PageCommand, "continue", confirmed=True)
            # Braking needs no confirmation.
            | _named(PageCommand, "pause"),
        ),
        PageGoal.kind: record(PageGoal, _CONFIRMED),
        PageFollow.kind: record(PageFollow, _CONFIRMED),
        # These move no vehicle.
        PagePhoto.kind: record(PagePhoto),
        PagePoint.kind: record(PagePoint),
        Rehearse.kind: record(Rehearse),
        RehearseTogether.kind: record(RehearseTogether),
        Replay.kind: one_of(
            "name",
            _named(Replay, "start")
            | _named(Replay, "pause")
            | _named(Replay, "resume")
            | _named(Replay, "speed", value=_SPEED)
            | _named(Replay, "seek", value=_POSITION_S),
        ),
        ConvertMission.kind: record(ConvertMission),
        PlanSurvey.kind: record(PlanSurvey),
        ReadPlan.kind: record(ReadPlan),
        SavePlan.kind: record(SavePlan),
    },
)
"""All messages, by their `type`"""


def parse(data: str | bytes) -> Message:
    """Return the message in a text of the socket.

    Raises:
        RejectedError: it is not one.
    """
    if isinstance(data, bytes):
        raise RejectedError("A message is text.")
    if len(data) > SIZE_MAX_BYTES:
        raise RejectedError("The message is too large.")
    try:
        return MESSAGE.read(json.loads(data, parse_constant=_no_constant))
    except InvalidValueError as error:
        raise RejectedError(str(error)) from None
    except (ValueError, RecursionError):
        raise RejectedError("The message is not JSON.") from None


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON.")


class RateLimit:
    """Limits the messages of a page: a bucket of `burst`, filled at `rate_hz`."""

    def __init__(self, rate_hz: float, burst: float, now: float) -> None:
        """Start full, at a time in s."""
        self._rate_hz = rate_hz
        self._burst = burst
        self._left = burst
        self._seen_s = now

    def allows(self, now: float) -> bool:
        """Return whether one more is within the limit, at a time in s."""
        self._left = min(self._burst, self._left + self._rate_hz * (now - self._seen_s))
        self._seen_s = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
