"""Acts that an agent may propose: their bounds, and what they are for people. No I/O."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from navigation_bridge.configuration.checked_values import (
    FLAG,
    InvalidValueError,
    Kind,
    items,
    member,
    number,
    record,
    whole,
)
from navigation_core.geometry import Vector3

__all__ = [
    "ACTS",
    "AgentAct",
    "AgentGoto",
    "AgentLanding",
    "AgentOrbit",
    "AgentReturn",
    "AgentRoute",
    "AgentTakeoff",
    "AgentWaypoint",
]

_HORIZONTAL_M = number(-10_000, 10_000)
_UP_M = number(-100, 500)
_EAST, _NORTH = "m east of the map origin", "m north of the map origin"
_UP = "m above the map origin"
_SPEED_M_S = number(0, 30)
_SPEED = "highest ground speed, m/s; 0 is the server's default"
_AVOID = "whether the path avoids obstacles"
_RADIUS_LEAST_M = 1.0


@dataclass(frozen=True)
class AgentTakeoff:
    """Arm if necessary, and take off."""

    kind: ClassVar[str] = "takeoff"

    height_m: float = member(number(0.5, 120), text="m above the ground")

    @property
    def sentence(self) -> str:
        """For people."""
        return f"arm and take off to {self.height_m:g} m"


@dataclass(frozen=True)
class AgentLanding:
    """Land where the vehicle is."""

    kind: ClassVar[str] = "land"
    sentence: ClassVar[str] = "land where the vehicle is"


@dataclass(frozen=True)
class AgentReturn:
    """Return to the launch point, and land there, in the autopilot's own mode."""

    kind: ClassVar[str] = "return"
    sentence: ClassVar[str] = "return to the launch point"


@dataclass(frozen=True)
class AgentGoto:
    """Fly to a position in the map."""

    kind: ClassVar[str] = "goto"

    x_m: float = member(_HORIZONTAL_M, text=_EAST)
    y_m: float = member(_HORIZONTAL_M, text=_NORTH)
    z_m: float = member(_UP_M, text=_UP)
    speed_m_s: float = member(_SPEED_M_S, text=_SPEED, default=0.0)
    avoid_obstacles: bool = member(FLAG, text=_AVOID, default=True)

    @property
    def sentence(self) -> str:
        """For people."""
        return f"fly to ({self.x_m:g}, {self.y_m:g}, {self.z_m:g}) m{_at(self.speed_m_s)}"


@dataclass(frozen=True)
class AgentWaypoint:
    """A waypoint in the map."""

    x_m: float = member(_HORIZONTAL_M, text=_EAST)
    y_m: float = member(_HORIZONTAL_M, text=_NORTH)
    z_m: float = member(_UP_M, text=_UP)
    hold_s: float = member(number(0, 600), text="hold time, s; 0 flies through", default=0.0)

    @property
    def position_enu_m(self) -> Vector3:
        """East, north and up in the map."""
        return self.x_m, self.y_m, self.z_m


@dataclass(frozen=True)
class AgentRoute:
    """Fly a route of waypoints."""

    kind: ClassVar[str] = "route"

    waypoints: tuple[AgentWaypoint, ...] = member(items(record(AgentWaypoint), 1, 100))
    speed_m_s: float = member(_SPEED_M_S, text=_SPEED, default=0.0)
    laps: int = member(whole(1, 100), default=1)
    avoid_obstacles: bool = member(FLAG, text=_AVOID, default=True)

    @property
    def sentence(self) -> str:
        """For people."""
        points = ", ".join(f"({w.x_m:g}, {w.y_m:g}, {w.z_m:g})" for w in self.waypoints[:5])
        more = ", ..." if len(self.waypoints) > 5 else ""
        laps = f", {self.laps} laps" if self.laps > 1 else ""
        return f"fly {len(self.waypoints)} waypoints: {points}{more} m{laps}{_at(self.speed_m_s)}"


@dataclass(frozen=True)
class AgentOrbit:
    """Fly a circle around a position in the map."""

    kind: ClassVar[str] = "orbit"

    x_m: float = member(_HORIZONTAL_M, text=_EAST)
    y_m: float = member(_HORIZONTAL_M, text=_NORTH)
    height_m: float = member(number(0.5, 500), text="m above the ground")
    radius_m: float = member(number(-1000, 1000), text="m, at least 1; negative flies clockwise")
    laps: int = member(whole(1, 100), default=1)
    speed_m_s: float = member(_SPEED_M_S, text=_SPEED, default=0.0)
    avoid_obstacles: bool = member(FLAG, text=_AVOID, default=True)

    def __post_init__(self) -> None:
        """Check the radius."""
        if abs(self.radius_m) < _RADIUS_LEAST_M:
            raise InvalidValueError("must be at least 1, or at most -1.", "radius_m")

    @property
    def sentence(self) -> str:
        """For people."""
        return (
            f"circle of {self.radius_m:g} m around ({self.x_m:g}, {self.y_m:g}) m at "
            f"{self.height_m:g} m, {self.laps} laps{_at(self.speed_m_s)}"
        )


def _at(speed_m_s: float) -> str:
    return f", at most {speed_m_s:g} m/s" if speed_m_s else ""


AgentAct: TypeAlias = (
    AgentTakeoff | AgentLanding | AgentReturn | AgentGoto | AgentRoute | AgentOrbit
)
ACTS: Mapping[str, Kind[AgentAct]] = {
    kind.kind: record(kind)
    for kind in (AgentTakeoff, AgentLanding, AgentReturn, AgentGoto, AgentRoute, AgentOrbit)
}
"""How the arguments of each are read, with their JSON Schema"""
