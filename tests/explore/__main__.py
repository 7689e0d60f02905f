"""The command: `python -m tests.explore`."""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from navigation_bridge.goals.goal import Annotation, GoalFeedback
from tests.explore.check import Checker
from tests.explore.course import SETPOINTS
from tests.explore.explorer import Flown, collect_seldom, explore, explore_scenario
from tests.explore.generate import SHARING_FROM, scenario_of
from tests.explore.log import Entry, Log
from tests.explore.more_situations import MORE_SITUATIONS_FROM
from tests.explore.picture import draw
from tests.explore.policies import ON_TRIAL, POLICIES
from tests.explore.run import fly
from tests.explore.scenario import Scenario
from tests.explore.shrink import shrink
from tests.explore.situations import SITUATIONS_FROM, TRAJECTORIES_FROM

_LAST_ENTRIES = 15
_WIDTH = 200
OUT = Path("out/explore")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run it; 0: nothing was violated, 1: something was, 2: a wrong argument."""
    parser = argparse.ArgumentParser(prog="python -m tests.explore", description=__doc__)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--seeds", type=int, default=200, help="number of seeds (default: 200)")
    what.add_argument("--seed", type=int, help="fly this one seed, with a picture")
    what.add_argument("--scenario", type=Path, help="fly this scenario file, with a picture")
    what.add_argument("--policies", action="store_true", help="print the policies")
    first_help = "the first seed, decimal or 0x... (default: 0)"
    parser.add_argument("--first", type=_number, default=0, help=first_help)
    sharing_help = "one seed in N is of shared traffic (default: 8; 0: none)"
    parser.add_argument("--sharing", type=int, default=8, metavar="N", help=sharing_help)
    situations_help = "one seed in N is a situation (default: 8; 0: none)"
    parser.add_argument("--situations", type=int, default=8, metavar="N", help=situations_help)
    more_help = "one seed in N is one of more situations (default: 8; 0: none)"
    parser.add_argument("--more", type=int, default=8, metavar="N", help=more_help)
    parser.add_argument("--minutes", type=float, help="stop after this time")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    dask_help = "fly on this Dask cluster; 'local': a cluster of --workers on this machine"
    parser.add_argument("--dask", metavar="ADDRESS", help=dask_help)
    parser.add_argument("--hashes", action="store_true", help="print the hash of each seed's log")
    shrink_help = "flights spent on a smaller scenario (default: 60; 0: none)"
    parser.add_argument("--shrink", type=int, default=60, metavar="N", help=shrink_help)
    options = parser.parse_args(arguments)
    if options.dask and find_spec("distributed") is None:
        parser.error("--dask needs the package distributed: pip install distributed")
    if options.policies:
        print(policy_table())
        return 0
    if options.seed is not None:
        return _one(scenario_of(options.seed))
    if options.scenario is not None:
        try:
            return _one(Scenario.load(options.scenario))
        except (OSError, ValueError) as error:
            parser.error(str(error))
    if options.seeds < 1 or options.workers < 1:
        parser.error("--seeds and --workers must be at least 1")
    return _many(options)


def _number(text: str) -> int:
    return int(text, 0)


def policy_table() -> str:
    """Return all policies as a Markdown table."""
    rows = ["| Policy | What it says | Source |", "|---|---|---|"]
    for policy in POLICIES:
        trial = " (on trial)" if policy.name in ON_TRIAL else ""
        rows.append(f"| `{policy.name}` | {policy.text}{trial} | {policy.source} |")
    return "\n".join(rows)


def _one(scenario: Scenario) -> int:
    checker = Checker(scenario)
    log = fly(scenario, checker.take)
    violations = list(checker.found.values())
    OUT.mkdir(parents=True, exist_ok=True)
    picture = OUT / f"seed_{scenario.seed}.png"
    draw(scenario, log, violations, picture)
    print(f"hash {log.digest}; picture: {picture}")
    for violation in violations:
        print(f"\n{violation.policy} at {violation.time_s:.2f} s, vehicle {violation.craft}: "
              f"{violation.what}")  # fmt: skip
        _print_last(log, violation.entry)
    return 1 if violations else 0


def _print_last(log: Log, place: int) -> None:
    craft = log.entries[place].craft
    told = [e for e in log.entries[:place] if e.craft == craft and _tells(e)]
    for entry in (*told[-_LAST_ENTRIES:], log.entries[place]):
        print(f"  {entry.time_s:8.2f} {entry.kind:9} {str(entry.value)[:_WIDTH]}")


def _tells(entry: Entry) -> bool:
    """Whether it is not one of a stream."""
    if entry.kind == "sent":
        return entry.value.get_type() not in (*SETPOINTS, "HEARTBEAT", "TIMESYNC")
    return entry.kind != "truth" and not isinstance(entry.value, Annotation | GoalFeedback)


def _many(options: argparse.Namespace) -> int:
    begun_s = time.monotonic()
    results: list[Flown] = []
    seen: set[str] = set()
    failed = False

    def seeds() -> Iterator[int]:
        kinds = options.sharing, options.situations, options.more
        for seed in drawn(options.first, options.seeds, *kinds):
            if options.minutes and time.monotonic() - begun_s > 60.0 * options.minutes:
                return
            yield seed

    with _executor(options) as executor:
        for flown in explore(seeds(), executor, 2 * options.workers):
            results.append(flown)
            if options.hashes:
                print(f"seed {flown.seed}: {flown.digest}")
            if flown.error:
                failed = True
                print(f"seed {flown.seed}: the exploration failed\n{flown.error}")
            for violation in flown.violations:
                trial = violation.policy in ON_TRIAL
                failed = failed or not trial
                print(f"seed {flown.seed}: {violation.policy}{' (on trial)' * trial} at "
                      f"{violation.time_s:.2f} s, vehicle {violation.craft}: "
                      f"{violation.what[:160]}\n"
                      f"  python -m tests.explore --seed {flown.seed}")  # fmt: skip
                if options.shrink and violation.policy not in seen:
                    seen.add(violation.policy)
                    _keep_small(flown.seed, violation.policy, options.shrink)
            _progress(results, begun_s)
    _summary(results, begun_s)
    return 1 if failed else 0


def drawn(
    first: int, count: int, sharing: int, situations: int = 0, more: int = 0
) -> Iterator[int]:
    """Return seeds from one on; some are raised.

    One in `sharing` becomes one of shared traffic, one in `situations` a situation, one in `more`
    one of more situations, and one in four times `situations` a situation of trajectories.
    """
    for seed in itertools.islice(itertools.count(first), count):
        if sharing > 0 and seed % sharing == 0 and seed < SHARING_FROM:
            yield seed + SHARING_FROM
        elif situations > 0 and seed % situations == situations // 2 and seed < SHARING_FROM:
            yield seed // situations + SITUATIONS_FROM
        elif situations > 0 and seed % (4 * situations) == 1 and seed < SHARING_FROM:
            yield seed // (4 * situations) + TRAJECTORIES_FROM
        elif more > 0 and seed % more == more // 4 and seed < SHARING_FROM:
            yield seed // more + MORE_SITUATIONS_FROM
        else:
            yield seed


@contextmanager
def _executor(options: argparse.Namespace) -> Iterator[Executor]:
    """Give where scenarios are flown: processes of this machine, or a Dask cluster."""
    if options.dask is None:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(
            options.workers, mp_context=context, initializer=collect_seldom
        ) as pool:
            yield pool
        return
    distributed = import_module("distributed")
    with ExitStack() as stack:
        address = options.dask
        if address == "local":
            address = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=options.workers, threads_per_worker=1, host="127.0.0.1",
                    dashboard_address=None,
                )
            )  # fmt: skip
        client = stack.enter_context(distributed.Client(address))
        yield stack.enter_context(client.get_executor(pure=False))


def _keep_small(seed: int, policy: str, tries: int) -> None:
    def fails(scenario: Scenario) -> bool:
        return any(v.policy == policy for v in explore_scenario(scenario, True).violations)

    scenario = scenario_of(seed)
    small, flown = shrink(scenario, fails, tries)
    OUT.mkdir(parents=True, exist_ok=True)
    path = OUT / f"{policy}_{seed}.json"
    small.save(path)
    print(f"  {len(scenario.events)} events became {len(small.events)} in {flown} flights:\n"
          f"  python -m tests.explore --scenario {path}")  # fmt: skip


def _progress(results: Sequence[Flown], begun_s: float) -> None:
    terminal = sys.stderr.isatty()
    if terminal or len(results) % 20 == 0:
        hours = sum(flown.vehicle_s for flown in results) / 3600.0
        spent_s = time.monotonic() - begun_s
        print(f"{len(results)} seeds, {hours:.1f} vehicle hours, {spent_s:.0f} s",
              end="\r" if terminal else "\n", file=sys.stderr)  # fmt: skip


def _summary(results: Sequence[Flown], begun_s: float) -> None:
    looked: Counter[str] = Counter()
    codes: Counter[str] = Counter()
    for flown in results:
        looked.update(flown.looked)
        codes.update(flown.codes)
    vehicle_s = sum(flown.vehicle_s for flown in results)
    cpu_s = sum(flown.cpu_s for flown in results)
    print(f"\n{len(results)} seeds, {vehicle_s / 3600.0:.2f} vehicle hours in "
          f"{time.monotonic() - begun_s:.0f} s; {vehicle_s / max(cpu_s, 1e-9):.0f} vehicle "
          "hours per hour of one core")  # fmt: skip
    print("ends and rejections: " + ", ".join(f"{k} {n}" for k, n in codes.most_common()))
    idle = [name for name, count in looked.items() if count == 0]
    print(f"policies that had nothing to look at: {', '.join(idle) or 'none'}")


if __name__ == "__main__":
    raise SystemExit(main())
