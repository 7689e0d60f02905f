"""Known obstacles from a YAML file. No ROS."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, TypeAlias

from navigation_bridge.configuration.checked_values import (
    TEXT,
    InvalidValueError,
    either,
    items,
    member,
    number,
    one_of,
    pair,
    record,
)
from navigation_bridge.configuration.checked_yaml import read_yaml
from navigation_bridge.configuration.text_files import read_text
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle

_MAP, _WGS84 = "map", "wgs84"
_UNITS = {_MAP: "m", _WGS84: "deg"}
_Point: TypeAlias = tuple[float, float]
ToMap = Callable[[tuple[float, float, float]], tuple[float, float, float]]
_Place = Callable[[str], _Point]

_SIZE = number(0, 10_000, exclusive=True)
_EAST_NORTH = pair(number(-100_000, 100_000), number(-100_000, 100_000))
_LATITUDE_LONGITUDE = pair(number(-90, 90), number(-180, 180))
_IN_MAP = "East and north of the map origin, in metres."
_GEODETIC = "Latitude and longitude in degrees (WGS-84)."


class ObstaclesError(ValueError):
    """An obstacle file is invalid; the message says where and why."""


@dataclass(frozen=True, kw_only=True)
class _Entry(ABC):
    """An obstacle as written, checked. It gives the positions PLACES in metres or in degrees."""

    KIND: ClassVar[str]
    PLACES: ClassVar[tuple[str, ...]] = ("at",)

    height_m: float = member(_SIZE)
    bottom_m: float = member(number(-1000, 10_000), default=0.0)
    name: str = member(TEXT, default="")

    @property
    def top_m(self) -> float:
        """Height of its top above the origin."""
        return self.bottom_m + self.height_m

    def check(self, frame: str, where: str) -> None:
        """Check that its positions are those of a frame.

        Raises:
            InvalidValueError: they are not.
        """
        unit, other = _UNITS[frame], _UNITS[_MAP if frame == _WGS84 else _WGS84]
        for place in self.PLACES:
            if getattr(self, f"{place}_{other}") is not None:
                problem = f"does not fit frame: {frame}; use {place}_{unit}."
                raise InvalidValueError(problem, f"{where}: {place}_{other}")
            if getattr(self, f"{place}_{unit}") is None:
                problem = f"is missing; a {self.KIND} needs it."
                raise InvalidValueError(problem, f"{where}: {place}_{unit}")

    @abstractmethod
    def placed(self, name: str, place: _Place) -> KnownObstacle:
        """Return the obstacle in the map, with the positions that `place` returns."""


@dataclass(frozen=True, kw_only=True)
class _OnePlaceEntry(_Entry):
    at_m: _Point | None = member(_EAST_NORTH, text=_IN_MAP, default=None)
    at_deg: _Point | None = member(_LATITUDE_LONGITUDE, text=_GEODETIC, default=None)


@dataclass(frozen=True, kw_only=True)
class CylinderEntry(_OnePlaceEntry):
    """A cylinder, by its centre."""

    KIND = "cylinder"

    radius_m: float = member(_SIZE)

    def placed(self, name: str, place: _Place) -> KnownObstacle:
        """Return the cylinder."""
        return Cylinder(name, place("at"), self.radius_m, self.bottom_m, self.top_m)


@dataclass(frozen=True, kw_only=True)
class BoxEntry(_OnePlaceEntry):
    """A box, by its centre."""

    KIND = "box"

    size_m: _Point = member(
        pair(_SIZE, _SIZE), text="Along the obstacle's own x axis (east by default) and y axis."
    )
    yaw_deg: float = member(number(-360, 360), text="Counter-clockwise from east.", default=0.0)

    def placed(self, name: str, place: _Place) -> KnownObstacle:
        """Return the turned box."""
        yaw_rad = math.radians(self.yaw_deg)
        return Box(name, place("at"), self.size_m, yaw_rad, self.bottom_m, self.top_m)


@dataclass(frozen=True, kw_only=True)
class WallEntry(_Entry):
    """A wall, by its ends."""

    KIND = "wall"
    PLACES = ("from", "to")

    from_m: _Point | None = member(_EAST_NORTH, text=_IN_MAP, default=None)
    to_m: _Point | None = member(_EAST_NORTH, text=_IN_MAP, default=None)
    from_deg: _Point | None = member(_LATITUDE_LONGITUDE, text=_GEODETIC, default=None)
    to_deg: _Point | None = member(_LATITUDE_LONGITUDE, text=_GEODETIC, default=None)
    thickness_m: float = member(number(0, 100, exclusive=True), default=0.2)

    def check(self, frame: str, where: str) -> None:
        """Check that it has two ends, too."""
        super().check(frame, where)
        if (self.from_m, self.from_deg) == (self.to_m, self.to_deg):
            raise InvalidValueError("start and end are the same point.", f"{where}:")

    def placed(self, name: str, place: _Place) -> KnownObstacle:
        """Return a box from end to end."""
        (x0, y0), (x1, y1) = place("from"), place("to")
        size_m = math.dist((x0, y0), (x1, y1)), self.thickness_m
        middle, yaw_rad = ((x0 + x1) / 2.0, (y0 + y1) / 2.0), math.atan2(y1 - y0, x1 - x0)
        return Box(name, middle, size_m, yaw_rad, self.bottom_m, self.top_m)


_ENTRIES = {kind.KIND: record(kind) for kind in (CylinderEntry, BoxEntry, WallEntry)}


@dataclass(frozen=True)
class KnownObstacles:
    """Content of a file.

    Attributes:
        frame: frame of its positions: "map" or "wgs84".
        items: its obstacles as written, validated.
    """

    frame: str = member(
        either(_MAP, _WGS84),
        text="map: positions are east and north of the map origin, in metres. "
        "wgs84: latitude and longitude, in degrees.",
        default=_MAP,
    )
    items: tuple[_Entry, ...] = member(
        items(one_of("kind", _ENTRIES, label="name"), most=10_000),
        "obstacles",
        default=(),
        required=True,
    )

    def __post_init__(self) -> None:
        """Check that all positions are in the frame."""
        for index, item in enumerate(self.items):
            item.check(self.frame, f"obstacles[{index}] ({item.name or item.KIND})")

    @property
    def needs_origin(self) -> bool:
        """True if the obstacles can be placed only with a known map origin."""
        return self.frame == _WGS84 and bool(self.items)

    def placed(self, to_map: ToMap) -> tuple[KnownObstacle, ...]:
        """Return them in the map frame.

        Args:
            to_map: converts latitude, longitude (degrees) and altitude (m) into ENU metres.
        """

        def placed(index: int, item: _Entry) -> KnownObstacle:
            def place(name: str) -> _Point:
                first, second = getattr(item, f"{name}_{_UNITS[self.frame]}")
                return (first, second) if self.frame == _MAP else to_map((first, second, 0.0))[:2]

            return item.placed(item.name or f"{item.KIND} {index + 1}", place)

        return tuple(placed(index, item) for index, item in enumerate(self.items))


FILE = record(KnownObstacles)
"""Of an obstacle file"""


def read_obstacles(path: Path) -> KnownObstacles:
    """Read an obstacle file.

    Raises:
        ObstaclesError: it cannot be read, or is no obstacle file.
    """
    return parse_obstacles(read_text(path, ObstaclesError), str(path))


def parse_obstacles(text: str, name: str) -> KnownObstacles:
    """Read obstacles from YAML.

    Args:
        text: the YAML.
        name: name of the file, for messages.

    Raises:
        ObstaclesError: it is not YAML, or no obstacle file.
    """
    return read_yaml(text, name, FILE, ObstaclesError)
