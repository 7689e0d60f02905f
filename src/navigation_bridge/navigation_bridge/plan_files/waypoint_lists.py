"""`QGC WPL` text files: one item a line. No ROS.

Format: https://mavlink.io/en/file_formats/#mission_plain_text_file. Ground stations agree on the
first row of version 110: it is the planned home, whatever its frame and command. Version 120, of
QGroundControl for PX4, has no such row. The rows are flown in the order of the file; their numbers
do not decide (QGroundControl, Mission Planner and MAVProxy number them again).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from navigation_bridge.plan_files.items import PlanError, PlanItem, decimal

_HEADER = ["QGC", "WPL"]
_WITH_HOME, _WITHOUT_HOME = "110", "120"
_COLUMNS = 12


@dataclass(frozen=True)
class WaypointRows:
    """Content of a file.

    Attributes:
        home: the first row where the version has the planned home there; None otherwise.
        items: the other rows, in order.
        notes: sentences about what is unusual.
    """

    home: PlanItem | None
    items: tuple[PlanItem, ...]
    notes: tuple[str, ...] = ()


def content_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines with their numbers from 1, without comments, blanks and empty lines."""
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.split("#", 1)[0].strip()
        if content:
            yield number, content


def is_waypoint_list(text: str) -> bool:
    """Return whether a text begins like a `QGC WPL` file, of whatever version."""
    _, first = next(content_lines(text), (1, ""))
    return first.split()[:2] == _HEADER


def parse_waypoint_rows(text: str, *, home_first: bool = True) -> WaypointRows:
    """Return the rows of a file's text.

    Args:
        text: of the file.
        home_first: whether the first row of version 110 must have number 0. Lists
            without home (fences of MAVProxy) begin with any number.

    Raises:
        PlanError: it is not such a file, or a line is not a row.
    """
    lines = content_lines(text)
    number, first = next(lines, (1, ""))
    version = _version(first, number)
    items: list[PlanItem] = []
    notes: list[str] = []
    last = -1
    for number, line in lines:
        index, item = _row(line, f"line {number}")
        if not items and version == _WITH_HOME and home_first and index != 0:
            raise PlanError(
                f"{item.where}: the first row has number {index}, but version 110 has the planned "
                "home there, with number 0; add this row, or write QGC WPL 120 for a file without "
                "it."
            )
        if index <= last and not notes:
            notes.append(
                f"{item.where}: number {index} comes after {last}; rows are flown in the order of "
                "the file."
            )
        last = index
        items.append(item)
    if version == _WITHOUT_HOME or not items:
        return WaypointRows(None, tuple(items), tuple(notes))
    return WaypointRows(items[0], tuple(items[1:]), tuple(notes))


def _version(line: str, number: int) -> str:
    words = line.split()
    if words[:2] == _HEADER and len(words) == 3 and words[2] in (_WITH_HOME, _WITHOUT_HOME):
        return words[2]
    if words[:2] == _HEADER:
        version = " ".join(words[2:]) or "missing"
        raise PlanError(
            f"line {number}: version {version[:20]} is not supported; open the file in Mission "
            "Planner or QGroundControl and save it again."
        )
    if len(words) == _COLUMNS:
        raise PlanError(
            f"line {number}: a waypoint file must begin with 'QGC WPL 110'; add this line, or "
            "'QGC WPL 120' if the first row is not the planned home."
        )
    raise PlanError(
        f"line {number}: this is neither a .plan of QGroundControl nor a file that begins with "
        "'QGC WPL 110'."
    )


def _row(line: str, where: str) -> tuple[int, PlanItem]:
    """Return the number of a row and its item."""
    cells = line.split()
    if len(cells) != _COLUMNS:
        raise PlanError(f"{where}: {len(cells)} columns instead of {_COLUMNS}.")
    index = _integer(cells[0], where, "the row's number")
    frame = _integer(cells[2], where, "the frame")
    command = _integer(cells[3], where, "the command")
    params = tuple(
        decimal(cell, where, f"param {number}") for number, cell in enumerate(cells[4:11], start=1)
    )
    continues = _integer(cells[11], where, "autocontinue") != 0
    return index, PlanItem(where, command, frame, params, continues)


def _integer(cell: str, where: str, what: str) -> int:
    number = decimal(cell, where, what)
    if not number.is_integer():
        raise PlanError(f"{where}: {what}, {cell[:40]!r}, is not an integer.")
    return int(number)
