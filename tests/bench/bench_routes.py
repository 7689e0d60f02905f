"""Routes through corners: flown time beside that of a point mass that is as fast as it can be.

Bridge and simulated copter fly seeded level routes. The reference moves through the same points
from rest to rest. Velocity and acceleration at each point are searched for the shortest time;
between two points Ruckig finds the fastest motion, with the limits that the server flies with, each
along the leg and across it. It may swing wide before a corner, which a server that keeps near the
lines between the waypoints does not: how fast a corner is depends on the acceptance radius. So does
how far it is from these lines on average, by the simulation's truth at each tick.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import ruckig
from numpy.typing import NDArray

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.goal import GoalFeedback
from navigation_bridge.goals.requests import WaypointRequest, WaypointsRequest
from navigation_bridge.vehicle.traits import limits_of, traits_of
from navigation_core.geometry import Vector3
from navigation_core.limits import Limits
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.progress import Status
from tests.bench.rows import row
from tests.support.flights.simulated_flight import SimulatedFlight

ROUTES, CORNERS = 6, 3
STRAY_GOAL = 0.35
# Speeds, acceptance radii of the waypoints (the default, and ArduPilot's own default), and goals.
# With a small radius a fast vehicle slows down at each corner, a point mass does not turn.
_FLOWN = (
    (3.0, GotoConfig.arrival_radius_m, 1.15),
    (8.0, GotoConfig.arrival_radius_m, 1.25),
    (8.0, 2.0, 1.15),
)
_LEGS_M = (8.0, 40.0)
_WITHIN_M, _HEIGHT_M = 60.0, 5.0
_SEED, _TRIES = 3, 2500
_SHORT_TRIES = 20
_NEVER_S = 1e3

Array = NDArray[np.float64]


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Fly all routes with both firmwares."""
    routes, tries = (1, _SHORT_TRIES) if short else (ROUTES, _TRIES)
    for autopilot in ("px4",) if short else ("ardupilot", "px4"):
        for speed_m_s, radius_m, goal in _FLOWN[-1:] if short else _FLOWN:
            flown_s, least_s, stray_m = _fly(autopilot, speed_m_s, radius_m, routes, tries)
            flown = (
                f"{autopilot} copter: routes through corners at {speed_m_s:g} m/s, "
                f"acceptance radius {radius_m:g} m"
            )
            yield from (
                row(
                    flown,
                    (flown_s, "s"),
                    ("fastest point mass", least_s),
                    f"<= {goal:g} x",
                ),
                row(
                    f"{flown}: mean distance from the lines",
                    (stray_m, "m"),
                    ("acceptance radius", radius_m),
                    f"<= {STRAY_GOAL:g} x",
                ),
            )


def _fly(
    autopilot: str, speed_m_s: float, radius_m: float, routes: int, tries: int
) -> tuple[float, float, float]:
    """Fly the routes one after the other.

    Returns:
        The flown time and the least, both in all (s), and the mean distance of the truth from the
        lines between the waypoints (m).
    """
    vehicle = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle, battery_policy="ignore").ready()
    flight.fly_up()
    config = flight.config.bridge.goto
    assert flight.vehicle.profile is not None
    traits = traits_of(flight.vehicle.profile, flight.vehicle.parameters.values)
    limits = limits_of(traits, config.limits).with_speed(speed_m_s)
    rng, flown_s, least_s, strays_m = random.Random(_SEED), 0.0, 0.0, []
    for _ in range(routes):
        here = flight.truth()[0]
        points = _route(rng, here)
        away = flight.send(*points[0], speed_m_s)
        assert flight.run_to_end(away).code.value == "SUCCESS"
        waypoints = tuple(
            WaypointRequest(point, acceptance_radius_m=radius_m) for point in points[1:]
        )
        goal_id = flight.start(WaypointsRequest(waypoints, max_speed_m_s=speed_m_s))
        lines = list(pairwise(points))
        while not flight.ends(goal_id):
            flight.tick()
            here = flight.truth()[0]
            strays_m.append(min(_distance_m(here, *line) for line in lines))
        (end,) = flight.ends(goal_id)
        assert end.code.value == "SUCCESS", end.message
        told = [(t, item) for t, item in flight.outputs if isinstance(item, GoalFeedback)]
        began_s = next(
            t for t, item in told if item.goal_id == goal_id and item.status is Status.NAVIGATING
        )
        flown_s += flight.now - config.arrival_dwell_s - began_s
        least_s += least_time_s(points, limits, tries)
    return flown_s, least_s, sum(strays_m) / len(strays_m)


def _distance_m(point: Vector3, start: Vector3, end: Vector3) -> float:
    """Return the distance of a point from a line between two others."""
    way = np.subtract(end, start)
    share = float(np.dot(np.subtract(point, start), way) / np.dot(way, way))
    return float(np.linalg.norm(np.subtract(point, start) - min(max(share, 0.0), 1.0) * way))


def _route(rng: random.Random, start: Vector3) -> list[Vector3]:
    points = [(start[0], start[1], _HEIGHT_M)]
    while len(points) < CORNERS + 2:
        length_m, bearing = rng.uniform(*_LEGS_M), rng.uniform(-math.pi, math.pi)
        east, north = points[-1][0], points[-1][1]
        east, north = east + length_m * math.cos(bearing), north + length_m * math.sin(bearing)
        if max(abs(east), abs(north)) < _WITHIN_M:
            points.append((east, north, _HEIGHT_M))
    return points


def least_time_s(points: list[Vector3], limits: Limits, tries: int) -> float:
    """Return the time of the fastest level motion through points that was found."""
    ways = [np.subtract(b, a)[:2] for a, b in pairwise(points)]
    courses = [way / np.linalg.norm(way) for way in ways]
    speed, force = limits.speed_horizontal_m_s, limits.acceleration_horizontal_m_s2
    # Of each corner: half of the speed, along the bisector, and the acceleration into the turn.
    states = np.array(
        [(0.3 * (a + b) * speed, 0.5 * (b - a) * force) for a, b in pairwise(courses)]
    )
    best_s, step = _time_s(ways, states, limits), 0.3
    rng = np.random.default_rng(_SEED)
    for _ in range(tries):
        tried = states.copy()
        change = rng.normal(0.0, step, (2, 2)) * np.array([[speed], [force]])
        corner = rng.integers(len(tried))
        tried[corner] += change
        lengths = np.linalg.norm(tried[corner], axis=1) / (0.999 * speed, 0.999 * force)
        tried[corner] /= np.maximum(lengths, 1.0)[:, None]
        time_s = _time_s(ways, tried, limits)
        if time_s < best_s:
            best_s, states, step = time_s, tried, min(1.3 * step, 0.5)
        else:
            step = max(0.985 * step, 0.003)
    return best_s


def _time_s(ways: list[Array], states: Array, limits: Limits) -> float:
    rest = np.zeros((2, 2))
    ends = [rest, *states, rest]
    return sum(_leg_s(way, *pair, limits) for way, pair in zip(ways, pairwise(ends), strict=True))


def _leg_s(way: Array, begin: Array, end: Array, limits: Limits) -> float:
    length_m = float(np.linalg.norm(way))
    (x, y) = way / length_m
    along = np.array([[x, y], [-y, x]])
    request = ruckig.InputParameter(2)
    request.current_velocity, request.current_acceleration = (begin @ along.T).tolist()
    request.target_velocity, request.target_acceleration = (end @ along.T).tolist()
    request.target_position = [length_m, 0.0]
    request.max_velocity = [limits.speed_horizontal_m_s] * 2
    request.max_acceleration = [limits.acceleration_horizontal_m_s2] * 2
    request.max_jerk = [limits.jerk_m_s3] * 2
    motion = ruckig.Trajectory(2)
    try:
        result = ruckig.Ruckig(2).calculate(request, motion)
    except (ruckig.RuckigError, ValueError):
        return _NEVER_S
    return float(motion.duration) if result == ruckig.Result.Working else _NEVER_S
