"""Flight time that an exploration flies per hour of a processor core.

Seeds of `make explore`, in this process. The reference is the same vehicles for the same time
without servers, people and policies: what the simulator alone takes with vehicles that stand.
"""

from __future__ import annotations

import time
from typing import Any

from tests.bench.rows import NO_GOAL, row
from tests.explore.exploration import Exploration
from tests.explore.explorer import Flown, explore_scenario
from tests.explore.generate import scenario_of
from tests.explore.log import Log
from tests.explore.scenario import Scenario

SEEDS, SHORT_SEEDS = range(1000, 1016), (1011,)
GOAL_H = 50.0


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Fly all seeds, and those with obstacles by themselves."""
    scenarios = [scenario_of(seed) for seed in (SHORT_SEEDS if short else SEEDS)]
    flown = [explore_scenario(scenario) for scenario in scenarios]
    with_posts = [(s, f) for s, f in zip(scenarios, flown, strict=True) if s.posts]
    name = "Exploration, vehicle hours per hour of a core"
    rows = [_row(name, scenarios, flown, GOAL_H)]
    if with_posts:
        name = "The same, only scenarios with obstacles"
        rows.append(_row(name, [s for s, _ in with_posts], [f for _, f in with_posts], 0.0))
    return rows


def _row(name: str, scenarios: list[Scenario], flown: list[Flown], goal_h: float) -> dict[str, Any]:
    for one in flown:
        if one.error:
            raise RuntimeError(f"A flight of the exploration failed: {one.error}")
    vehicle_s = sum(f.vehicle_s for f in flown)
    rate = vehicle_s / sum(f.cpu_s for f in flown)
    began_s = time.process_time()
    for scenario, one in zip(scenarios, flown, strict=True):
        flight = Exploration(scenario, Log())
        for ship in flight.ships:
            ship.kill_server()
        flight.run_for(one.vehicle_s / len(scenario.crafts))
    alone = vehicle_s / (time.process_time() - began_s)
    goal = f">= {goal_h:.0f} h/h" if goal_h else NO_GOAL
    return row(name, (rate, "h/h"), ("simulator alone, standing", alone), goal)
