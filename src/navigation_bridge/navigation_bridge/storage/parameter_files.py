"""Parameter files of QGroundControl (`.params`) and MAVProxy (`.parm`). No ROS.

`.params`: vehicle id, component id, name, value and MAV_PARAM_TYPE, separated by tabs
(https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html). `.parm`:
name and value, separated by blanks (MAVProxy) or a comma (Mission Planner). `#` begins a comment.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import Parameter
from navigation_bridge.configuration.text_files import read_text

QGROUNDCONTROL, MAVPROXY = ".params", ".parm"
_SUFFIXES = {QGROUNDCONTROL: QGROUNDCONTROL, MAVPROXY: MAVPROXY, ".param": MAVPROXY}
NAME = re.compile("[A-Za-z0-9_]{1,16}")
_AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1
_REAL32 = mavlink.MAV_PARAM_TYPE_REAL32


class ParameterFileError(ValueError):
    """A file holds no parameters, or cannot be read; the message names the line and the reason."""


@dataclass(frozen=True)
class VehicleParameterFile:
    """Content of a file.

    Attributes:
        values: values by name, in the order of the file.
        notes: sentences about what was left out.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()


def format_of(path: Path) -> str:
    """Return `QGROUNDCONTROL` or `MAVPROXY`, by the end of the name.

    Raises:
        ParameterFileError: it ends in another way.
    """
    kind = _SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise ParameterFileError(
            f"{path}: give a name that ends in .params (QGroundControl) or .parm (MAVProxy)."
        )
    return kind


def text_of(parameters: Iterable[Parameter], kind: str, vehicle_id: int, title: str) -> str:
    """Return the content of a file; a value that is not a finite number is only a comment.

    Args:
        parameters: in the order of the file.
        kind: QGROUNDCONTROL or MAVPROXY.
        vehicle_id: MAVLink system id, for QGroundControl's.
        title: a line of comment.
    """
    found = list(parameters)
    parameters = [p for p in found if math.isfinite(p.value)]
    lines = [f"# {title}", "#"]
    lines += [f"# {p.name} is {p.value}" for p in found if not math.isfinite(p.value)]
    if kind == QGROUNDCONTROL:
        lines.append("# Vehicle-Id Component-Id Name Value Type")
        lines += [
            f"{vehicle_id}\t{_AUTOPILOT}\t{p.name}\t{_number(p)}\t{p.type}" for p in parameters
        ]
    else:
        lines += [f"{p.name:<16} {_number(p)}" for p in parameters]
    return "\n".join(lines) + "\n"


def _number(parameter: Parameter) -> str:
    """Return a value in as many digits as it takes to read the same float of 32 bits again."""
    if parameter.type != _REAL32 and parameter.value == int(parameter.value):
        return str(int(parameter.value))
    return f"{parameter.value:.9g}"


def write_parameters(path: Path, text: str) -> None:
    """Write a file as a whole; a failure leaves the one that was there.

    Raises:
        ParameterFileError: it could not be written.
    """
    new = path.with_name(f".{path.name}.new")
    try:
        new.write_text(text, encoding="utf-8")
        new.replace(path)
    except OSError as error:
        with suppress(OSError):
            new.unlink(missing_ok=True)
        raise ParameterFileError(f"{path}: {error.strerror or error}.") from None


def read_parameters(path: Path) -> VehicleParameterFile:
    """Read a file of either format; which it is, each line shows.

    Raises:
        ParameterFileError: it is not one, or a line is not a parameter.
    """
    text = read_text(path, ParameterFileError, "utf-8-sig")
    try:
        return parse_parameters(text)
    except ParameterFileError as error:
        raise ParameterFileError(f"{path}: {error}") from None


def parse_parameters(text: str) -> VehicleParameterFile:
    """Return the parameters of a file's text.

    Raises:
        ParameterFileError: it has none, or a line is not a parameter.
    """
    values: dict[str, float] = {}
    others = 0
    for number, cells in _rows(text):
        if len(cells) not in (2, 5):
            raise ParameterFileError(
                f"line {number}: {len(cells)} columns; 'name value' or QGroundControl's five are "
                "expected."
            )
        is_row = len(cells) == 5
        if is_row and cells[1] != str(_AUTOPILOT):
            others += 1
            continue
        name, written = (cells[2], cells[3]) if is_row else (cells[0], cells[1])
        if NAME.fullmatch(name) is None:
            raise ParameterFileError(f"line {number}: {name[:40]!r} is not a parameter's name.")
        value = _value(written)
        if value is None:
            raise ParameterFileError(
                f"line {number}: the value of {name}, {written[:40]!r}, is not a finite number."
            )
        if values.get(name, value) != value:
            raise ParameterFileError(f"line {number}: {name} has two values.")
        values[name] = value
    if not values:
        raise ParameterFileError("it contains no parameters of the autopilot.")
    notes = (f"{others} parameters of other components are left out.",) if others else ()
    return VehicleParameterFile(values, notes)


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.split("#", 1)[0].strip()
        if content:
            yield number, re.split(r"[\s,]+", content)


def _value(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
