"""Messages of a page, checked before anything else reads them. No I/O, no clock.

Each message is a JSON object with `type`, the members of its kind and nothing else.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from navigation_core.geometry import Vector3

__all__ = [
    "Alive",
    "Cancel",
    "ConvertMission",
    "Give",
    "Hold",
    "Message",
    "Pace",
    "PageCommand",
    "PageGoal",
    "PageWaypoint",
    "ReadPlan",
    "Rehearse",
    "RejectedError",
    "Replay",
    "SavePlan",
    "Take",
    "parse",
]  # fmt: skip

SIZE_MAX_BYTES = 1_000_000
WAYPOINTS_MAX = 500
_DISTANCE_MAX_M = 1e6
_SPEED_MAX_M_S = 100.0
_HEIGHT_MAX_M = 10_000.0
_HOLD_MAX_S = 3600.0
_LAPS_MAX = 100
_NAME_MAX = 200
_COUNT_MAX = 1_000_000_000
COMMANDS = ("takeoff", "land", "return", "pause", "resume")
MISSION_FORMS = ("route", "file")
REPLAYS = ("start", "pause", "resume", "speed", "seek")
_REPLAY_SPEED_MAX = 100.0
_REPLAY_MAX_S = 1e7
# Braking needs no confirmation.
UNCONFIRMED = ("pause",)


class RejectedError(ValueError):
    """A message is rejected; the text says why."""


@dataclass(frozen=True)
class PageWaypoint:
    """A waypoint in the vehicle's map: ENU metres; hold time in s, 0 to fly through."""

    position_enu_m: Vector3
    hold_time_s: float


@dataclass(frozen=True)
class Alive:
    """The page is there."""

    kind: ClassVar[str] = "alive"


@dataclass(frozen=True)
class _ForVehicle:
    """A message about a vehicle, by its name."""

    vehicle: str


@dataclass(frozen=True)
class Take(_ForVehicle):
    """Ask for control; `over`: from the page that has it."""

    kind: ClassVar[str] = "take"

    over: bool


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
    """One of COMMANDS; height above ground in m for a take-off, 0 for the server's default."""

    kind: ClassVar[str] = "command"

    name: str
    height_m: float


@dataclass(frozen=True)
class _Order(_ForVehicle):
    """A point, or a route; speed 0 is the server's default."""

    waypoints: tuple[PageWaypoint, ...]
    speed_m_s: float
    laps: int
    avoid_obstacles: bool


class PageGoal(_Order):
    """Go to a point, or follow a route."""

    kind: ClassVar[str] = "fly"


@dataclass(frozen=True)
class Rehearse(_Order):
    """Simulate a goal or a route; moves nothing. `number` comes back with the answer."""

    kind: ClassVar[str] = "rehearse"

    number: int


@dataclass(frozen=True)
class ReadPlan(_ForVehicle):
    """Convert a `.plan` file into waypoints of the vehicle's map."""

    kind: ClassVar[str] = "read_plan"

    text: str


@dataclass(frozen=True)
class SavePlan(_ForVehicle):
    """Convert waypoints of the vehicle's map into a `.plan` file."""

    kind: ClassVar[str] = "save_plan"

    waypoints: tuple[PageWaypoint, ...]


@dataclass(frozen=True)
class ConvertMission(_ForVehicle):
    """Convert the mission in the vehicle into one of MISSION_FORMS."""

    kind: ClassVar[str] = "mission"

    form: str


@dataclass(frozen=True)
class Replay(_ForVehicle):
    """Play a recording in the vehicle's place: one of REPLAYS.

    `value` is for "speed" a factor of real time, for "seek" seconds from the start.
    """

    kind: ClassVar[str] = "replay"

    name: str
    value: float


Message: TypeAlias = (
    Alive | Take | Give | Hold | Cancel | PageCommand | PageGoal | Rehearse | ReadPlan | SavePlan
    | ConvertMission | Replay
)  # fmt: skip


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
        document = json.loads(data, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise RejectedError("The message is not JSON.") from None
    if not isinstance(document, dict):
        raise RejectedError("A message is an object.")
    kind = document.pop("type", None)
    reader = _READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise RejectedError("The message has no known type.")
    members = _Members(document)
    message = reader(members)
    members.finish()
    return message


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is not JSON.")


class _Members:
    """Members of a message; each is taken once, and none may be left."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    def take(self, name: str) -> Any:
        if name not in self._document:
            raise RejectedError(f"{name} is missing.")
        return self._document.pop(name)

    def finish(self) -> None:
        if self._document:
            raise RejectedError("The message has unknown members.")

    def text(self, name: str, length_max: int) -> str:
        value = self.take(name)
        if not isinstance(value, str) or len(value) > length_max:
            raise RejectedError(f"{name} is not text of at most {length_max} characters.")
        return value

    def flag(self, name: str) -> bool:
        value = self.take(name)
        if not isinstance(value, bool):
            raise RejectedError(f"{name} is neither true nor false.")
        return value

    def number(self, name: str, low: float, high: float) -> float:
        value = self.take(name)
        # Compared before it becomes a float, which some integers cannot.
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not low <= value <= high or not math.isfinite(value):
            raise RejectedError(f"{name} is not a number from {low:g} to {high:g}.")
        return float(value)

    def count(self, name: str, high: int) -> int:
        value = self.number(name, 1, high)
        if value != int(value):
            raise RejectedError(f"{name} is not a whole number.")
        return int(value)

    def vehicle(self) -> str:
        return self.text("vehicle", _NAME_MAX)

    def confirmed(self) -> None:
        """Require that a person slid, or held the space bar: a click alone starts nothing."""
        if self.take("confirmed") not in ("slide", "held"):
            raise RejectedError("This must be confirmed by a slide, or by holding the space bar.")

    def waypoints(self) -> tuple[PageWaypoint, ...]:
        value = self.take("waypoints")
        if not isinstance(value, list) or not 1 <= len(value) <= WAYPOINTS_MAX:
            raise RejectedError(f"waypoints is not a list of 1 to {WAYPOINTS_MAX}.")
        return tuple(_waypoint(each) for each in value)

    def order(self) -> tuple[str, tuple[PageWaypoint, ...], float, int, bool]:
        """Return the vehicle, its waypoints, speed and laps, and whether to avoid obstacles."""
        return (
            self.vehicle(),
            self.waypoints(),
            self.number("speed", 0.0, _SPEED_MAX_M_S),
            self.count("laps", _LAPS_MAX),
            self.flag("avoid"),
        )


def _waypoint(value: Any) -> PageWaypoint:
    if not isinstance(value, dict):
        raise RejectedError("A waypoint is an object.")
    members = _Members(value)
    x, y, z = (members.number(axis, -_DISTANCE_MAX_M, _DISTANCE_MAX_M) for axis in "xyz")
    waypoint = PageWaypoint((x, y, z), members.number("hold", 0.0, _HOLD_MAX_S))
    members.finish()
    return waypoint


def _command(members: _Members) -> PageCommand:
    name = members.text("name", _NAME_MAX)
    if name not in COMMANDS:
        raise RejectedError("name is not a known command.")
    if name not in UNCONFIRMED:
        members.confirmed()
    height_m = members.number("height", 0.0, _HEIGHT_MAX_M) if name == "takeoff" else 0.0
    return PageCommand(members.vehicle(), name, height_m)


def _fly(members: _Members) -> PageGoal:
    members.confirmed()
    return PageGoal(*members.order())


def _rehearse(members: _Members) -> Rehearse:
    return Rehearse(*members.order(), members.count("number", _COUNT_MAX))


def _mission(members: _Members) -> ConvertMission:
    form = members.text("form", _NAME_MAX)
    if form not in MISSION_FORMS:
        raise RejectedError("form is neither route nor file.")
    return ConvertMission(members.vehicle(), form)


def _replay(members: _Members) -> Replay:
    name = members.text("name", _NAME_MAX)
    if name not in REPLAYS:
        raise RejectedError("name is not a known replay command.")
    value = 0.0
    if name == "speed":
        value = members.number("speed", 0.1, _REPLAY_SPEED_MAX)
    elif name == "seek":
        value = members.number("position", 0.0, _REPLAY_MAX_S)
    return Replay(members.vehicle(), name, value)


_READERS: dict[str, Callable[[_Members], Message]] = {
    Alive.kind: lambda _members: Alive(),
    Take.kind: lambda members: Take(members.vehicle(), members.flag("over")),
    Give.kind: lambda members: Give(members.vehicle()),
    Hold.kind: lambda members: Hold(members.vehicle()),
    Cancel.kind: lambda members: Cancel(members.vehicle()),
    PageCommand.kind: _command,
    PageGoal.kind: _fly,
    Rehearse.kind: _rehearse,
    Replay.kind: _replay,
    ConvertMission.kind: _mission,
    ReadPlan.kind: lambda members: ReadPlan(
        members.vehicle(), members.text("text", SIZE_MAX_BYTES)
    ),
    SavePlan.kind: lambda members: SavePlan(members.vehicle(), members.waypoints()),
}


class Pace:
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
