"""Goals that follow the first one: from ``--update`` and from the keyboard."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from navigation_core.geometry import Vector3

_UPDATE = re.compile(r"\s*t\s*=\s*([^:\s]+)\s*:(.*)", re.DOTALL)


class UpdateError(ValueError):
    """An update is malformed; the text says why."""


@dataclass(frozen=True)
class Update:
    """A goal to send later.

    Attributes:
        at_s: when, in seconds after the first goal was accepted.
        position_m: where to, in the frame of ``--frame``.
    """

    at_s: float
    position_m: Vector3


def parse_point(text: str) -> Vector3:
    """Return the three numbers of "5 5 2" or "5, 5, 2".

    Raises:
        UpdateError: they are not three finite numbers.
    """
    words = text.replace(",", " ").split()
    if len(words) != 3:
        raise UpdateError(f"'{text.strip()}' is not a point; give three numbers: x y z.")
    x, y, z = (_number(word) for word in words)
    return x, y, z


def parse_update(text: str) -> Update:
    """Return the update of "t=8: 5 5 2".

    Raises:
        UpdateError: it does not read like that.
    """
    match = _UPDATE.fullmatch(text)
    if match is None:
        raise UpdateError(f"'{text}' is not an update; write it like \"t=8: 5 5 2\".")
    at_s = _number(match[1].removesuffix("s"))
    if at_s < 0.0:
        raise UpdateError(f"'{text}': seconds after acceptance must not be negative.")
    return Update(at_s, parse_point(match[2]))


def _number(word: str) -> float:
    try:
        number = float(word)
    except ValueError:
        raise UpdateError(f"'{word}' is not a number.") from None
    if not math.isfinite(number):
        raise UpdateError(f"'{word}' is not a finite number.")
    return number
