"""Messages that no page of the console sends: noise, and good ones with one thing wrong."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from typing import Any

WAYPOINT = {"x": 5.0, "y": 1.0, "z": 4.0, "hold": 0.0}
FLY = {
    "type": "fly",
    "vehicle": "/",
    "confirmed": "slide",
    "waypoints": [WAYPOINT],
    "speed": 0.0,
    "laps": 1,
    "avoid": False,
    "radius": 0.0,
}
FOLLOW = {
    "type": "follow",
    "vehicle": "/",
    "confirmed": "held",
    "source": "topic",
    "target": "/target/pose",
    "ahead": -10.0,
    "left": 0.0,
    "above": 5.0,
    "least": 0.0,
    "in_map": False,
    "speed": 0.0,
}
LAND = {
    "type": "command",
    "vehicle": "/",
    "name": "land",
    "confirmed": "slide",
    "target": "/target/pose",
    "required": True,
    "retries": 1,
}
MOVING: tuple[dict[str, Any], ...] = (
    FLY,
    FOLLOW,
    {"type": "command", "vehicle": "/", "name": "takeoff", "height": 5.0, "confirmed": "held"},
    LAND,
    {"type": "command", "vehicle": "/", "name": "return", "confirmed": "slide"},
    {"type": "command", "vehicle": "/", "name": "resume", "confirmed": "held"},
    {"type": "command", "vehicle": "/", "name": "continue", "confirmed": "slide"},
    {"type": "command", "vehicle": "/", "name": "pause"},
    {"type": "photo", "vehicle": "/"},
    {"type": "point", "vehicle": "/", "x": 4.0, "y": -3.0, "z": 0.0},
)
"""Good messages that need control."""

_ODD: tuple[Any, ...] = (
    None, True, -1, 1e308, -1e308, 10**400, 0.5, "", "NaN", "x" * 300, [], {}, [[]], {"x": 1},
)  # fmt: skip


def broken(seed: int, count: int) -> Iterator[str | bytes]:
    """Yield messages that must all be rejected."""
    rng = random.Random(seed)
    makers = (_noise, _without, _with_more, _with_odd, _cut, _not_json)
    for _ in range(count):
        yield rng.choice(makers)(rng)


def _good(rng: random.Random) -> dict[str, Any]:
    return json.loads(json.dumps(rng.choice(MOVING)))  # type: ignore[no-any-return]


def _noise(rng: random.Random) -> str | bytes:
    noise = rng.randbytes(rng.randrange(200))
    return noise if rng.random() < 0.5 else noise.decode("latin-1")


def _without(rng: random.Random) -> str:
    message = _good(rng)
    del message[rng.choice(list(message))]
    return json.dumps(message)


def _with_more(rng: random.Random) -> str:
    message = _good(rng)
    message[rng.choice(("page", "over", "force", "__proto__", ""))] = rng.choice(_ODD)
    return json.dumps(message)


def _with_odd(rng: random.Random) -> str:
    message = _good(rng)
    if "waypoints" in message and rng.random() < 0.7:
        odd = [value for value in _ODD if value not in (-1, 0.5) or value is True]
        message["waypoints"][0][rng.choice("xyz")] = rng.choice(odd)
    else:
        message["type"] = rng.choice(_ODD)
    return json.dumps(message)


def _cut(rng: random.Random) -> str:
    text = json.dumps(_good(rng))
    return text[: rng.randrange(len(text))]


def _not_json(rng: random.Random) -> str:
    text = json.dumps(_good(rng))
    return rng.choice((text + text, "[" * 100_000, text.replace(":", "=", 1), f"{text}\0", "NaN",
                       json.dumps(FLY).replace("5.0", "NaN"), "9" * 5000))  # fmt: skip
