"""Known obstacles from a YAML file that follows `obstacles.schema.json`. No ROS."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from navigation_bridge.configuration.checked_yaml import hold, load_yaml
from navigation_bridge.configuration.text_files import read_text
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle

__all__ = ["KnownObstacles", "ObstaclesError", "parse_obstacles", "read_obstacles"]

_MAP, _WGS84 = "map", "wgs84"
_PLACES = {"cylinder": ("at",), "box": ("at",), "wall": ("from", "to")}
_UNITS = {_MAP: "m", _WGS84: "deg"}
_THICKNESS_M = 0.2
_Point = tuple[float, float]
ToMap = Callable[[tuple[float, float, float]], tuple[float, float, float]]


class ObstaclesError(ValueError):
    """An obstacle file is invalid; the message says where and why."""


@dataclass(frozen=True)
class KnownObstacles:
    """Content of a file.

    Attributes:
        frame: frame of its positions: "map" or "wgs84".
        items: its obstacles as written, validated.
    """

    frame: str = _MAP
    items: tuple[Mapping[str, Any], ...] = ()

    @property
    def needs_origin(self) -> bool:
        """True if the obstacles can be placed only with a known map origin."""
        return self.frame == _WGS84 and bool(self.items)

    def placed(self, to_map: ToMap) -> tuple[KnownObstacle, ...]:
        """Return them in the map frame.

        Args:
            to_map: converts latitude, longitude (degrees) and altitude (m) into ENU metres.
        """

        def place(point: list[float]) -> _Point:
            if self.frame == _MAP:
                return float(point[0]), float(point[1])
            east_m, north_m, _ = to_map((point[0], point[1], 0.0))
            return east_m, north_m

        unit = _UNITS[self.frame]
        return tuple(_obstacle(item, i, unit, place) for i, item in enumerate(self.items))


def _obstacle(
    item: Mapping[str, Any], index: int, unit: str, place: Callable[[list[float]], _Point]
) -> KnownObstacle:
    kind, bottom_m = item["kind"], float(item.get("bottom_m", 0.0))
    name, top_m = item.get("name", f"{kind} {index + 1}"), bottom_m + float(item["height_m"])
    if kind == "cylinder":
        return Cylinder(name, place(item[f"at_{unit}"]), float(item["radius_m"]), bottom_m, top_m)
    if kind == "box":
        length, width = (float(side) for side in item["size_m"])
        yaw = math.radians(item.get("yaw_deg", 0.0))
        return Box(name, place(item[f"at_{unit}"]), (length, width), yaw, bottom_m, top_m)
    (x0, y0), (x1, y1) = place(item[f"from_{unit}"]), place(item[f"to_{unit}"])
    size_m = math.dist((x0, y0), (x1, y1)), float(item.get("thickness_m", _THICKNESS_M))
    middle, yaw = ((x0 + x1) / 2.0, (y0 + y1) / 2.0), math.atan2(y1 - y0, x1 - x0)
    return Box(name, middle, size_m, yaw, bottom_m, top_m)


def read_obstacles(path: Path) -> KnownObstacles:
    """Read an obstacle file.

    Raises:
        ObstaclesError: it cannot be read, or does not match the schema.
    """
    text = read_text(path, ObstaclesError)
    return parse_obstacles(text, str(path))


def parse_obstacles(text: str, name: str) -> KnownObstacles:
    """Read obstacles from YAML.

    Args:
        text: the YAML.
        name: name of the file, for messages.

    Raises:
        ObstaclesError: it is not YAML, or does not match the schema.
    """
    data = load_yaml(text, name, ObstaclesError)
    outside = {**data, "obstacles": []} if isinstance(data, dict) else data
    if isinstance(data, dict) and not isinstance(data.get("obstacles"), list):
        outside = data
    hold(outside, schema(), name, ObstaclesError)
    frame = data.get("frame", _MAP)
    for index, item in enumerate(data["obstacles"]):
        _check(item, frame, f"{name}: obstacles[{index}]")
    return KnownObstacles(frame, tuple(data["obstacles"]))


@cache
def schema() -> dict[str, Any]:
    """Return the JSON Schema of an obstacle file."""
    file = Path(__file__).with_name("obstacles.schema.json")
    return dict(json.loads(file.read_text("utf-8")))


def _check(item: object, frame: str, where: str) -> None:
    kind = item.get("kind") if isinstance(item, dict) else None
    if not isinstance(item, dict) or kind not in _PLACES:
        raise ObstaclesError(f"{where}: kind is missing; give one of {', '.join(_PLACES)}.")
    title = f"{where} ({item.get('name', kind)})"
    hold(item, {**schema()["$defs"][kind], "$defs": schema()["$defs"]}, title, ObstaclesError)
    unit, other = _UNITS[frame], _UNITS[_MAP if frame == _WGS84 else _WGS84]
    for place in _PLACES[kind]:
        if f"{place}_{other}" in item:
            raise ObstaclesError(
                f"{title}: {place}_{other} does not fit frame: {frame}; use {place}_{unit}."
            )
        if f"{place}_{unit}" not in item:
            raise ObstaclesError(f"{title}: {place}_{unit} is missing; a {kind} needs it.")
    _check_finite(item, title)
    if kind == "wall" and item[f"from_{unit}"] == item[f"to_{unit}"]:
        raise ObstaclesError(f"{title}: start and end are the same point.")


def _check_finite(item: Mapping[str, Any], where: str) -> None:
    """Reject .nan and .inf of YAML; a schema's limits accept NaN."""
    for key, value in item.items():
        for number in value if isinstance(value, list) else [value]:
            if isinstance(number, float) and not math.isfinite(number):
                raise ObstaclesError(f"{where}: {key} must be a finite number, not {number}.")
