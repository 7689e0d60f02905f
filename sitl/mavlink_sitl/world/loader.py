"""Worlds from YAML files, held to `world.schema.json`; one sentence for what is wrong."""

from __future__ import annotations

import json
import math
from collections.abc import Hashable, Iterable
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema
import yaml

from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.world.model import (
    GpsQuality,
    Ground,
    Mark,
    MarkCamera,
    MoverPath,
    Obstacle,
    RangeSensor,
    Wind,
    World,
    wind_from,
)

_KEYS = {
    "cylinder": ({"radius_m"}, {"at_m", "path"}),
    "box": ({"size_m"}, {"at_m", "path", "yaw_deg"}),
    "wall": ({"from_m", "to_m"}, {"thickness_m"}),
}
"""By kind of obstacle: the keys that it needs and those that it may have"""
_ALWAYS = {"kind", "name", "height_m", "bottom_m"}


class WorldError(ValueError):
    """A world cannot be; one sentence with the place in the file and what is wrong there."""


class _Loader(yaml.SafeLoader):
    """Rejects a key that is given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key, _ in node.value:
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value!r} is given twice", problem_mark=key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


@cache
def schema() -> dict[str, Any]:
    """The JSON Schema of a world."""
    text = resources.files("mavlink_sitl.world").joinpath("world.schema.json").read_text("utf-8")
    return dict(json.loads(text))


def load_world(path: str | Path) -> World:
    """Read a world from a file.

    Raises:
        WorldError: it cannot be read, or is no world.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise WorldError(f"cannot read the world {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise WorldError(f"the world {path} is not text in UTF-8") from None
    return parse_world(text, str(path))


def parse_world(text: str, name: str = "world") -> World:
    """Read a world from YAML.

    Raises:
        WorldError: it is no world.
    """
    try:
        node = yaml.compose(text, Loader=_Loader)
        data = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{name}:{mark.line + 1}" if mark else name
        raise WorldError(f"{where}: {error.problem or error.context}") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else "nested too deeply"
        raise WorldError(f"{name}: {reason}") from None
    data = {} if data is None else data
    try:
        _check(data)
        return _world(data)
    except _WrongError as wrong:
        line = _line(node, wrong.path)
        raise WorldError(f"{name}:{line}: {_key(wrong.path)}{wrong.reason}") from None


class _WrongError(ValueError):
    def __init__(self, path: list[str | int], reason: str) -> None:
        super().__init__(reason)
        self.path = path
        self.reason = reason


def _key(path: list[str | int]) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return f"{text.lstrip('.')}: " if text else ""


def _line(node: yaml.Node | None, path: list[str | int]) -> int:
    """The line of a key or item; of the nearest thing around it when it is missing."""
    line = 0 if node is None else int(node.start_mark.line)
    for part in path:
        if isinstance(node, yaml.MappingNode):
            found = [(k, v) for k, v in node.value if k.value == part]
            if not found:
                break
            line, node = found[0][0].start_mark.line, found[0][1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int):
            node = node.value[part]
            line = node.start_mark.line
    return line + 1


def _check(data: object) -> None:
    validator = jsonschema.Draft202012Validator(schema())
    error = jsonschema.exceptions.best_match(validator.iter_errors(data))
    if error is not None:
        path = list(error.absolute_path)
        if error.validator == "additionalProperties" and isinstance(error.instance, dict):
            known = error.schema["properties"]
            extra = next(key for key in error.instance if key not in known)
            raise _WrongError([*path, extra], f"is unknown; known are: {', '.join(known)}")
        raise _WrongError(
            path, error.message if len(error.message) < 120 else "has an invalid value"
        )
    _check_finite(data, [])


def _check_finite(data: object, path: list[str | int]) -> None:
    """YAML knows .nan and .inf, and a schema's limits let NaN through."""
    if isinstance(data, float) and not math.isfinite(data):
        raise _WrongError(path, f"must be a finite number, not {data}")
    pairs: Iterable[tuple[Any, object]] = ()
    if isinstance(data, (dict, list)):
        pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        _check_finite(value, [*path, key])


def _world(data: dict[str, Any]) -> World:
    wind = data.get("wind", {})
    steady = wind_from(
        wind.get("speed_m_s", 0.0), wind.get("from_deg", 0.0), wind.get("up_m_s", 0.0)
    )
    ground = _ground(data.get("ground", {}))
    obstacles = [_obstacle(item, i) for i, item in enumerate(data.get("obstacles", []))]
    sensor, mark = data.get("range_sensor"), data.get("mark")
    return World(
        name=data.get("name", "world"),
        origin=GeoPoint(**data["origin"]) if "origin" in data else None,
        ground=ground,
        wind=Wind(steady.velocity_ned_m_s, wind.get("gust_m_s", 0.0), wind.get("gust_time_s", 2.0)),
        obstacles=tuple(obstacles),
        gps=GpsQuality(**data.get("gps", {})),
        range_sensor=None if sensor is None and not obstacles else RangeSensor(**(sensor or {})),
        mark=None if mark is None else Mark(tuple(mark["at_m"]), mark.get("height_m", 0.0)),
        camera=MarkCamera(**data.get("camera", {})),
    )


def _ground(data: dict[str, Any]) -> Ground:
    grid = data.get("grid")
    if grid is None:
        return Ground(data.get("height_m", 0.0))
    rows = grid["heights_m"]
    for number, row in enumerate(rows):
        if len(row) != len(rows[0]):
            reason = f"has {len(row)} heights where the first row has {len(rows[0])}"
            raise _WrongError(["ground", "grid", "heights_m", number], reason)
    return Ground(
        data.get("height_m", 0.0),
        tuple(grid["corner_m"]),
        grid["spacing_m"],
        tuple(tuple(row) for row in rows),
    )


def _obstacle(data: dict[str, Any], number: int) -> Obstacle:
    here: list[str | int] = ["obstacles", number]
    kind = data["kind"]
    needed, allowed = _KEYS[kind]
    for key in data:
        if key not in needed | allowed | _ALWAYS:
            raise _WrongError([*here, key], f"does not apply to a {kind}")
    for key in sorted(needed - set(data)):
        raise _WrongError(here, f"a {kind} needs {key}")
    if kind != "wall" and ("at_m" in data) == ("path" in data):
        raise _WrongError(here, f"a {kind} needs either at_m or path")
    bottom = data.get("bottom_m", 0.0)
    common = {
        "name": data.get("name", f"{kind} {number + 1}"),
        "bottom_m": bottom,
        "top_m": bottom + data["height_m"],
    }
    if kind == "wall":
        return _wall(data, here, common)
    path = _path(data["path"], here) if "path" in data else None
    at = tuple(data["at_m"]) if path is None else path.points_m[0]
    if kind == "cylinder":
        return Obstacle(at_m=at, radius_m=data["radius_m"], path=path, **common)
    yaw = math.radians(data.get("yaw_deg", 0.0))
    return Obstacle(at_m=at, size_m=tuple(data["size_m"]), yaw_rad=yaw, path=path, **common)


def _wall(data: dict[str, Any], here: list[str | int], common: dict[str, Any]) -> Obstacle:
    (n0, e0), (n1, e1) = data["from_m"], data["to_m"]
    length = math.dist((n0, e0), (n1, e1))
    if length <= 0.0:
        raise _WrongError([*here, "to_m"], "is the same as from_m")
    return Obstacle(
        at_m=((n0 + n1) / 2.0, (e0 + e1) / 2.0),
        size_m=(length, data.get("thickness_m", 0.2)),
        yaw_rad=math.atan2(e1 - e0, n1 - n0),
        **common,
    )


def _path(data: dict[str, Any], here: list[str | int]) -> MoverPath:
    points = tuple((float(n), float(e)) for n, e in data["points_m"])
    if all(point == points[0] for point in points):
        raise _WrongError([*here, "path", "points_m"], "are all the same position")
    turn = data.get("at_the_end", "turn_round") == "turn_round"
    return MoverPath(points, data["speed_m_s"], turn)
