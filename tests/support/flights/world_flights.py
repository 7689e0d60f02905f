"""Whole flights through random worlds: the bridge, the simulator, and what truly happened."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from mavlink_sitl import MoverPath, Obstacle, RangeSensor, VehicleConfig
from mavlink_sitl import World as SimulatedWorld
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.tasks.registry import TASKS
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Cylinder, KnownObstacle
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.worlds.ground_truth import Encounter
from tests.support.worlds.random_worlds import Mover, World

TOP_M = 100.0
"""Top in the simulator of an obstacle that has none"""
TIMEOUT_S = 600.0
SCANNER = RangeSensor(reach_m=20.0)


@dataclass(frozen=True)
class Flown:
    """How a flight went.

    Attributes:
        code: the outcome's, "" if it did not end in time.
        message: of the outcome.
        elapsed_s: from the goal's acceptance to its end.
        flown_m: the length of the vehicle's path.
        replans: as the feedback told.
        nearest: the moment of least distance to an obstacle.
        hits: each time that the vehicle was nearer than its radius.
        collided: whether the simulator says so.
    """

    code: str
    message: str
    elapsed_s: float
    flown_m: float
    replans: int
    nearest: Encounter | None
    hits: tuple[Encounter, ...]
    collided: bool


def simulated(world: World, sensor: RangeSensor = SCANNER) -> SimulatedWorld:
    """Return a random world for the simulator, with its start at the origin."""
    start = world.start_enu_m
    fixed = [_obstacle(item, start) for item in world.fixed]
    moving = [_obstacle(mover, start) for mover in world.movers]
    return SimulatedWorld(
        name=f"{world.kind} {world.seed}",
        obstacles=(*fixed, *moving),
        range_sensor=sensor,
    )


def _obstacle(item: KnownObstacle | Mover, origin_enu_m: Vector3) -> Obstacle:
    shape = item.cylinder if isinstance(item, Mover) else item
    at, bottom_m, top_m = (
        _place(shape.centre_enu_m, origin_enu_m),
        max(shape.bottom_m, -TOP_M),
        min(shape.top_m, TOP_M),
    )
    path = None
    if isinstance(item, Mover):
        corners = tuple(_place(point, origin_enu_m) for point in item.path_enu_m)
        path = MoverPath(corners, item.speed_m_s)
    if isinstance(shape, Cylinder):
        return Obstacle(
            shape.name, at, radius_m=shape.radius_m, bottom_m=bottom_m, top_m=top_m, path=path
        )
    # A yaw is counted from East counter-clockwise here, and from North clockwise there.
    return Obstacle(
        shape.name,
        at,
        size_m=shape.size_m,
        yaw_rad=math.pi / 2.0 - shape.yaw_enu_rad,
        bottom_m=bottom_m,
        top_m=top_m,
        path=path,
    )


def _place(point_enu_m: tuple[float, float], origin_enu_m: Vector3) -> tuple[float, float]:
    """North and East from the origin."""
    return point_enu_m[1] - origin_enu_m[1], point_enu_m[0] - origin_enu_m[0]


def fly(
    world: World,
    vehicle: VehicleConfig | None = None,
    parameters: Mapping[str, ParameterValue] | None = None,
) -> tuple[Flown, SimulatedFlight]:
    """Send a vehicle through a random world with avoid_obstacles, until the goal ends.

    Args:
        world: the random world; the server knows nothing of it.
        vehicle: ArduPilot's copter if None.
        parameters: of the server.

    Returns:
        How it went, and the flight for a closer look.
    """
    config = vehicle or VehicleConfig(ready_after_s=1.0)
    around = simulated(world)
    flight = SimulatedFlight(world.seed, config, around, TASKS, **(parameters or {})).ready()
    start, goal = world.start_enu_m, world.goal_enu_m
    height_m = goal[2] if config.vehicle == "copter" else 0.0
    target = (goal[0] - start[0], goal[1] - start[1], height_m)
    flight.run_for(1.0)  # until the first scan is in
    begun_s = flight.now
    goal_id = flight.start(flight.request(*target, avoid=True))
    while not flight.ends(goal_id) and flight.now - begun_s < TIMEOUT_S:
        flight.run_for(1.0)
    ends, truth = flight.ends(goal_id), flight.ground_truth
    feedback = flight.feedback(goal_id)
    flown = Flown(
        ends[0].code.value if ends else "",
        ends[0].message if ends else "",
        ends[0].elapsed_s if ends else flight.now - begun_s,
        truth.flown_m,
        feedback[-1].replans if feedback else 0,
        truth.nearest,
        tuple(truth.hits),
        truth.collided,
    )
    return flown, flight
