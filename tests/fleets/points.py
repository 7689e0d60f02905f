"""Crossing flights of the core alone: tasks, shared reservations and point masses, no MAVLink."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from navigation_core.geometry import Vector3, distance, norm, scale
from navigation_core.limits import Limits
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.intents import Fly, Outcome
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.task import Task
from navigation_core.tasks.traffic.entries import Claimant, Rank
from navigation_core.tasks.traffic.path_in_traffic import BRAKE_SHARE
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.traffic_view import TrafficFrame, TrafficView
from navigation_core.tasks.traffic.volumes import Separation, densified
from navigation_core.tasks.traits import Traits
from tests.support.models.point_mass import PointMass

DT_S = 0.1
_LIMITS = Limits(speed_horizontal_m_s=4.0)
_TRAITS = Traits(setpoint_timeout_s=1.0)
_BRAKING_M_S2 = BRAKE_SHARE * _LIMITS.acceleration_horizontal_m_s2


@dataclass
class Flown:
    """One vehicle of a scenario.

    Attributes:
        name: its name.
        mass: the vehicle.
        target: where its goal leads.
        task: its task; None once that has ended.
        ended_s: when it ended, since the start.
        outcome: how it ended.
        view: its traffic.
    """

    name: str
    mass: PointMass
    target: Vector3
    view: TrafficView | None
    task: Task | None = None
    ended_s: float = math.inf
    outcome: Outcome | None = None
    waited: list[str] = field(default_factory=list)


@dataclass
class Crossing:
    """How a scenario went.

    Attributes:
        vehicles: all of them.
        least_share: least separation, as a share of the one demanded; below 1 is a loss.
        worst: when and between whom that was.
        sum_s: the sum of all times.
    """

    vehicles: list[Flown]
    least_share: float = math.inf
    worst: str = ""

    @property
    def sum_s(self) -> float:
        """The sum of the times of all vehicles."""
        return sum(one.ended_s for one in self.vehicles)


def starts_and_targets(
    seed: int, count: int, side_m: float, apart_m: float
) -> list[tuple[Vector3, Vector3]]:
    """Return positions on the rim of a square, and targets on the other sides, all apart."""
    rng = random.Random(seed)
    heights = (5.0, 5.0, 5.0, 8.0, 12.0)
    chosen: list[tuple[Vector3, Vector3]] = []

    def place(side: int) -> Vector3:
        along, off = rng.uniform(-0.5, 0.5) * side_m, 0.5 * side_m + rng.uniform(-8.0, 8.0)
        x, y = ((along, -off), (off, along), (along, off), (-off, along))[side]
        return (x, y, rng.choice(heights))

    while len(chosen) < count:
        side = rng.randrange(4)
        start, target = place(side), place((side + rng.choice((1, 2, 2, 3))) % 4)
        apart = all(
            math.dist(start[:2], other[:2]) > apart_m and math.dist(target[:2], goal[:2]) > apart_m
            for other, goal in chosen
        )
        if apart:
            chosen.append((start, target))
    return chosen


def fly_crossing(
    pairs: list[tuple[Vector3, Vector3]],
    separation: Separation,
    together: bool = True,
    time_max_s: float = 400.0,
    dt_s: float = DT_S,
    searcher: Searcher = AT_ONCE,
    after_step: Callable[[], None] = lambda: None,
) -> Crossing:
    """Fly all at once, or each as if it were alone."""
    reservations = TrafficReservations(separation)
    vehicles = []
    config = GotoConfig(limits=_LIMITS, may_arm=True)
    for index, (start, target) in enumerate(pairs):
        name = f"v{index:02d}"
        mass = PointMass(position=start, armed=True, in_control=True, airborne=True, now=0.0)
        view = None
        if together:
            view = TrafficView(reservations, name, TrafficFrame.level(), 1.0, 0.5, (3.0, 40.0))
            view = replace(view, searcher=searcher)
            entry = reservations.entry(name)
            entry.rank = Rank(Claimant.GOAL, 0.0, name)
            reservations.stand(name, view.volume(np.array([start])), 0.0)
        task = fly_to(GotoGoal(target), FlightTerms(config, traits=_TRAITS))
        vehicles.append(Flown(name, mass, target, view, task))
    crossing = Crossing(vehicles)
    for one in vehicles:
        assert one.task is not None
        one.task.start(one.mass.observe(), 0.0)
    now = 0.0
    while now < time_max_s and any(one.task is not None for one in vehicles):
        for one in vehicles:
            _step(one, reservations, now)
        for one in vehicles:
            one.mass.advance(dt_s)
        now += dt_s
        after_step()
        if together:
            _watch(crossing, separation, now)
    return crossing


def _step(one: Flown, reservations: TrafficReservations, now: float) -> None:
    observation = one.mass.observe()
    object.__setattr__(observation, "traffic", one.view)
    if one.task is not None:
        answer = one.task.step(observation, now)
        progress = one.task.progress(observation, now)
        if progress.blocked and (not one.waited or one.waited[-1] != progress.blocked):
            one.waited.append(progress.blocked)
        if isinstance(answer, Outcome):
            one.task, one.ended_s, one.outcome = None, now, answer
            if one.view is not None:
                reservations.entry(one.name).rank = Rank(Claimant.NOTHING, 0.0, one.name)
        elif isinstance(answer, Fly):
            one.task.replan(observation, now)
        if not isinstance(answer, Outcome):
            one.mass.obey(answer)
    view = one.view
    if view is not None and reservations.entry(one.name).heard_s != now:
        line = np.array([one.mass.position, _stop(one.mass)])
        reservations.stand(one.name, view.volume(densified(line, np.zeros(2))[0]), now)


def _stop(mass: PointMass) -> Vector3:
    # As the bridge does: it runs out for as long as a setpoint is followed, and brakes gently then.
    running_s = _TRAITS.setpoint_timeout_s + norm(mass.velocity) / (2.0 * _BRAKING_M_S2)
    x, y, z = scale(mass.velocity, running_s)
    return (mass.position[0] + x, mass.position[1] + y, mass.position[2] + z)


def _watch(crossing: Crossing, separation: Separation, now: float) -> None:
    places = np.array([one.mass.position for one in crossing.vehicles])
    level = np.hypot(*(places[:, None, :2] - places[:, :2]).transpose(2, 0, 1))
    upright = np.abs(places[:, None, 2] - places[:, 2])
    share = np.maximum(level / separation.horizontal_m, upright / separation.vertical_m)
    share[np.diag_indices(len(places))] = np.inf
    if share.min() < crossing.least_share:
        a, b = np.unravel_index(int(share.argmin()), share.shape)
        crossing.least_share = float(share.min())
        crossing.worst = f"{now:.1f} s, {crossing.vehicles[a].name}, {crossing.vehicles[b].name}"


def arrived(crossing: Crossing) -> bool:
    """Whether all vehicles are at their targets."""
    return all(
        one.outcome is not None
        and one.outcome.code.value == "SUCCESS"
        and distance(one.mass.position, one.target) < 1.0
        for one in crossing.vehicles
    )
