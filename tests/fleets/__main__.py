"""Flies seeded crossings and checks them: ``python -m tests.fleets --seeds 1000``.

Without ``--flown`` the core alone flies point masses; with it, bridges fly simulated vehicles. With
``--hangs`` the servers of a few simulated vehicles hang, are late, and find each other late.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor

from navigation_core.tasks.traffic.volumes import Separation
from tests.fleets.flown import CONDITIONS, flown_crossing
from tests.fleets.hangs import (
    CIRCLE_MAX_S,
    sent_to_one_that_hovers,
    swapped_and_returned,
    swapped_between_servers,
)
from tests.fleets.points import arrived, fly_crossing, starts_and_targets

RATIO_MAX = 1.3


def fly(job: tuple[int, int, float, str]) -> tuple[int, float, float, str]:
    """Fly one seed; return it, the ratio of times, the least separation and what went wrong."""
    seed, count, side_m, conditions = job
    if conditions:
        return (seed, *flown_crossing(seed, count, side_m, CONDITIONS[conditions]))
    separation = Separation()
    pairs = starts_and_targets(seed, count, side_m, 9.0)
    alone = fly_crossing(pairs, separation, together=False)
    crossing = fly_crossing(pairs, separation)
    fault = ""
    if crossing.least_share < 1.0:
        fault = f"separation lost: {crossing.worst}"
    elif not arrived(crossing):
        stuck = [one.name for one in crossing.vehicles if one.outcome is None or one.task]
        fault = f"not arrived: {', '.join(stuck)}"
    return seed, crossing.sum_s / alone.sum_s, crossing.least_share, fault


def fly_with_hangs(seed: int) -> tuple[int, str, str]:
    """Fly one seed of servers that hang; return it, what was flown and what went wrong."""
    scenarios = (sent_to_one_that_hovers, swapped_and_returned, swapped_between_servers)
    flight = scenarios[seed % len(scenarios)](seed)
    fault = ""
    if flight.share < 1.0:
        fault = "separation lost"
    elif flight.waited_s > CIRCLE_MAX_S:
        fault = "waited in a circle"
    return seed, flight.text, fault


def hang(seeds: range, workers: int) -> int:
    """Fly servers that hang; 0 if no separation was lost and nobody was stuck."""
    faults = 0
    with ProcessPoolExecutor(workers) as pool:
        for seed, text, fault in pool.map(fly_with_hangs, seeds):
            faults += bool(fault)
            if fault:
                print(f"seed {seed}: {fault}: {text}", flush=True)
    print(f"{len(seeds)} scenarios with hangs: {faults} faults")
    return 1 if faults else 0


def main() -> int:
    """Fly; 0 if no separation was lost, all arrived, and the time was kept."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20, help="vehicles of a scenario")
    parser.add_argument("--side", type=float, default=100.0, help="of the square, m")
    parser.add_argument(
        "--flown", choices=CONDITIONS, nargs="?", const="usual", default="",
        help="against the simulator, under these conditions",
    )  # fmt: skip
    parser.add_argument("--hangs", action="store_true", help="servers that hang or are late")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    if options.hangs:
        return hang(range(options.first, options.first + options.seeds), options.workers)
    jobs = [
        (seed, options.count, options.side, options.flown)
        for seed in range(options.first, options.first + options.seeds)
    ]
    ratios, least, faults = [], float("inf"), 0
    with ProcessPoolExecutor(options.workers) as pool:
        for seed, ratio, share, fault in pool.map(fly, jobs):
            ratios.append(ratio)
            least = min(least, share)
            faults += bool(fault)
            if fault or ratio > RATIO_MAX:
                print(f"seed {seed}: {ratio:.2f} x the time, {fault or 'all arrived'}", flush=True)
    total = sum(ratios) / len(ratios)
    print(
        f"{len(ratios)} scenarios of {options.count}: {faults} faults, {total:.3f} x the time "
        f"alone (worst {max(ratios):.2f}), least separation {least:.2f} of the demanded one"
    )
    return 1 if faults or total > RATIO_MAX else 0


if __name__ == "__main__":
    sys.exit(main())
