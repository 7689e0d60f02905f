"""Time, success and length of planned paths in seeded random worlds, beside OMPL.

Times are the thread's own processor time, so that other work on the machine doesn't count. OMPL
gets the processor time that a plan may take, and then as much again for shortening; it asks for
what is clear in the quickest way Python has, a look into a table that was made before and is not
counted. Which worlds have a path is known from a fine grid, or because somebody found one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.planar_shapes import PlanarShapes
from navigation_core.planning.planner import NoPath, Path, PlanLimits, plan
from tests.bench.rows import row
from tests.support.worlds.other_planners import ompl_path, table_checks
from tests.support.worlds.random_worlds import CLEARANCE_M, World, random_world

WORLDS, SHORT_WORLDS = range(100), (1, 4)
"""Of the short ones, one has a path and one has none"""
CROWDED_WORLDS, SHORT_CROWDED_WORLDS = 140, 2
OBSTACLES, MANY_OBSTACLES = 200, 1000
LOW_TOP_M = 8.0
CELL_M = 0.25
CELLS_MAX = 2000
TIME_S = 0.05
GOAL_MS, MANY_GOAL_MS, LOW_GOAL_MS, CELLS_GOAL_MS = 10.0, 25.0, 10.0, 40.0
IN_PLANE = PlanLimits(CLEARANCE_M)
IN_AIR = PlanLimits(CLEARANCE_M, (1.0, 30.0))
LENGTH_GOAL = 1.02
RIVALS = ("RRT-Connect", "BIT*")


@dataclass(frozen=True)
class _Outcome:
    """The results of all planners for one world: lengths, infinity for no path."""

    solvable: bool
    lengths_m: dict[str, float]


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure the time of a plan, then success and length beside OMPL."""
    count = SHORT_CROWDED_WORLDS if short else CROWDED_WORLDS
    crowded = [random_world(seed, OBSTACLES) for seed in range(count)]
    many = [random_world(seed, MANY_OBSTACLES) for seed in range(count // 2)]
    low = [random_world(seed, OBSTACLES, top_m=LOW_TOP_M) for seed in range(count)]
    rows = []
    for among, goal_ms, cases in (
        (f"{OBSTACLES} obstacles", GOAL_MS, [(w, w.obstacles, IN_PLANE) for w in crowded]),
        (f"{MANY_OBSTACLES} obstacles", MANY_GOAL_MS, [(w, w.obstacles, IN_PLANE) for w in many]),
        (
            f"{OBSTACLES} low obstacles, in space",
            LOW_GOAL_MS,
            [(w, w.obstacles, IN_AIR) for w in low],
        ),
        (
            f"up to {CELLS_MAX} sensed cells",
            CELLS_GOAL_MS,
            [(w, _as_cells(w), IN_PLANE) for w in crowded[: count // 2]],
        ),
    ):
        spent = np.percentile([_time_ms(*case) for case in cases], (50.0, 99.0))
        name = f"plan among {among}, 99th percentile"
        median, latest = ("median", float(spent[0])), (float(spent[1]), "ms")
        rows.append(row(name, latest, median, f"< {goal_ms:g} ms", latest[0] < goal_ms))
    return rows + _beside_ompl([_outcome(seed) for seed in (SHORT_WORLDS if short else WORLDS)])


def _beside_ompl(outcomes: list[_Outcome]) -> list[dict[str, Any]]:
    solvable = [outcome for outcome in outcomes if outcome.solvable]
    closed = [outcome for outcome in outcomes if not outcome.solvable]
    found = {name: _share(name, solvable) for name in ("ours", *RIVALS)}
    rows = []
    for rival in RIVALS:
        name = f"worlds with a path in which it is found, beside {rival}"
        share, reference = (found["ours"], ""), (f"OMPL {rival}", found[rival])
        rows.append(row(name, share, reference, "all of them", found["ours"] == 1.0))
        both = [o for o in solvable if np.isfinite([o.lengths_m["ours"], o.lengths_m[rival]]).all()]
        ours, theirs = (
            float(np.mean([o.lengths_m[name] / min(o.lengths_m.values()) for o in both]))
            for name in ("ours", rival)
        )
        name = f"length over the shortest known, where {rival} finds a path"
        met = ours < LENGTH_GOAL
        rows.append(row(name, (ours, ""), (f"OMPL {rival}", theirs), f"< {LENGTH_GOAL:g}", met))
    said = sum(not np.isfinite(outcome.lengths_m["ours"]) for outcome in closed)
    name, reference = (
        "worlds without a path that end in NoPath",
        ("worlds without one", len(closed)),
    )
    return [*rows, row(name, (said, "1"), reference, "all of them", said == len(closed))]


def _share(name: str, outcomes: list[_Outcome]) -> float:
    return float(np.mean([np.isfinite(outcome.lengths_m[name]) for outcome in outcomes]))


def _outcome(seed: int) -> _Outcome:
    world = random_world(seed)
    ours = plan(world.start_enu_m, world.goal_enu_m, world.obstacles, IN_PLANE)
    lengths = {"ours": ours.length_m if isinstance(ours, Path) else np.inf}
    checks = table_checks(world)
    for rival in RIVALS:
        path = ompl_path(world, rival, TIME_S, seed + 1, checks)
        lengths[rival] = np.inf if path is None else _length_m(path)
    solvable = world.solvable or bool(np.isfinite(list(lengths.values())).any())
    return _Outcome(solvable, lengths)


def _length_m(path: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _time_ms(world: World, obstacles: Obstacles, limits: PlanLimits) -> float:
    begin_s = time.thread_time()
    answer = plan(world.start_enu_m, world.goal_enu_m, obstacles, limits)
    spent_ms = 1e3 * (time.thread_time() - begin_s)
    assert isinstance(answer, Path | NoPath)
    return spent_ms


def _as_cells(world: World) -> Obstacles:
    """Return the outlines of a world as a sensor sees them: the nearest cells of a map."""
    places, _ = PlanarShapes(world.obstacles).sampled(CELL_M)
    cells = np.unique(np.round(places / CELL_M), axis=0) * CELL_M
    offset = cells - np.array(world.start_enu_m[:2])
    nearest = cells[np.argsort(np.hypot(offset[:, 0], offset[:, 1]), kind="stable")[:CELLS_MAX]]
    posts = np.full((len(nearest), 5), (0.0, 0.0, 0.71 * CELL_M, -np.inf, np.inf))
    posts[:, :2] = nearest
    ends = np.array([world.start_enu_m, world.goal_enu_m])
    clear = Obstacles(posts)
    assert (clear.clearance_m(ends) >= CLEARANCE_M).all()
    return clear
