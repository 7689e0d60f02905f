"""A server that stands still for a while, or for good, while its vehicle flies among obstacles.

Judged by the simulator's truth: how near the vehicle comes to the obstacle.
"""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest

from mavlink_sitl import BatteryModel, Obstacle, RangeSensor, VehicleConfig, World, load_world
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


RADIUS_M = 0.5
SPEED_M_S = 3.0
FIRMWARES = ("ardupilot", "px4")
# A way through has to be found by two turns; north and east of the start.
YARD = World(
    name="yard",
    obstacles=(
        Obstacle("hoarding", (14.0, 3.0), size_m=(1.0, 14.0), bottom_m=-1.0, top_m=30.0),
        Obstacle("shed", (26.0, -6.0), size_m=(1.0, 16.0), bottom_m=-1.0, top_m=30.0),
        Obstacle("mast", (20.0, 8.0), radius_m=0.5, bottom_m=-1.0, top_m=30.0),
    ),
    range_sensor=RangeSensor(reach_m=12.0),
)
GOAL = (0.0, 38.0, 5.0)
DEMO_WORLD = Path(__file__).parents[2] / "bridge_config/worlds/demo.yaml"


def in_the_air(firmware: str, seed: int = 1) -> SimulatedFlight:
    vehicle = VehicleConfig(
        autopilot=firmware, ready_after_s=1.0, battery=BatteryModel(capacity_mah=60_000.0)
    )
    flight = SimulatedFlight(seed, vehicle, YARD).ready()
    flight.run_for(3.0)
    flight.run_to_end(flight.start(flight.request(0.0, 0.0, 5.0)))
    return flight


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("stopped_m", [4.0, 8.0, 12.0, 16.0, 22.0])
def test_a_server_that_dies_among_obstacles_leaves_a_vehicle_that_hits_none(
    firmware: str, stopped_m: float
) -> None:
    flight = in_the_air(firmware)
    flight.start(flight.request(*GOAL, speed=SPEED_M_S, avoid=True))
    flight.run_until(lambda: flight.truth()[0][1] >= stopped_m, 200.0)
    flight.stall(12.0)
    assert not flight.ground_truth.collided
    assert flight.ground_truth.nearest is not None
    assert flight.ground_truth.nearest.distance_m > RADIUS_M, flight.ground_truth.nearest


@pytest.mark.night
@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_server_that_is_stopped_and_continued_again_and_again_hits_nothing(
    firmware: str, seed: int
) -> None:
    flight, chance = in_the_air(firmware, seed), random.Random(seed)
    goal_id = flight.start(flight.request(*GOAL, speed=SPEED_M_S, avoid=True))
    stalls = 0
    while not flight.ends(goal_id) and flight.now < 300.0:
        flight.run_for(chance.uniform(1.0, 6.0))
        if not flight.ends(goal_id):
            flight.stall(chance.uniform(0.3, 2.0))
            stalls += 1
    assert not flight.ground_truth.collided
    assert flight.ground_truth.nearest is not None
    assert flight.ground_truth.nearest.distance_m > RADIUS_M, flight.ground_truth.nearest
    # It may have been given up: a PX4 leaves OFFBOARD after a second without setpoints.
    (end,) = flight.ends(goal_id)
    assert end.code.value in ("SUCCESS", "FAILSAFE_OFFBOARD"), end.message
    assert stalls >= 5 or end.code.value != "SUCCESS"


@pytest.mark.night
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_beside_what_moves_a_server_that_is_stopped_again_and_again_hits_nothing(seed: int) -> None:
    """The world of the demo, whose excavator and lift move all the time."""
    chance = random.Random(seed)
    vehicle = VehicleConfig(
        ready_after_s=1.0,
        battery=BatteryModel(capacity_mah=60_000.0),
        parameters={"GUID_TIMEOUT": 1.0},
    )
    flight = SimulatedFlight(seed, vehicle, load_world(DEMO_WORLD), obstacle_margin_m=1.5).ready()
    flight.run_for(chance.uniform(2.0, 17.0))
    for east, north in ((0, 0), (0, 18), (20, 18), (20, -10), (0, 0), (20, 18)):
        goal_id = flight.start(flight.request(east, north, 4.0, speed=2.5, avoid=True))
        while not flight.ends(goal_id):
            flight.run_for(chance.uniform(1.0, 8.0))
            if not flight.ends(goal_id):
                flight.stall(chance.uniform(0.3, 2.0))
        assert [end.code.value for end in flight.ends(goal_id)] == ["SUCCESS"]
        flight.run_for(0.5)
    assert not flight.ground_truth.collided
    assert flight.ground_truth.nearest is not None
    assert flight.ground_truth.nearest.distance_m > RADIUS_M, flight.ground_truth.nearest


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_who_is_late_is_slow_says_so_and_sends_no_acceleration(firmware: str) -> None:
    flight = in_the_air(firmware)
    goal_id = flight.start(flight.request(0.0, -60.0, 5.0, speed=SPEED_M_S))
    flight.run_for(4.0)
    assert flight.feedback(goal_id)[-1].late_s < 0.1
    flight.stall(0.7)
    begun_s = flight.now
    flight.run_for(2.0)
    assert flight.feedback(goal_id)[-1].late_s == pytest.approx(0.7, abs=0.06)
    assert flight.truth()[1] < 0.6 * SPEED_M_S
    sent = [
        message
        for time_s, message in flight.sent
        if time_s > begun_s and message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    ]
    assert len(sent) > 20
    # A PX4 is sent only the acceleration against its drag: at most in proportion to its speed.
    drag_per_s = 1.2 if firmware == "px4" else 0.0
    for m in sent:
        allowed = drag_per_s * math.hypot(m.vx, m.vy, m.vz) + 0.01
        assert math.hypot(m.afx, m.afy, m.afz) <= allowed
    assert any("late" in line.text for line in flight.log_lines())
    flight.run_for(6.0)
    assert flight.feedback(goal_id)[-1].late_s < 0.1
    assert flight.truth()[1] > 0.9 * SPEED_M_S
