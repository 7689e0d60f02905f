"""Two autopilots with the same system id on one link."""

from __future__ import annotations

import pytest

from mavlink_sitl import GeoPoint, Simulation, VehicleConfig
from mavlink_vehicle.codec import Codec, Message, with_source
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.goal import GoalFinished, LogLine
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first

BESIDE = GeoPoint(-35.3638, 149.1654, 584.0)
PAIRS = [
    (("copter", "ardupilot"), ("copter", "ardupilot")),
    (("copter", "px4"), ("copter", "px4")),
    (("copter", "ardupilot"), ("copter", "px4")),
    (("copter", "px4"), ("rover", "ardupilot")),
]
# The first HEARTBEAT of one of the same kind shows a disarmed vehicle, or one that starts.
ENDS = {
    False: {OutcomeCode.DUPLICATE_VEHICLE},
    True: {OutcomeCode.DUPLICATE_VEHICLE, OutcomeCode.DISARMED, OutcomeCode.VEHICLE_REBOOTED},
}


class TwoOfOneId:
    """A vehicle whose server also hears another one of its id, which was switched on later."""

    def __init__(self, one: tuple[str, str], other: tuple[str, str]) -> None:
        self.flight = SimulatedFlight(simulated=VehicleConfig(*one, ready_after_s=1.0))
        second = VehicleConfig(*other, ready_after_s=1.0, home=BESIDE)
        self._other = Simulation(vehicles=[second], seed=2)
        self._codec = Codec(1, 191)
        self.flight.on_sent = self._other.link.write

    def run_for(self, seconds: float) -> None:
        """Continue with both."""
        for _ in range(round(100 * seconds)):
            self.flight.tick()
            self._other.run_for(0.01)
            for data in self._other.link.read_datagrams():
                for message in self._codec.decode(data):
                    self.flight.bridge.receive(message, self.flight.now)


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_a_goal_ends_when_a_second_autopilot_of_its_id_is_heard(
    one: tuple[str, str], other: tuple[str, str]
) -> None:
    two = TwoOfOneId(one, other)
    flight = two.flight
    flight.ready().run_for(15.0)
    goal = flight.send(0.0, 30.0, 5.0, speed=1.0)
    flight.run_to_status(goal, "NAVIGATING")
    before = flight.vehicle.profile
    two.run_for(5.0)
    (end,) = flight.ends(goal)
    assert end.code in ENDS[one == other], end.message
    rejection = flight.check(flight.request(0.0, 0.0, 5.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.DUPLICATE_VEHICLE
    assert flight.vehicle.profile is before
    assert sum("Two autopilots" in line.text for line in flight.all(LogLine)) <= 3
    # The other one is switched off.
    flight.run_for(20.0)
    later = flight.check(flight.request(0.0, 0.0, 5.0))
    assert later is None or later.code is not OutcomeCode.DUPLICATE_VEHICLE


@pytest.mark.parametrize(("one", "other"), PAIRS[:1])
def test_no_goal_is_accepted_while_two_autopilots_of_one_id_are_heard(
    one: tuple[str, str], other: tuple[str, str]
) -> None:
    two = TwoOfOneId(one, other)
    two.flight.ready().run_for(15.0)
    two.run_for(8.0)
    rejection = two.flight.check(two.flight.request(0.0, 8.0, 5.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.DUPLICATE_VEHICLE, rejection.message
    assert not two.flight.all(GoalFinished)
    for service, mode in ((Service.ARM, ""), (Service.SET_MODE, "LAND")):
        done = two.flight.serve(service, mode)
        assert not done.success
        assert "Two autopilots" in done.message


class Renumbered(Codec):
    """Reads the vehicle's messages with another system id."""

    def decode(self, data: bytes) -> list[Message]:
        return [with_source(message, 7, 1) for message in super().decode(data)]


def test_a_vehicle_that_changes_its_id_in_flight_is_lost_and_not_flown_by_another_name() -> None:
    flight = SimulatedFlight(link_lost_abort_s=4.0).ready()
    goal = flight.send(0.0, 60.0, 5.0, speed=1.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.codec = Renumbered(1, 191)
    end = flight.run_to_end(goal)
    assert end.code in (OutcomeCode.LINK_LOST, OutcomeCode.NO_POSITION), end.message
    flight.run_for(10.0)
    assert flight.vehicle.state.system_id == 1
    rejection = flight.check(flight.request(0.0, 0.0, 5.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.NO_VEHICLE


def test_another_kind_of_vehicle_that_takes_the_place_of_the_first_is_found() -> None:
    """The id is given to a rover, and the copter is switched off: nobody restarts the server."""
    two = TwoOfOneId(("copter", "ardupilot"), ("rover", "ardupilot"))
    flight = two.flight
    flight.ready().run_for(3.0)
    flight.link_up = False
    two.run_for(12.0)
    assert flight.vehicle.profile is not None
    assert flight.vehicle.profile.name == "ArduRover"
    assert not any("Two autopilots" in line.text for line in flight.all(LogLine))
