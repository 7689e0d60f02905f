"""Whole flights through random worlds: bridge and simulated copter, judged by ground truth.

The server knows nothing of a world but what the simulated scanner sees. Worlds have 5 to 200
obstacles, narrow gaps, dead ends, mazes, closed rings about the goal, and up to three obstacles
that move. `python -m tests.bench.bench_worlds --worlds 1000` flies them all; `make bench` flies the
first few, always the same: which worlds are flown must not depend on the machine's load.

A hit is to be nearer to an obstacle than the vehicle's radius. It could have been avoided
unless the obstacle came to a vehicle that had been standing for more than a second and had no
free way out (`tests/support/worlds/ground_truth.py`). There is a path to the goal if one is found
that keeps clear throughout with everything known; if none is found, a fine grid over the true
world has the last word. The reference of a flown path's length is that
of the path that is planned with everything that stands still known from the start.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import multiprocessing
import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mavlink_sitl import BatteryModel, VehicleConfig
from navigation_core.planning import planner
from navigation_core.planning.planner import PlanLimits
from tests.bench.rows import row
from tests.support.flights.world_flights import Flown, fly
from tests.support.worlds.random_worlds import CLEARANCE_M, World, random_world

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / "out" / "bench_worlds.json"
SHORT_REPORT = ROOT / "out" / "bench_worlds_short.json"
ALL_WORLDS = 1000
WORLDS = 24
"""About two minutes on two cores. 20 of them have a path, and 11 of those nothing that moves."""
SHORT_WORLDS, SHORT_OBSTACLES = (3,), 5
MOVERS = (0, 0, 1, 3)
RADIUS_M = 0.5
_HEIGHT_M = 3.0
"""Of the take-off, which is a part of what is flown"""
SUCCESS_GOAL, LENGTH_GOAL = 0.98, 1.5
PARAMETERS: dict[str, float] = {
    "blocked_timeout_s": 10.0,
    "volume_altitude_max_m": 20.0,
    "obstacle_map_size_m": 300.0,
}
"""The largest worlds have walls of 230 m: who forgets what is 40 m away looks for ever"""
VEHICLE = VehicleConfig(ready_after_s=1.0, battery=BatteryModel(capacity_mah=30_000.0))
"""A copter that may look for a path for an hour"""


@dataclass(frozen=True)
class Result:
    """One world and how the flight through it went."""

    seed: int
    kind: str
    obstacles: int
    movers: int
    solvable: bool
    shortest_m: float | None
    flown: Flown
    avoidable_hits: int
    took_s: float


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Fly through the first random worlds."""
    if short:
        return measure(SHORT_WORLDS, SHORT_REPORT, SHORT_OBSTACLES)
    return measure(range(WORLDS), REPORT)


def measure(
    worlds: Sequence[int], report: Path, obstacles: int | None = None
) -> list[dict[str, Any]]:
    """Fly through the worlds of these numbers, and write what came of it to a file."""
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        results = []
        for result in pool.map(partial(fly_one, obstacles=obstacles), worlds):
            results.append(result)
            if len(worlds) > WORLDS:
                _tell(result)
    report.parent.mkdir(parents=True, exist_ok=True)
    report.write_text(json.dumps([asdict(result) for result in results], indent=1) + "\n")
    return _rows(results)


def _tell(result: Result) -> None:
    flown = result.flown
    nearest = flown.nearest.distance_m if flown.nearest else math.inf
    what = f"{result.seed}: {result.kind}, {result.obstacles} obstacles, {result.movers} moving"
    how = f"{flown.code or 'no end'} in {flown.elapsed_s:.0f} s, {flown.replans} replans"
    hits = "".join(f"; hit {hit.obstacle} at {hit.time_s:.1f} s" for hit in flown.hits)
    closed = "" if result.solvable else " (no path)"
    print(
        f"{what}{closed}: {how}, nearest {nearest:.2f} m{hits}; took {result.took_s:.1f} s",
        flush=True,
    )


def make_world(seed: int, obstacles: int | None = None) -> World:
    """Return the world of a number; every second one has something that moves."""
    return random_world(seed, obstacles, movers=MOVERS[seed % len(MOVERS)])


def fly_one(seed: int, obstacles: int | None = None) -> Result:
    """Fly through one world."""
    world, begin_s = make_world(seed, obstacles), time.monotonic()
    flown, _ = fly(world, VEHICLE, PARAMETERS)
    took_s = time.monotonic() - begin_s
    hits = sum(hit.was_avoidable for hit in flown.hits)
    shortest_m = _shortest_m(world)
    return Result(
        seed,
        world.kind,
        len(world.fixed),
        len(world.movers),
        # Whether there is none is for the grid to say, which takes seconds.
        shortest_m is not None or world.solvable,
        shortest_m,
        flown,
        hits,
        took_s,
    )


def _shortest_m(world: World) -> float | None:
    """Return the length of a path with all known, None if none is found; it proves that one is."""
    limits = PlanLimits(CLEARANCE_M)
    path = planner.plan(world.start_enu_m, world.goal_enu_m, world.obstacles, limits)
    if isinstance(path, planner.NoPath):
        return None
    for a, b in itertools.pairwise(path.points_enu_m):
        points = np.linspace(a, b, max(math.ceil(math.dist(a, b) / 0.05), 2))
        if world.obstacles.clearance_m(points).min() < CLEARANCE_M - 1e-6:
            return None
    return path.length_m


def _rows(results: list[Result]) -> list[dict[str, Any]]:
    count = len(results)
    paths = [r for r in results if r.solvable]
    arrived = [r for r in paths if r.flown.code == "SUCCESS"]
    closed = [r for r in results if not r.solvable]
    told = [r for r in closed if r.flown.code == "NO_PATH"]
    hits = sum(r.avoidable_hits for r in results)
    nearest = [r.flown.nearest.distance_m for r in results if r.flown.nearest is not None]
    longer = [
        (r.flown.flown_m - _HEIGHT_M) / r.shortest_m
        for r in arrived
        if r.shortest_m and not r.movers
    ]
    replans = [r.flown.replans for r in arrived]
    unended = sum(not r.flown.code for r in results)
    return [
        row("Avoidable hits in random worlds", (hits, "1"), ("flights", count), "0", hits == 0),
        row(
            "Least distance to a true obstacle in random worlds",
            (min(nearest, default=math.inf), "m"),
            ("radius of the vehicle", RADIUS_M),
            f">= {RADIUS_M:g} m, but for hits that could not be avoided",
            hits == 0,
        ),
        row(
            "Flights that reach the goal where there is a path",
            (len(arrived), "1"),
            ("worlds with a path", len(paths)),
            f">= {SUCCESS_GOAL:g} x",
        ),
        row(
            "Flights that end with NO_PATH where there is none",
            (len(told), "1"),
            ("worlds without a path", len(closed)),
            "all",
            len(told) == len(closed),
        ),
        row(
            "Flights that do not end",
            (unended, "1"),
            ("flights", count),
            "0",
            unended == 0,
        ),
        row(
            "Path flown through unknown worlds without movers, median",
            (statistics.median(longer) if longer else math.inf, "x"),
            ("path planned with all known", 1.0),
            f"<= {LENGTH_GOAL:g} x",
        ),
        row(
            "Replans in a flight that arrives, mean",
            (statistics.fmean(replans) if replans else 0.0, "1"),
            ("most", max(replans, default=0)),
            "> 0",
        ),
    ]


def main() -> int:
    """Fly through a number of worlds and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=ALL_WORLDS, metavar="N")
    rows = measure(range(parser.parse_args().worlds), REPORT)
    for found in rows:
        reference = f"{found['reference']}: {found['reference_value']:.4g}"
        verdict = "met" if found["met"] else "MISSED"
        print(f"{found['name']}: {found['value']:.4g} {found['unit']} ({reference}); ", end="")
        print(f"goal {found['goal']}: {verdict}")
    return 0 if all(found["met"] for found in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
