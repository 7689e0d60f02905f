"""The file of expected differences, `differences.yaml`, and the comparison with it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import jsonschema
import yaml

from comparison.compared_states import ASPECTS, Difference
from comparison.motion import why_position_is_not_compared
from comparison.replay import Conversation

ANY = object()
FOR_INFORMATION = "text"
"""The aspect whose unlisted differences are reported and do not count"""


@dataclass(frozen=True)
class ExpectedDifference:
    """One line of the file.

    Attributes:
        aspect: key of `ASPECTS`.
        what: as a difference has it.
        recorded: the same; `ANY` where the line does not say.
        simulated: the same.
        recordings: names of the recordings in which it was seen.
        everywhere: whether it is meant in all others, too.
        reason: why it is meant.
    """

    aspect: str
    what: str
    recorded: Any
    simulated: Any
    recordings: tuple[str, ...]
    everywhere: bool
    reason: str

    def covers(self, difference: Difference, name: str) -> bool:
        """Whether it speaks of a difference in a recording."""
        return (
            (self.aspect, self.what) == (difference.aspect, difference.what)
            and self.recorded in (ANY, difference.recorded)
            and self.simulated in (ANY, difference.simulated)
            and (self.everywhere or name in self.recordings)
        )

    def __str__(self) -> str:
        """As a line of the file."""
        sides = [
            f"{word} {value or 'nothing'}"
            for word, value in (("recorded", self.recorded), ("simulated", self.simulated))
            if value is not ANY
        ]
        return ", ".join([f"{self.aspect} {self.what}", *sides])


@dataclass(frozen=True)
class SetUp:
    """Facts about a vehicle that its recording does not contain."""

    parameters: Mapping[str, float]
    excluded: bool
    reason: str


@dataclass(frozen=True)
class ComparisonVerdict:
    """A comparison, judged.

    Attributes:
        meant: differences with their lines of the file, by aspect.
        unlisted: those without, by aspect.
        not_compared: why an aspect was not compared, by aspect.
    """

    meant: Mapping[str, list[tuple[Difference, ExpectedDifference]]]
    unlisted: Mapping[str, list[Difference]]
    not_compared: Mapping[str, str]

    @property
    def equal(self) -> bool:
        """Whether nothing differs that is not meant to."""
        return not any(v for aspect, v in self.unlisted.items() if aspect != FOR_INFORMATION)


@cache
def document() -> dict[str, Any]:
    """The file, held to its schema."""
    here = resources.files("comparison")
    loaded = yaml.safe_load(here.joinpath("differences.yaml").read_text("utf-8"))
    jsonschema.validate(loaded, schema())
    return dict(loaded)


@cache
def schema() -> dict[str, Any]:
    """The JSON Schema of the file."""
    here = resources.files("comparison")
    return dict(json.loads(here.joinpath("differences.schema.json").read_text("utf-8")))


@cache
def lines() -> tuple[ExpectedDifference, ...]:
    """The file's differences."""
    return tuple(
        ExpectedDifference(
            line["aspect"],
            line["what"],
            line.get("recorded", ANY),
            line.get("simulated", ANY),
            tuple(line["recordings"]),
            line.get("everywhere", False),
            line["reason"],
        )
        for line in document()["differences"]
    )


def plain_name(stem: str) -> str:
    """The name of a recording in the file: without firmware in front and link behind."""
    return stem.removeprefix("px4_").removesuffix("_api")


def set_up(name: str) -> SetUp | None:
    """The entry of a recording in the file, or None."""
    entry = document()["recordings"].get(name)
    if entry is None:
        return None
    return SetUp(entry.get("parameters", {}), entry.get("excluded", False), entry["reason"])


def judge(flight: Conversation, name: str) -> ComparisonVerdict:
    """Compare a conversation in all aspects, and hold the differences against the file."""
    meant: dict[str, list[tuple[Difference, ExpectedDifference]]] = {}
    unlisted: dict[str, list[Difference]] = {}
    for aspect, (_, search) in ASPECTS.items():
        meant[aspect], unlisted[aspect] = [], []
        for difference in search(flight):
            line = next((line for line in lines() if line.covers(difference, name)), None)
            if line is None:
                unlisted[aspect].append(difference)
            else:
                meant[aspect].append((difference, line))
    position = why_position_is_not_compared(flight)
    return ComparisonVerdict(meant, unlisted, {"position": position} if position else {})


def stale(name: str, verdicts: Sequence[ComparisonVerdict]) -> list[ExpectedDifference]:
    """Lines for a recording that nothing was found for, in any of its vehicles."""
    used = [line for v in verdicts for found in v.meant.values() for _, line in found]
    return [line for line in lines() if name in line.recordings and line not in used]
