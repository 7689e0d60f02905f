"""Encounters of planes with traffic that nobody leads, by ground truth.

A plane does not fly straight. So its goal is flown without traffic first, and each intruder is
where it was at one moment of that flight.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from navigation_bridge.goals.goal import LogLine
from navigation_bridge.goals.requests import TakeoffRequest
from navigation_core.geometry import Vector3, distance
from navigation_core.tasks.traffic.volumes import Separation
from tests.fleets.encounters import (
    REPORT_PERIOD_S,
    REPORTED_FROM_S,
    Intruder,
    adsb,
    apart,
    begin,
    hear,
)
from tests.fleets.flown import TICK_S, FlownFleet

GOAL_ENU_M: Vector3 = (500.0, 300.0, 60.0)
_SETTINGS = {"volume_radius_m": 3000.0}


@dataclass(frozen=True)
class PlaneFlown:
    """How an encounter of a plane went.

    Attributes:
        share: the least true separation, as a share of the demanded one; 1 is as demanded.
        level_m: the level distance then.
        upright_m: the difference of altitudes then.
        code: how the goal ended.
        statuses: of its feedback.
        places: where the plane was, tick by tick from the goal's start.
        lowest_m: least height above its home since then.
        final_error_m: of the goal.
        texts: what was logged about waiting.
    """

    share: float
    level_m: float
    upright_m: float
    code: str
    statuses: tuple[str, ...]
    places: tuple[Vector3, ...]
    final_error_m: float
    texts: tuple[str, ...]

    @property
    def brief(self) -> str:
        """Return what matters of it."""
        return f"{self.share:.2f}: {self.level_m:.1f}, {self.upright_m:.1f} m, {self.statuses}"

    @property
    def lowest_m(self) -> float:
        """Return its least height above its home."""
        return min(place[2] for place in self.places)


def fly_up(autopilot: str, **parameters: Any) -> FlownFleet:
    """Return a plane at 45 m in its take-off."""
    settings: dict[str, Any] = {**_SETTINGS, **parameters}
    fleet = begin("plane", autopilot, **settings)
    (craft,) = fleet.crafts
    assert isinstance(fleet.send(craft, TakeoffRequest(50.0)), str)
    fleet.run_until(lambda: float(fleet.simulation.positions_ned_m[0][2]) < -45.0, 120.0)
    return fleet


def fly(
    fleet: FlownFleet,
    intruders: Sequence[tuple[Intruder, Vector3]] = (),
    goal_enu_m: Vector3 = GOAL_ENU_M,
    stays_s: float = 0.0,
    timeout_s: float = 300.0,
) -> PlaneFlown:
    """Fly a goal among intruders, each with the position at which it would hit.

    Args:
        fleet: the plane.
        intruders: with their meeting positions, relative to the plane's home.
        goal_enu_m: relative to its home, too.
        stays_s: how long the flight lasts at least.
        timeout_s: how long it may take.
    """
    (craft,) = fleet.crafts
    separation = Separation()
    begun_s, due_s = fleet.now, REPORTED_FROM_S
    worst = (math.inf, math.inf, math.inf)
    places: list[Vector3] = []
    outputs = len(craft.outputs)

    def watch(now: float) -> None:
        nonlocal due_s, worst
        time_s = now - begun_s
        north, east, down = map(float, fleet.simulation.positions_ned_m[0])
        places.append((east, north, -down))
        reports = time_s >= due_s
        due_s += REPORT_PERIOD_S if reports else 0.0
        for one, meeting in intruders:
            place, velocity = one.at(meeting, time_s)
            level_m, upright_m = math.dist(place[:2], (east, north)), abs(place[2] + down)
            share = max(level_m / separation.horizontal_m, upright_m / separation.vertical_m)
            worst = min(worst, (share, level_m, upright_m))
            if reports:
                hear(fleet, adsb(fleet, place, velocity, one.address))

    fleet.on_tick = watch
    fleet.go(craft, *goal_enu_m)
    last_s = max([stays_s, *(one.meets_s + 10.0 for one, _ in intruders)])
    fleet.run_until(
        lambda: fleet.now - begun_s > last_s and craft.bridge.goals.active is None, timeout_s
    )
    fleet.on_tick = None
    _, end = craft.ends()[-1]
    lines = [out.text for _, out in craft.outputs[outputs:] if isinstance(out, LogLine)]
    texts = tuple(text for text in lines if "Waits for" in text)
    error_m = math.inf if end.final_error_m is None else end.final_error_m
    statuses = tuple(craft.statuses())
    return PlaneFlown(*worst, end.code.value, statuses, tuple(places), error_m, texts)


@cache
def alone(autopilot: str, goal_enu_m: Vector3 = GOAL_ENU_M) -> PlaneFlown:
    """Return the flight without traffic, and the circles that follow it."""
    return fly(fly_up(autopilot), goal_enu_m=goal_enu_m, stays_s=80.0)


def meet_plane(
    autopilot: str,
    intruders: Sequence[Intruder],
    goal_enu_m: Vector3 = GOAL_ENU_M,
    **parameters: Any,
) -> PlaneFlown:
    """Fly a goal among intruders on collision courses; courses count from the plane's."""
    places = alone(autopilot, goal_enu_m).places
    meeting = []
    for one in intruders:
        tick = round(one.meets_s / TICK_S)
        before, place = places[tick - 1], places[tick]
        course_deg = math.degrees(math.atan2(place[1] - before[1], place[0] - before[0]))
        meeting.append((replace(one, course_deg=one.course_deg + course_deg), place))
    return fly(fly_up(autopilot, **parameters), meeting, goal_enu_m)


def random_plane_encounter(seed: int) -> list[Intruder]:
    """Return up to three intruders from anywhere, 10 to 60 m/s, that would hit after 6 to 30 s."""
    draw = random.Random(seed)
    return apart(
        [
            Intruder(
                draw.uniform(0.0, 360.0),
                draw.uniform(10.0, 60.0),
                draw.uniform(6.0, 30.0),
                climb_m_s=draw.choice((0.0, 0.0, 0.0, 2.0, -2.0)),
                turn_deg_s=draw.choice((0.0, 0.0, 0.0, 3.0, -3.0)),
            )
            for _ in range(draw.choice((1, 1, 1, 2, 3)))
        ]
    )


def strays_m(flown: PlaneFlown, other: PlaneFlown) -> float:
    """Return how far apart two flights were, at the same times."""
    pairs = zip(flown.places, other.places, strict=False)
    return max(distance(one, another) for one, another in pairs)
