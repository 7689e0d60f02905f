"""Somebody on the link who sends frames with the vehicle's ids while goals are flown."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Message, mavlink
from navigation_bridge.goals.requests import LandRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide_but_first

AUTOPILOTS = ["ardupilot", "px4"]


class LiedAbout:
    """A copter in the air, and who sends with its ids beside it."""

    def __init__(self, autopilot: str) -> None:
        simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
        self.flight = SimulatedFlight(simulated=simulated, battery_policy="ignore").ready()
        self.liar = AutopilotMessages()
        goal = self.flight.send(0.0, 12.0, 12.0)
        assert self.flight.run_to_end(goal, 100.0).code is OutcomeCode.SUCCESS

    def down(self) -> tuple[Message, ...]:
        """Return what a vehicle in the same mode sends that has landed."""
        state = self.flight.bridge.vehicle.state
        return (
            self.liar(
                "HEARTBEAT",
                type=state.vehicle_type,
                autopilot=state.autopilot,
                base_mode=state.base_mode & ~mavlink.MAV_MODE_FLAG_SAFETY_ARMED,
                custom_mode=state.custom_mode,
                system_status=mavlink.MAV_STATE_STANDBY,
            ),
            self.liar("EXTENDED_SYS_STATE", landed_state=mavlink.MAV_LANDED_STATE_ON_GROUND),
        )

    def lie_for(self, seconds: float, period_s: float, lies: slice = slice(None)) -> None:
        """Have it lied about for a while."""
        flight = self.flight
        end_s = flight.now + seconds
        while flight.now < end_s:
            for message in self.down()[lies]:
                flight.bridge.receive(message, flight.now)
            flight.run_for(period_s)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("period_s", [0.1, 0.7, 3.0])
def test_a_landing_does_not_succeed_in_the_air(autopilot: str, period_s: float) -> None:
    lied = LiedAbout(autopilot)
    flight = lied.flight
    goal = flight.start(LandRequest())
    flight.run_for(2.0)
    for _ in range(60):
        if flight.ends(goal) or flight.truth()[0][2] < 0.5:
            break
        lied.lie_for(0.1, period_s)
    for end in flight.ends(goal):
        assert end.code is not OutcomeCode.SUCCESS, (end.message, flight.truth())


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_no_goal_begins_while_reports_contradict_each_other(autopilot: str) -> None:
    lied = LiedAbout(autopilot)
    lied.lie_for(5.0, 0.3)
    flight = lied.flight
    flight.run_for(2.5)
    rejection = flight.check(flight.request(5.0, 5.0, 6.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.NO_POSITION, rejection.message
    assert "its reports contradict each other" in rejection.message
    flight.run_for(20.0)
    end = flight.run_to_end(flight.send(5.0, 5.0, 6.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


@pytest.mark.parametrize("ahead", [0, 60, 120, 200])
def test_a_sender_with_sequence_numbers_of_its_own_is_found_wherever_these_are(ahead: int) -> None:
    """Numbers behind the vehicle's make its HEARTBEATs look late, those ahead the vehicle's own."""
    lied = LiedAbout("ardupilot")
    flight = lied.flight
    for _ in range(ahead):
        lied.liar("SYSTEM_TIME")
    lied.lie_for(8.0, 0.7, slice(1))
    rejection = flight.check(flight.request(5.0, 5.0, 14.0))
    assert rejection is not None
    assert "its reports contradict each other" in rejection.message, rejection.message
