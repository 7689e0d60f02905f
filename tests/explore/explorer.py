"""Flies many scenarios, here or on any executor of concurrent.futures."""

from __future__ import annotations

import gc
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, field

from navigation_bridge.goals.goal import GoalFinished
from tests.explore.check import Checker, Violation
from tests.explore.generate import scenario_of
from tests.explore.log import Entry
from tests.explore.run import EnoughError, fly
from tests.explore.scenario import Scenario


@dataclass(frozen=True)
class Flown:
    """The result of one scenario.

    Attributes:
        seed: its number.
        digest: hash of its log.
        vehicle_s: simulated time, summed over the vehicles.
        cpu_s: processor time.
        violations: what was violated.
        looked: how often each policy had something to look at.
        codes: how often each outcome and rejection came.
        error: a traceback of the exploration itself; empty if there was none.
    """

    seed: int
    digest: str
    vehicle_s: float
    cpu_s: float
    violations: tuple[Violation, ...] = ()
    looked: dict[str, int] = field(default_factory=dict)
    codes: dict[str, int] = field(default_factory=dict)
    error: str = ""


def collect_seldom() -> None:
    """Let the garbage collector of a process that flies pass by all that stays to its end.

    It took a tenth of the time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def explore_seed(seed: int) -> Flown:
    """Make the scenario of a number, fly it and check it."""
    return explore_scenario(scenario_of(seed))


def explore_scenario(scenario: Scenario, briefly: bool = False) -> Flown:
    """Fly a scenario and check it; briefly: to the first violation."""
    begun_s = time.process_time()
    checker = Checker(scenario)

    def watch(entry: Entry) -> None:
        checker.take(entry)
        if briefly and checker.found:
            raise EnoughError

    try:
        log = fly(scenario, watch)
    except Exception:
        return Flown(scenario.seed, "", 0.0, 0.0, error=traceback.format_exc())
    codes: Counter[str] = Counter()
    for entry in log.entries:
        if isinstance(entry.value, GoalFinished):
            codes[entry.value.code.value] += 1
        elif entry.kind == "asked" and entry.value.rejection is not None:
            codes[f"rejected {entry.value.rejection.code.value}"] += 1
    return Flown(
        scenario.seed,
        log.digest,
        log.entries[-1].time_s * len(scenario.crafts),
        time.process_time() - begun_s,
        tuple(checker.found.values()),
        checker.looked,
        dict(codes),
    )


def explore(seeds: Iterable[int], executor: Executor, ahead: int) -> Iterator[Flown]:
    """Fly the scenarios of numbers on an executor, as they are done.

    Args:
        seeds: any number of them.
        executor: of a process pool, or of an engine such as Dask.
        ahead: how many are under way at once.
    """
    waiting: set[Future[Flown]] = set()
    for seed in seeds:
        waiting.add(executor.submit(explore_seed, seed))
        if len(waiting) >= ahead:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
    while waiting:
        done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
        yield from (future.result() for future in done)
