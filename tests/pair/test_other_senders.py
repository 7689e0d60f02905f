"""Goals of a vehicle beside others that send HEARTBEAT before it."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import mavlink
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide_but_first


GENERIC = mavlink.MAV_AUTOPILOT_GENERIC


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("source", "kind"),
    [
        ((255, 1), mavlink.MAV_TYPE_GCS),
        ((1, 1), mavlink.MAV_TYPE_ONBOARD_CONTROLLER),
        ((1, 1), mavlink.MAV_TYPE_ADSB),
        ((9, 1), mavlink.MAV_TYPE_QUADROTOR),
        ((1, 1), mavlink.MAV_TYPE_GENERIC),
    ],
)
def test_a_goal_is_flown_beside_another_sender(
    autopilot: str, source: tuple[int, int], kind: int
) -> None:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    other = AutopilotMessages(*source)

    def speak() -> None:
        beat = other.heartbeat(mode=5, autopilot=GENERIC, vehicle_type=kind)
        flight.bridge.receive(beat, flight.now)

    for _ in range(3):
        speak()
        flight.run_for(0.1)
    flight.ready()
    goal = flight.send(0.0, 8.0, 3.0)
    for _ in range(200):
        if flight.ends(goal):
            break
        speak()
        flight.run_for(0.5)
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
