"""Flights among obstacles that the server does not know, judged by where they truly are.

Many more, through random worlds, are in `tests/bench/bench_worlds.py`.
"""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import MoverPath, Obstacle, RangeSensor, VehicleConfig, World
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.worlds.enclosures import PEN

pytestmark = pytest.mark.wide_but_first


RADIUS_M = 0.5
COPTER = VehicleConfig(ready_after_s=1.0, heading_deg=0.0)
PX4_COPTER = VehicleConfig(autopilot="px4", ready_after_s=1.0, heading_deg=0.0)
ROVER = VehicleConfig(vehicle="rover", ready_after_s=1.0, heading_deg=0.0)
SCANNER = RangeSensor(reach_m=8.0, noise_m=0.03)
GAP = (
    Obstacle("wall to the West", (8.0, -6.0), size_m=(0.3, 17.0), top_m=50.0),
    Obstacle("wall to the East", (8.0, 12.0), size_m=(0.3, 12.0), top_m=50.0),
)
"""3.5 m wide, aside of the straight way"""
POCKET = (
    Obstacle("back", (11.0, 0.0), size_m=(0.3, 8.0), top_m=50.0),
    Obstacle("side to the West", (9.0, -4.0), size_m=(4.0, 0.3), top_m=50.0),
    Obstacle("side to the East", (9.0, 4.0), size_m=(4.0, 0.3), top_m=50.0),
)
CART = (
    Obstacle(
        "cart", (7.0, -4.0), radius_m=0.7, top_m=2.0, path=MoverPath(((7.0, -4.0), (7.0, 6.0)), 0.7)
    ),
    Obstacle("crate", (7.0, 3.0), size_m=(1.0, 1.0), top_m=1.0),
)


def closest(flight: SimulatedFlight) -> float:
    nearest = flight.ground_truth.nearest
    assert nearest is not None
    return nearest.distance_m


@pytest.mark.wide
@pytest.mark.parametrize(
    ("vehicle", "obstacles", "north_m"),
    [
        pytest.param(COPTER, GAP, 16.0, id="copter through a gap"),
        pytest.param(PX4_COPTER, POCKET, 17.0, id="PX4 copter out of a pocket"),
        pytest.param(ROVER, CART, 14.0, id="rover past a cart that goes to and fro"),
    ],
)
def test_a_goal_is_reached_by_replanning_around_what_is_seen_on_the_way(
    vehicle: VehicleConfig, obstacles: tuple[Obstacle, ...], north_m: float
) -> None:
    world = World(obstacles=obstacles, range_sensor=SCANNER)
    flight = SimulatedFlight(1, vehicle, world).ready()
    flight.run_for(1.0)
    height_m = 0.0 if vehicle.vehicle == "rover" else 3.0
    goal_id = flight.start(flight.request(0.0, north_m, height_m, 2.5, avoid=True))
    end = flight.run_to_end(goal_id, 90.0)
    assert end.code.value == "SUCCESS", end.message
    assert closest(flight) >= RADIUS_M
    assert not flight.ground_truth.hits
    assert flight.feedback(goal_id)[-1].replans >= 1


def test_who_is_walled_in_is_blocked_says_so_and_ends_with_no_path() -> None:
    flight = SimulatedFlight(
        1,
        COPTER,
        World(obstacles=PEN, range_sensor=SCANNER),
        blocked_timeout_s=2.0,
        volume_altitude_max_m=6.0,
    ).ready()
    flight.run_for(1.0)
    goal_id = flight.start(flight.request(0.0, 12.0, 3.0, avoid=True))
    end = flight.run_to_end(goal_id, 60.0)
    assert end.code.value == "NO_PATH", end.message
    assert "BLOCKED" in {item.status.value for item in flight.feedback(goal_id)}
    assert closest(flight) >= RADIUS_M
    place, speed_m_s = flight.truth()
    assert math.hypot(*place[:2]) < 4.0
    assert place[2] > 1.5, "it holds in the air"
    assert speed_m_s < 0.3
