"""Goals of a vehicle with several batteries."""

from __future__ import annotations

import pytest

from mavlink_sitl import FurtherBattery, VehicleConfig
from navigation_bridge.goals.requests import LandRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


CRITICAL, PAYLOAD = 3, 4
AUTOPILOTS = ["ardupilot", "px4"]


def flight_of(autopilot: str) -> SimulatedFlight:
    # The battery of PX4's simulator is as good as full for the time of a test.
    parameters = {"SIM_BAT_DRAIN": 3600.0} if autopilot == "px4" else {}
    simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, parameters=parameters)
    return SimulatedFlight(simulated=simulated).ready()


def report(flight: SimulatedFlight, battery: FurtherBattery) -> None:
    flight.simulation.vehicles[0].set_further_battery(battery)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("charge_state", [1, CRITICAL])
def test_a_second_battery_that_is_nearly_empty_rejects_a_goal(
    autopilot: str, charge_state: int
) -> None:
    flight = flight_of(autopilot)
    assert flight.check(flight.request(0.0, 20.0, 5.0)) is None
    report(flight, FurtherBattery(1, 4, charge_state))
    flight.run_for(5.0)
    rejection = flight.check(flight.request(0.0, 20.0, 5.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.LOW_BATTERY
    assert ("number 1" in rejection.message) is (charge_state == CRITICAL)
    flight.simulation.vehicles[0].remove_further_battery(1)
    flight.run_for(20.0)
    assert flight.check(flight.request(0.0, 20.0, 5.0)) is None


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(
    ("percent", "code"),
    [(4, OutcomeCode.LOW_BATTERY), (85, OutcomeCode.FAILSAFE_BATTERY)],
)
def test_a_second_battery_ends_a_goal_and_shows_in_its_feedback(
    autopilot: str, percent: int, code: OutcomeCode
) -> None:
    flight = flight_of(autopilot)
    report(flight, FurtherBattery(1, 90))
    goal = flight.send(0.0, 200.0, 5.0)
    flight.run_to_status(goal, "NAVIGATING")
    report(flight, FurtherBattery(1, percent, CRITICAL))
    end = flight.run_to_end(goal, 30.0)
    assert end.code is code, end.message
    assert flight.feedback(goal)[-1].battery_remaining == pytest.approx(percent / 100)
    assert flight.run_to_end(flight.start(LandRequest())).code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_an_empty_payload_battery_stops_nothing(autopilot: str) -> None:
    flight = flight_of(autopilot)
    report(flight, FurtherBattery(1, 0, CRITICAL, PAYLOAD))
    flight.run_for(5.0)
    end = flight.run_to_end(flight.send(0.0, 20.0, 5.0))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.feedback(end.goal_id)[-1].battery_remaining > 0.5  # type: ignore[operator]
