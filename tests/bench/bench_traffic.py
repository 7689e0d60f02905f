"""Fifty vehicles that keep apart, planned on one thread, beside the budget of their setpoints.

As in a server, searches for detours run beside the setpoints; they are counted on their own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from navigation_core.searches import IsWanted
from navigation_core.tasks.traffic.volumes import Separation
from tests.bench.rows import row
from tests.fleets.points import fly_crossing, starts_and_targets

VEHICLES, SIDE_M, FLOWN_S = 50, 250.0, 20.0
SHORT_VEHICLES, SHORT_FLOWN_S = 5, 1.0
SETPOINT_S = 0.05
"""1 / setpoint_rate_hz"""


class _Later:
    """A search that is done after the step."""

    def __init__(self, work: Callable[[IsWanted], Any]) -> None:
        self._work = work
        self._value: Any = None

    def run(self) -> None:
        self._value = self._work(lambda: True)

    def result(self) -> Any:
        return self._value

    def abandon(self) -> None:
        """It is done all the same."""


class _Beside:
    """Does searches between steps, and counts their time."""

    lead_s = 0.2

    def __init__(self) -> None:
        self.used_s = 0.0
        self._left: list[_Later] = []

    def begin(self, work: Callable[[IsWanted], Any]) -> _Later:
        self._left.append(_Later(work))
        return self._left[-1]

    def work(self) -> None:
        begun_s = time.thread_time()
        while self._left:
            self._left.pop(0).run()
        self.used_s += time.thread_time() - begun_s


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure the processor time of one step of all, alone and among each other."""
    count, flown_s = (SHORT_VEHICLES, SHORT_FLOWN_S) if short else (VEHICLES, FLOWN_S)
    pairs = starts_and_targets(1, count, SIDE_M, 9.0)
    steps_ms, searches = {}, _Beside()
    for together in (True, False):
        begun_s = time.thread_time()
        fly_crossing(pairs, Separation(), together, flown_s, SETPOINT_S, searches, searches.work)
        used_s = time.thread_time() - begun_s - (searches.used_s if together else 0.0)
        steps_ms[together] = 1e3 * used_s / math.ceil(flown_s / SETPOINT_S)
    budget_ms = 1e3 * SETPOINT_S
    searched, left = searches.used_s / flown_s, max(1.0 - steps_ms[True] / budget_ms, 0.01)
    return [
        *(
            row(
                f"traffic: a step of {VEHICLES} vehicles that {what}",
                (steps_ms[together], "ms"),
                ("the setpoint period", budget_ms),
                f"<= {budget_ms:g} ms",
            )
            for together, what in ((True, "cross and keep apart"), (False, "fly as if alone"))
        ),
        row(
            f"traffic: searches for detours beside it, {VEHICLES} vehicles",
            (searched, "cores"),
            ("left by the steps", left),
            "<= 1 x",
        ),
    ]
