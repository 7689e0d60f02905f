"""Duration of the rehearsal of a goal, and its accuracy.

Goals of about a minute, with the program's own settings, in this process. Time is the processor's;
of five the shortest counts. The reference is the limit for a goal of 60 s, and longer or
shorter ones count in proportion.
"""

from __future__ import annotations

import gc
import time
from dataclasses import replace
from typing import Any

from flight_rehearsal.rehearsal import lose_link, rehearse
from flight_rehearsal.request import RehearsalRequest, RehearsalWaypoint
from tests.bench.rows import row

GOAL_S, OF_S = 0.5, 60.0
ROUNDS, SHORT_ROUNDS = 5, 1
SHORT_ORDERS = ("ArduPilot rover",)
_ORDER = RehearsalRequest(
    "",
    (RehearsalWaypoint((100.0, 130.0, 10.0)),),
    position_enu_m=(0.0, 0.0, 5.0),
    armed=True,
    flying=True,
    server={"arming": "auto", "battery_policy": "ignore"},
)
_POSTS = tuple((x + 0.4 * (y % 3), float(y), 0.5, 0.0, 20.0) for x in range(15, 90, 15)
               for y in range(10, 130, 12))  # fmt: skip
_DRIVEN = replace(
    _ORDER, waypoints=(RehearsalWaypoint((100.0, 130.0, 0.0)),), position_enu_m=3 * (0.0,)
)


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Rehearse with each kind, among obstacles, and with a lost link."""
    copter = replace(_ORDER, autopilot="ArduCopter")
    orders = {
        "ArduPilot copter": copter,
        "PX4 copter": replace(_ORDER, autopilot="PX4 multicopter"),
        "ArduPilot rover": replace(_DRIVEN, autopilot="ArduRover"),
        "ArduPilot copter among 50 posts": replace(copter, posts=_POSTS, avoid_obstacles=True),
    }
    if short:
        orders = {name: orders[name] for name in SHORT_ORDERS}
    rounds = SHORT_ROUNDS if short else ROUNDS
    lost = "Rehearsal of a lost link, ArduPilot copter"
    gc.disable()  # as the program does
    try:
        rows = [
            _row(f"Rehearsal of a goal, {name}", order, rounds) for name, order in orders.items()
        ]
        return [*rows, _row(lost, copter, rounds, lost=True)]
    finally:
        gc.enable()


def _row(name: str, order: RehearsalRequest, rounds: int, lost: bool = False) -> dict[str, Any]:
    flown = rehearse(order)
    if flown.code != "SUCCESS":
        raise RuntimeError(f"{name} ended otherwise, nothing measured: {flown.text}")
    times_s = []
    for _ in range(rounds):
        gc.collect()
        began_s = time.process_time()
        if lost:
            lose_link(order, 0.5 * flown.duration_s)
        else:
            rehearse(order)
        times_s.append(time.process_time() - began_s)
    spent_s = min(times_s) * OF_S / flown.duration_s
    return row(
        name,
        (spent_s, "s"),
        ("limit for a goal of 60 s", GOAL_S),
        f"<= 1 x ({OF_S / GOAL_S:.0f} x real time)",
        spent_s <= GOAL_S,
    )
