"""The recordings in `data/recordings`, each played to the simulator once per process."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import pytest

from comparison.__main__ import load, play
from comparison.expected_differences import ComparisonVerdict, judge, plain_name
from comparison.motion import track
from comparison.recording import Timed
from comparison.replay import Conversation

DATA = Path(__file__).resolve().parents[1] / "data/recordings"
PATHS = {plain_name(path.stem): path for path in sorted(DATA.glob("*.tlog"))}

Place = tuple[float, float, float]


def of(name: str) -> pytest.MarkDecorator:
    """The mark that keeps all tests of one recording in one process."""
    return pytest.mark.xdist_group(f"recording-{name}")


def each(*names: str) -> list[Any]:
    """Recordings as parameters of a test."""
    return [pytest.param(name, marks=of(name)) for name in names]


@functools.cache
def flights(name: str) -> tuple[Conversation, ...]:
    """One for each vehicle in it."""
    return tuple(play(recording, name, {}) for recording in load(PATHS[name]))


@functools.cache
def verdicts(name: str) -> tuple[ComparisonVerdict, ...]:
    return tuple(judge(flight, name) for flight in flights(name))


def flight(name: str) -> Conversation:
    """Of a recording with one vehicle."""
    (only,) = flights(name)
    return only


def changes(messages: Timed, kind: str, *fields: str) -> list[tuple[float, tuple[int, ...]]]:
    """When which values of a message's fields were seen first."""
    seen: list[tuple[float, tuple[int, ...]]] = []
    for time_s, message in messages:
        if message.get_type() == kind:
            values = tuple(int(getattr(message, field)) for field in fields)
            if not seen or seen[-1][1] != values:
                seen.append((time_s, values))
    return seen


def values(messages: Timed, kind: str, *fields: str) -> list[tuple[int, ...]]:
    """The values that a message's fields went through."""
    return [v for _, v in changes(messages, kind, *fields)]


def texts(messages: Timed) -> list[str]:
    """The text of each STATUSTEXT; chunks of a long text are separate."""
    return [m.text for _, m in messages if m.get_type() == "STATUSTEXT"]


def arrival_s(messages: Timed, target: Place, from_s: float, within_m: float) -> float:
    """Time from a moment until the position is within a distance of a target."""
    for time_s, *position in track(messages):
        if time_s >= from_s and math.dist(position, target) <= within_m:
            return float(time_s) - from_s
    raise AssertionError(f"never within {within_m} m of {target}")
