"""Messages with another clock, and restarts, while a goal is flown."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


AUTOPILOTS = ["ardupilot", "px4"]


def in_flight(autopilot: str) -> tuple[SimulatedFlight, str]:
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0), battery_policy="ignore"
    ).ready()
    flight.run_for(5.0)
    goal = flight.send(0.0, 25.0, 5.0, speed=4.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(2.0)
    return flight, goal


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("time_boot_ms", [0, 1500, 3_000_000_000])
@pytest.mark.parametrize("kind", ["ATTITUDE", "SYSTEM_TIME", "LOCAL_POSITION_NED"])
def test_a_message_of_another_clock_does_not_end_a_goal(
    autopilot: str, time_boot_ms: int, kind: str
) -> None:
    flight, goal = in_flight(autopilot)
    sender, receiver = Codec(1, 1), Codec(1, 191)
    for _ in range(3):
        state = flight.vehicle.state
        fields = {}
        if kind == "LOCAL_POSITION_NED" and state.local_position is not None:
            x, y, z = state.local_position.position_ned_m
            fields = {"x": x, "y": y, "z": z}
        elif kind == "ATTITUDE" and state.attitude is not None:
            fields = {"yaw": state.attitude.yaw_ned_rad}
        message = make(kind, time_boot_ms=time_boot_ms, **fields)
        for odd in receiver.decode(sender.encode(message)):
            flight.bridge.receive(odd, flight.now)
        flight.run_for(0.5)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.vehicle.state.boot_count == 0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_restart_in_flight_ends_the_goal_within_three_seconds(autopilot: str) -> None:
    flight, goal = in_flight(autopilot)
    flight.simulation.vehicles[0].power_cycle()
    began_s = flight.now
    flight.run_until(lambda: bool(flight.ends(goal)), 5.0)
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.VEHICLE_REBOOTED, end.message
    assert flight.now - began_s < 3.0
    flight.run_for(20.0)
    assert flight.vehicle.state.boot_count == 1
