"""The params of each MAV_CMD that a release uses, where it rejects what else is set."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True)
class UsedParams:
    """The numbers, 1 to 7, of the params of one MAV_CMD.

    Attributes:
        of_item: in an item of a mission, a fence or rally points.
        of_command: in a command.
    """

    of_item: frozenset[int]
    of_command: frozenset[int]


@cache
def used_params(release: str) -> dict[int, UsedParams]:
    """Those of a release, by MAV_CMD; empty for a release that rejects none."""
    file = resources.files(__name__).joinpath(f"{release}.txt")
    if not file.is_file():
        return {}
    lines = file.read_text("utf-8").splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    return {int(command): UsedParams(_numbers(item), _numbers(own)) for command, item, own in rows}


def _numbers(digits: str) -> frozenset[int]:
    return frozenset(int(digit) for digit in digits if digit.isdigit())
