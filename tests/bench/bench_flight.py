"""Flights without obstacles: how long they take, how they arrive, and what they say about it.

Bridge and simulated vehicle fly seeded goals, one after the other, from 5 to 80 m away and at
different speeds. The reference of a flight's time is the least in which a point may move there
from rest to rest, by Ruckig on one axis, with the limits of speed, acceleration and jerk that the
server flies with: on a straight line, or for what drives on the shortest path that begins along
its nose and turns no tighter than the server counts with. A rover or boat has the limits of its own
parameters where they are lower. The time counts from the first moment under way, so without
what a firmware takes to hand over control, to the arrival; the second for which the vehicle must
stay there to have arrived comes after that.
"""

from __future__ import annotations

import math
import multiprocessing
import random
import statistics
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.goal import GoalFeedback
from navigation_bridge.vehicle.traits import driving_of, limits_of, traits_of
from navigation_core.geometry import Vector3, distance, dot, subtract, unit_between
from navigation_core.tasks.progress import Status
from tests.bench.rows import row
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.models.kinematics import driven_way_m, least_time_s

GOALS = 20
DRIVES = 10
SHORT_VEHICLES = ("PX4 copter", "ArduPilot boat")
FLIGHT_GOAL, ETA_GOAL = 1.10, 0.10
_SEED = 11
_STAYS_S = 3.0
"""For so long after its end a flight is watched for overshoot"""
_FLIGHT_MAX_S = 600.0
_DISTANCES_M = (5.0, 80.0)
_SPEEDS_M_S = (0.0, 2.0, 4.0, 8.0)
_WITHIN_M = 60.0
_RADIUS_M, _BOAT_RADIUS_M = 0.5, 2.0
"""How near counts as arrived"""
_HEIGHTS_M = (3.0, 25.0)


@dataclass(frozen=True)
class Flight:
    """One goal and how it was flown.

    Attributes:
        path_m: the shortest path from where it began to the goal.
        flown_s: time from the first moment under way to the arrival.
        least_s: what the limits allow.
        beyond_m: how far it truly got beyond the goal, along the path to it.
        off_m: how far it truly was from the goal when it had arrived.
        eta_error: of the time that it said was left at half way, as a share of what was left.
    """

    path_m: float
    flown_s: float
    least_s: float
    beyond_m: float
    off_m: float
    eta_error: float


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Fly all goals with each vehicle."""
    vehicles = {
        "ArduPilot copter": VehicleConfig(ready_after_s=1.0),
        "PX4 copter": VehicleConfig(autopilot="px4", ready_after_s=1.0),
        "ArduPilot rover": VehicleConfig(vehicle="rover", ready_after_s=1.0),
        "PX4 rover": VehicleConfig(vehicle="rover", autopilot="px4", ready_after_s=1.0),
        "ArduPilot boat": VehicleConfig(vehicle="boat", ready_after_s=1.0),
    }
    if short:
        vehicles = {name: vehicles[name] for name in SHORT_VEHICLES}
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(mp_context=context) as pool:
        flights = pool.map(partial(fly_goals, short=short), vehicles.values())
        flown = dict(zip(vehicles, flights, strict=True))
    rows: list[dict[str, Any]] = []
    for name, of_one in flown.items():
        rows += _rows(name, of_one)
    return rows


def fly_goals(vehicle: VehicleConfig, short: bool) -> list[Flight]:
    """Fly one goal after the other."""
    flight = SimulatedFlight(simulated=vehicle, battery_policy="ignore").ready()
    drives = vehicle.vehicle in ("rover", "boat")
    if not drives:
        flight.fly_up()
    rng = random.Random(_SEED)
    count = 1 if short else DRIVES if drives else GOALS
    return [_fly(flight, *_next(rng, flight, drives)) for _ in range(count)]


def _next(rng: random.Random, flight: SimulatedFlight, drives: bool) -> tuple[Vector3, float]:
    """Choose a goal and its greatest speed."""
    (east, north, _), _ = flight.truth()
    while True:
        away, bearing = rng.uniform(*_DISTANCES_M), rng.uniform(-math.pi, math.pi)
        up = 0.0 if drives else rng.uniform(*_HEIGHTS_M)
        goal = (east + away * math.cos(bearing), north + away * math.sin(bearing), up)
        if max(abs(goal[0]), abs(goal[1])) < _WITHIN_M:
            return goal, rng.choice(_SPEEDS_M_S[:3] if drives else _SPEEDS_M_S)


def _fly(flight: SimulatedFlight, goal: Vector3, speed_m_s: float) -> Flight:
    goal_id = flight.send(*goal, speed_m_s)
    pose = flight.bridge.pose
    assert pose is not None
    start, yaw_rad = pose.position_enu_m, pose.yaw_enu_rad
    along = unit_between(start, goal)
    assert along is not None
    end_s = off_m = math.inf
    beyond_m, limit_s = 0.0, flight.now + _FLIGHT_MAX_S
    while flight.now < end_s + _STAYS_S:
        if flight.now > limit_s:
            raise RuntimeError(f"The goal {goal} did not end within {_FLIGHT_MAX_S:g} s.")
        flight.tick()
        at = flight.truth()[0]
        beyond_m = max(beyond_m, dot(subtract(at, goal), along))
        if math.isinf(end_s) and flight.ends(goal_id):
            (end,) = flight.ends(goal_id)
            assert end.code.value == "SUCCESS", end.message
            end_s, off_m = flight.now, distance(at, goal)
    told = [(t, item) for t, item in flight.outputs if isinstance(item, GoalFeedback)]
    told = [(t, item) for t, item in told if item.goal_id == goal_id]
    config = flight.config.bridge.goto
    began_s = next(t for t, item in told if item.status is Status.NAVIGATING)
    assert flight.vehicle.profile is not None
    traits = traits_of(flight.vehicle.profile, flight.vehicle.parameters.values)
    limits = limits_of(traits, config.limits)
    limits = limits.with_speed(min(speed_m_s, traits.speed_max_m_s))
    path_m = distance(start, goal)
    if not traits.flies:
        path_m = driven_way_m(start, yaw_rad, goal, traits.turning_radius_m)
    return Flight(
        path_m,
        end_s - config.arrival_dwell_s - began_s,
        least_time_s(
            path_m,
            limits.along(along),
            driving_of(flight.vehicle.parameters.values).braking_m_s2 or math.inf,
        ),
        beyond_m,
        off_m,
        _eta_error(told, began_s, end_s),
    )


def _eta_error(told: list[tuple[float, GoalFeedback]], began_s: float, end_s: float) -> float:
    """How far off the time left was when half of the path was left, as a share."""
    under_way = [(t, item) for t, item in told if t >= began_s]
    whole_m = under_way[0][1].distance_remaining_m
    at_s, half = next(
        (t, item) for t, item in under_way if item.distance_remaining_m <= 0.5 * whole_m
    )
    return abs(half.time_remaining_s - (end_s - at_s)) / (end_s - at_s)


def _rows(name: str, flights: list[Flight]) -> list[dict[str, Any]]:
    """Make rows."""
    slower = [flight.flown_s / flight.least_s for flight in flights]
    radius_m = _BOAT_RADIUS_M if "boat" in name else _RADIUS_M
    beyond_m = max(flight.beyond_m for flight in flights)
    eta_error = statistics.median(flight.eta_error for flight in flights)
    typical = statistics.median_low(slower)
    at = flights[slower.index(typical)]

    return [
        row(
            f"{name}: time of all flights",
            (sum(flight.flown_s for flight in flights), "s"),
            ("least that the limits allow", sum(flight.least_s for flight in flights)),
            f"<= {FLIGHT_GOAL:g} x",
        ),
        row(
            f"{name}: time of the typical flight",
            (at.flown_s, "s"),
            ("least that the limits allow", at.least_s),
            f"<= {FLIGHT_GOAL:g} x",
        ),
        row(
            f"{name}: farthest beyond a goal",
            (beyond_m, "m"),
            ("radius of arrival", radius_m),
            "<= 1 x",
        ),
        row(
            f"{name}: error of the ETA at half way, median",
            (100.0 * eta_error, "%"),
            ("time left", 100.0),
            f"< {100.0 * ETA_GOAL:g} %",
        ),
    ]
