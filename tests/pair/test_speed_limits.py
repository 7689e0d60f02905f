"""Vehicles keep to the speeds that their goal allows: over ground, up and down."""

from __future__ import annotations

import math
import statistics

import pytest

from mavlink_sitl import VehicleConfig
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


MEDIAN, PEAK = 1.03, 1.08
# East, north and up in metres, and max_speed in m/s; 0 is the server's usual speed.
GOALS = (
    (0.0, 25.0, 3.0, 1.5), (0.0, -15.0, 3.0, 3.0), (20.0, 10.0, 3.0, 2.0), (20.0, -30.0, 3.0, 0.0),
    (20.0, -30.0, 15.0, 0.0), (20.0, -30.0, 3.0, 0.0), (20.0, -30.0, 9.0, 1.0),
    (20.0, -30.0, 4.0, 0.8), (0.0, 0.0, 20.0, 0.0),
)  # fmt: skip


def excess(flight: SimulatedFlight, goal: tuple[float, ...]) -> float:
    """Fly a goal; return the greatest true speed as a share of what it allows, in any direction."""
    x, y, z, speed_m_s = goal
    limits = flight.config.bridge.goto.limits.with_speed(speed_m_s)
    goal_id = flight.send(x, y, z, speed_m_s)
    greatest = 0.0
    while not flight.ends(goal_id):
        flight.tick()
        north, east, down = (float(v) for v in flight.simulation.truth.velocity_ned_m_s[0])
        greatest = max(
            greatest,
            math.hypot(north, east) / limits.speed_horizontal_m_s,
            -down / limits.speed_up_m_s,
            down / limits.speed_down_m_s,
        )
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    return greatest


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_no_goal_is_flown_faster_than_it_allows(autopilot: str) -> None:
    simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=simulated, battery_policy="ignore").ready()
    flight.fly_up()
    found = [excess(flight, goal) for goal in GOALS]
    assert statistics.median(found) <= MEDIAN, found
    assert max(found) <= PEAK, found
