"""Items of a plan, as `.plan` and `QGC WPL` files have them. No ROS."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from mavlink_vehicle.codec import mavlink
from navigation_bridge.configuration.text_files import read_text
from navigation_bridge.goals.requests import AltitudeReference

ContentT = TypeVar("ContentT")

FRAME_REFERENCES = {
    mavlink.MAV_FRAME_GLOBAL: AltitudeReference.AMSL,
    mavlink.MAV_FRAME_GLOBAL_INT: AltitudeReference.AMSL,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: AltitudeReference.HOME,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: AltitudeReference.HOME,
    mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT: AltitudeReference.GROUND,
    mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT: AltitudeReference.GROUND,
}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?nan", re.IGNORECASE)


class PlanError(ValueError):
    """A file cannot be used; the message names the item or line and the reason."""


def read_plan_file(path: Path, parse: Callable[[str], ContentT]) -> ContentT:
    """Return what `parse` makes of a file's text.

    Raises:
        PlanError: it cannot be read, or `parse` says so; the message names the file.
    """
    text = read_text(path, PlanError, "utf-8-sig")
    try:
        return parse(text)
    except PlanError as error:
        raise PlanError(f"{path}: {error}") from None


@dataclass(frozen=True)
class PlanItem:
    """One item of a plan.

    Attributes:
        where: "line 3" or "item 2", for sentences.
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: param1 to param7; NaN where there is none.
        autocontinue: whether the vehicle continues with the next item by itself.
    """

    where: str
    command: int
    frame: int
    params: tuple[float, ...]
    autocontinue: bool = True


def command_name(command: int) -> str:
    """Return the name of a MAV_CMD, without its prefix."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    return str(entry.name.removeprefix("MAV_CMD_")) if entry else f"MAV_CMD {command}"


def decimal(cell: str, where: str, what: str) -> float:
    """Return a number of a text file; "nan" is one.

    Args:
        cell: the text.
        where: "line 3", for the sentence.
        what: the name of the number, for the sentence.

    Raises:
        PlanError: it is not a decimal number.
    """
    if _NUMBER.fullmatch(cell) is None:
        advice = "; write a decimal point" if _NUMBER.fullmatch(cell.replace(",", ".")) else ""
        raise PlanError(f"{where}: {what}, {cell[:40]!r}, is not a number{advice}.")
    return float(cell)
