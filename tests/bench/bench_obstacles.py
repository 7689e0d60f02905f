"""Growth of a plan's time with the number of obstacles, beside OMPL's RRT-Connect.

Seeded random worlds with known obstacles, in the plane. Times are the thread's processor time, and
the mean of the worlds counts. The reference finds any path in the same worlds, and shortens it by
its own means; it asks for what is clear by a look into a table that is not counted. It is the same
compiled program in each run, so it shows a change of all our times at once.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from navigation_core.planning.planner import PlanLimits, plan
from tests.bench.rows import NO_GOAL, row
from tests.support.worlds.other_planners import ompl_path, table_checks
from tests.support.worlds.random_worlds import CLEARANCE_M, random_world

COUNTS, SHORT_COUNTS = (10, 100, 300, 1000, 2000), (10,)
WORLDS, SHORT_WORLDS = 12, 2
GOALS_MS = {300: 10.0, 1000: 25.0, 2000: 100.0}
RIVAL, RIVAL_S = "RRT-Connect", 0.05
_LIMITS = PlanLimits(CLEARANCE_M)


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Plan with each number of obstacles."""
    for count in SHORT_COUNTS if short else COUNTS:
        ours_ms, theirs_ms = [], []
        for seed in range(SHORT_WORLDS if short else WORLDS):
            world = random_world(seed, count)
            checks = table_checks(world)
            start, goal = world.start_enu_m, world.goal_enu_m
            ours_ms.append(_ms(partial(plan, start, goal, world.obstacles, _LIMITS)))
            theirs_ms.append(_ms(partial(ompl_path, world, RIVAL, RIVAL_S, seed + 1, checks)))
        bound = GOALS_MS.get(count)
        yield row(
            f"plan among {count:,} obstacles, mean",
            (statistics.fmean(ours_ms), "ms"),
            (f"OMPL {RIVAL}", statistics.fmean(theirs_ms)),
            NO_GOAL if bound is None else f"< {bound:g} ms",
        )


def _ms(work: Callable[[], object]) -> float:
    begun_s = time.thread_time()
    work()
    return 1e3 * (time.thread_time() - begun_s)
