"""Parameter files of QGroundControl (`.params`) and MAVProxy (`.parm`). No ROS.

`.params`: vehicle id, component id, name, value and MAV_PARAM_TYPE, separated by tabs
(https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html). `.parm`:
name and value, separated by blanks (MAVProxy), a comma (Mission Planner) or an equals sign
(AP_Param.cpp). A value may be hexadecimal. `#` begins a comment. The defaults of ArduPilot's boards
have `@READONLY` after a value, and `@include FILE`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from flight_logs.whole_file import whole_file
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import Parameter
from navigation_bridge.configuration.text_files import read_text
from navigation_bridge.plan_files.waypoint_lists import content_lines

QGROUNDCONTROL, MAVPROXY = ".params", ".parm"
_SUFFIXES = {QGROUNDCONTROL: QGROUNDCONTROL, MAVPROXY: MAVPROXY, ".param": MAVPROXY}
NAME = re.compile("[A-Za-z0-9_]{1,16}")
_DECIMAL = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_HEXADECIMAL = re.compile(r"[-+]?0[xX][0-9a-fA-F]+")
_HEXADECIMAL_MAX = 20
_READ_ONLY, _INCLUDE = "@READONLY", "@include"
# One file may be included by several others, but not endlessly.
_FILES_MAX = 50
_AUTOPILOT = mavlink.MAV_COMP_ID_AUTOPILOT1


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
        lines += [f"{vehicle_id}\t{_AUTOPILOT}\t{p.name}\t{p.text}\t{p.type}" for p in parameters]
    else:
        lines += [f"{p.name:<16} {p.text}" for p in parameters]
    return "\n".join(lines) + "\n"


def write_parameters(path: Path, text: str) -> None:
    """Write a file as a whole; a failure leaves the one that was there.

    Raises:
        ParameterFileError: it could not be written.
    """
    try:
        with whole_file(path) as draft:
            draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ParameterFileError(f"{path}: {error.strerror or error}.") from None


def read_parameters(path: Path) -> VehicleParameterFile:
    """Read a file of either format; which it is, each line shows.

    A file that it includes must be in its folder or below.

    Raises:
        ParameterFileError: it is not one, or a line is not a parameter.
    """
    reading = _Reading(path.resolve().parent)
    reading.add_file(path)
    return reading.result(path)


@dataclass
class _Reading:
    """Parameters of a file and of those that it includes.

    Attributes:
        folder: those included must be in it or below.
        values: by name.
        others: rows about other components.
        read_only: names with @READONLY.
        opened: files that are being read, outermost first.
        files: how many were read.
    """

    folder: Path
    values: dict[str, float] = field(default_factory=dict)
    others: int = 0
    read_only: set[str] = field(default_factory=set)
    opened: list[Path] = field(default_factory=list)
    files: int = 0

    def result(self, path: Path) -> VehicleParameterFile:
        """Return all that was read from a file."""
        if not self.values:
            raise ParameterFileError(f"{path}: it contains no parameters of the autopilot.")
        notes = []
        if self.others:
            notes.append(f"{self.others} parameters of other components are left out.")
        if self.read_only:
            notes.append(
                f"{len(self.read_only)} parameters are marked {_READ_ONLY}; the autopilot may deny "
                "them."
            )
        return VehicleParameterFile(self.values, tuple(notes))

    def add_file(self, path: Path) -> None:
        """Read a file; its values replace those read before."""
        self.files += 1
        if self.files > _FILES_MAX:
            raise ParameterFileError(f"{path}: more than {_FILES_MAX} files are included.")
        text = read_text(path, ParameterFileError, "utf-8-sig")
        self.opened.append(path.resolve())
        try:
            self._add_text(text, path)
        except _LineError as error:
            raise ParameterFileError(f"{path}: {error}") from None
        self.opened.pop()

    def _add_text(self, text: str, path: Path) -> None:
        """Read a file's text; `path` is its file."""
        own: dict[str, float] = {}
        for number, cells in _rows(text):
            if cells[0] == _INCLUDE:
                self.add_file(self._included(cells[1:], path, f"line {number}"))
            else:
                self._add_row(cells, own, f"line {number}")

    def _included(self, names: list[str], path: Path, where: str) -> Path:
        if len(names) != 1:
            raise _LineError(f"{where}: {_INCLUDE} needs the name of one file.")
        included = path.parent / names[0]
        real = included.resolve()
        if not real.is_relative_to(self.folder):
            raise _LineError(
                f"{where}: {names[0]!r} is outside of the folder of the file, {self.folder}; copy "
                "it there, or load it by itself first."
            )
        if real in self.opened:
            raise _LineError(f"{where}: {names[0]!r} includes itself.")
        return included

    def _add_row(self, cells: list[str], own: dict[str, float], where: str) -> None:
        is_marked = len(cells) == 3 and cells[2] == _READ_ONLY
        if len(cells) not in (2, 5) and not is_marked:
            raise _LineError(
                f"{where}: {len(cells)} columns; 'name value' or QGroundControl's five are "
                "expected."
            )
        is_row = len(cells) == 5
        if is_row and cells[1] != str(_AUTOPILOT):
            self.others += 1
            return
        name, written = (cells[2], cells[3]) if is_row else (cells[0], cells[1])
        if NAME.fullmatch(name) is None:
            raise _LineError(f"{where}: {name[:40]!r} is not a parameter's name.")
        value = _value(written)
        if value is None:
            raise _LineError(
                f"{where}: the value of {name}, {written[:40]!r}, is not a finite number."
            )
        if own.setdefault(name, value) != value:
            raise _LineError(f"{where}: {name} has two values.")
        self.values[name] = value
        if is_marked:
            self.read_only.add(name)


class _LineError(ParameterFileError):
    """A line of a file cannot be used; the name of the file is still missing."""


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    for number, content in content_lines(text):
        if content.startswith(_INCLUDE):
            yield number, content.split()
        else:
            yield number, [cell for cell in re.split(r"[\s,=]+", content) if cell]


def _value(text: str) -> float | None:
    if _HEXADECIMAL.fullmatch(text) is not None:
        value = float(int(text, 16)) if len(text) <= _HEXADECIMAL_MAX else math.inf
    elif _DECIMAL.fullmatch(text) is not None:
        value = float(text)
    else:
        return None
    return value if math.isfinite(value) else None
