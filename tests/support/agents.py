"""Calls of an agent that means no good, or nothing at all."""

from __future__ import annotations

import random
from collections.abc import Iterator

from drone_navigation.agents.acts import ACTS
from drone_navigation.agents.tool_calls import tools

NAMES = [tool.name for tool in tools()]
WORDS = (
    "", "yes", "confirm", "navigation_mcp confirm", "../../etc/passwd", "'; DROP TABLE", "\x00",
    "agent-000000-1", "planner-000000-1", "true", "NaN", "🚁" * 50, "a" * 5000,
)  # fmt: skip
NUMBERS = (0, -1, 1, 1e308, -1e308, 10**400, 3.5, 5, 0.5, 120, 121, 2, 4)


def hostile_calls(rng: random.Random, count: int, ids: list[str]) -> Iterator[tuple[str, object]]:
    """Give names of tools and arguments.

    Args:
        rng: seeded.
        count: how many.
        ids: of proposals, which the caller may extend meanwhile.
    """
    for _ in range(count):
        name = rng.choice([*NAMES, *ACTS, *ACTS, "confirm", "arm", "fly", "proposals/confirm", ""])
        if name == "hold":
            continue  # holds by itself, and is the one thing that an agent may do
        if rng.random() < 0.7 and name in ACTS:
            yield name, _valid(rng, name)
        else:
            yield name, _anything(rng, ids)


def _valid(rng: random.Random, name: str) -> dict[str, object]:
    """Return arguments that the schema takes."""
    x, y, z = rng.uniform(-40, 40), rng.uniform(-40, 40), rng.uniform(2, 15)
    point = {"x_m": x, "y_m": y, "z_m": z}
    found: dict[str, dict[str, object]] = {
        "takeoff": {"height_m": z},
        "land": {},
        "return": {},
        "goto": {**point, "speed_m_s": rng.choice([0, 2, 30])},
        "route": {"waypoints": [point] * rng.randint(1, 4), "laps": rng.randint(1, 3)},
        "orbit": {"x_m": x, "y_m": y, "height_m": z, "radius_m": rng.choice([-5, 8])},
    }
    return found[name]


def _anything(rng: random.Random, ids: list[str], depth: int = 0) -> object:
    """Return something that JSON can hold, sometimes with members that tools know."""
    kind = rng.randrange(7)
    if kind == 0 or depth > 4:
        return rng.choice([*WORDS, *ids[-5:]])
    if kind == 1:
        return rng.choice(NUMBERS)
    if kind == 2:
        return rng.choice([None, True, False])
    if kind == 3:
        return [_anything(rng, ids, depth + 1) for _ in range(rng.randrange(4))]
    known = ("x_m", "y_m", "z_m", "height_m", "radius_m", "waypoints", "id", "wait_s", "verb", "by",
             "confirmed", "released_by", "state", "__class__")  # fmt: skip
    members = rng.sample(known, rng.randrange(4))
    return {name: _anything(rng, ids, depth + 1) for name in members}
