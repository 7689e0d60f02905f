"""Vehicles that hit each other, where that is switched on."""

from __future__ import annotations

import pytest

from mavlink_sitl.config import Underway, VehicleConfig
from mavlink_sitl.simulation import Simulation


def head_on(collisions: bool, up_m: float = 5.0) -> Simulation:
    """Return two copters that fly towards each other, the second at a height."""
    ways = (((-3.0, 0.0, -5.0), (4.0, 0.0, 0.0)), ((3.0, 0.0, -up_m), (-4.0, 0.0, 0.0)))
    vehicles = [
        VehicleConfig(ready_after_s=0.5, underway=Underway(place, velocity))
        for place, velocity in ways
    ]
    simulation = Simulation(vehicles, collisions=collisions)
    simulation.run_for(8.0)
    return simulation


def test_two_that_meet_crash_and_say_into_whom() -> None:
    simulation = head_on(collisions=True)
    assert simulation.truth.collided.all()
    assert all(simulation.truth.on_ground)


@pytest.mark.parametrize(("collisions", "up_m"), [(False, 5.0), (True, 7.0)])
def test_switched_off_or_above_each_other_they_pass(collisions: bool, up_m: float) -> None:
    assert not head_on(collisions, up_m).truth.collided.any()


def test_who_stands_beside_another_on_the_ground_does_not_hit_it() -> None:
    simulation = Simulation([VehicleConfig(), VehicleConfig()], collisions=True)
    simulation.run_for(3.0)
    assert not simulation.truth.collided.any()


def test_positions_are_in_one_frame() -> None:
    simulation = Simulation([VehicleConfig(), VehicleConfig(autopilot="px4")])
    simulation.run_for(1.0)
    first, second = simulation.positions_ned_m
    assert first == pytest.approx(second, abs=0.01)
