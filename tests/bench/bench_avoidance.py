"""Processor time of the server for a flown second with avoidance, by part.

Bridge and simulated copter in this process, on a simulated clock: a goal through 30 walls and posts
of which the server knows nothing but the scanner's 72 sectors at 15 Hz. The parts are those that
the bridge's own methods take: a step of the engine, the intake of obstacles, searches for a path,
and all other. Time in a part that another one calls counts for the inner one. Simulator, encoding
and decoding, and the ground truth are outside. The reference is the same vehicle in a straight
flight without obstacles.
"""

from __future__ import annotations

import functools
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from mavlink_sitl import RangeSensor, VehicleConfig
from mavlink_sitl import World as SimulatedWorld
from navigation_bridge.bridge import Bridge
from navigation_bridge.engine import Engine
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_core.geometry import subtract
from navigation_core.searches import AtOnce
from tests.bench.rows import NO_GOAL, row
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.world_flights import simulated
from tests.support.worlds.random_worlds import random_world

SEEDS, SHORT_SEEDS = (1, 2, 3), (1,)
OBSTACLES = 30
FLOWN_MAX_S, SHORT_FLOWN_S = 120.0, 3.0
GOAL_MS, INTAKE_GOAL_MS = 30.0, 10.0
PARTS: dict[str, tuple[tuple[type, str], ...]] = {
    "search": ((AtOnce, "begin"),),
    "intake": tuple((ObstacleFeed, name) for name in ("take_ranges", "take_scan", "look")),
    "step": ((Engine, "turn"),),
    "other": (
        (Bridge, "receive"),
        (Bridge, "handle_timer"),
        (Bridge, "messages_to_send"),
        (Bridge, "next_deadline"),
        (Bridge, "next_output"),
    ),
}


class _Shares:
    """The thread's processor time by part: a part that is called by another takes from it."""

    def __init__(self) -> None:
        self.used_s: dict[str, float] = defaultdict(float)
        self._stack: list[str] = []
        self._since_s = 0.0

    def timed(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def call(*arguments: Any, **named: Any) -> Any:
            self._count()
            self._stack.append(part)
            try:
                return method(*arguments, **named)
            finally:
                self._count()
                self._stack.pop()

        return call

    def _count(self) -> None:
        now_s = time.thread_time()
        if self._stack:
            self.used_s[self._stack[-1]] += now_s - self._since_s
        self._since_s = now_s

    @contextmanager
    def counted(self) -> Iterator[None]:
        replaced = [
            (owner, name, part, getattr(owner, name))
            for part, methods in PARTS.items()
            for owner, name in methods
        ]
        for owner, name, part, method in replaced:
            setattr(owner, name, self.timed(part, method))
        try:
            yield
        finally:
            for owner, name, _, method in replaced:
                setattr(owner, name, method)


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Fly with avoidance and without."""
    seeds = SHORT_SEEDS if short else SEEDS
    limit_s = SHORT_FLOWN_S if short else FLOWN_MAX_S
    avoiding, straight = (_flown(seeds, avoids, limit_s) for avoids in (True, False))
    name = "server's processor time for a flown second with avoidance"
    whole_ms, reference = sum(avoiding.values()), ("straight flight", sum(straight.values()))
    yield row(name, (whole_ms, "ms"), reference, f"<= {GOAL_MS:g} ms")
    for part in PARTS:
        bound = f"<= {INTAKE_GOAL_MS:g} ms" if part == "intake" else NO_GOAL
        beside = ("straight flight", straight[part])
        yield row(f"{name}: {part}", (avoiding[part], "ms"), beside, bound)


def _flown(seeds: tuple[int, ...], avoids: bool, limit_s: float) -> dict[str, float]:
    """Return ms of each part for a flown second."""
    used_s, flown_s = dict.fromkeys(PARTS, 0.0), 0.0
    for seed in seeds:
        world, shares = random_world(seed, OBSTACLES), _Shares()
        around = simulated(world, RangeSensor(reach_m=20.0)) if avoids else SimulatedWorld()
        with shares.counted():
            flight = SimulatedFlight(seed, VehicleConfig(ready_after_s=1.0), around).ready()
            flight.fly_up()
            east, north, _ = subtract(world.goal_enu_m, world.start_enu_m)
            target = flight.request(east, north, world.goal_enu_m[2], avoid=avoids)
            begun_s = flight.now
            shares.used_s.clear()
            goal_id = flight.start(target)
            while not flight.ends(goal_id) and flight.now - begun_s < limit_s:
                flight.tick()
        flown_s += flight.now - begun_s
        for part, spent_s in shares.used_s.items():
            used_s[part] += spent_s
    return {part: 1e3 * spent_s / flown_s for part, spent_s in used_s.items()}
