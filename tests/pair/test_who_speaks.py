"""Every MAV_TYPE with every MAV_AUTOPILOT on every component id, beside a vehicle."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Message, with_source
from mavlink_vehicle.profiles import vehicle_rank
from navigation_bridge.goals.goal import LogLine
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide_but_first

AUTOPILOTS = ["ardupilot", "px4"]
KINDS = list(itertools.product(range(55), range(23)))
"""All of MAV_TYPE and MAV_AUTOPILOT, and some beyond their ends"""


def made() -> list[Message]:
    """Return a HEARTBEAT of each kind, armed or not, in another mode, in a failsafe."""
    make = AutopilotMessages()
    return [
        make.heartbeat(
            mode=9, armed=bool(kind % 2), autopilot=autopilot, vehicle_type=kind, status=5
        )
        for kind, autopilot in KINDS
    ]


def rank_of(message: Message) -> int:
    return vehicle_rank(message.autopilot, message.type)


def others(rank: int = 3) -> Iterator[list[Message]]:
    """All that is not the vehicle: by its component, its system or its kind, up to a rank."""
    messages = [message for message in made() if rank_of(message) <= rank]
    for component in range(256):
        if component != 1:
            yield [with_source(message, 1, component) for message in messages]
    for system, component in itertools.product((2, 66, 255), (1, 190)):
        yield [with_source(message, system, component) for message in messages]
    yield [with_source(message, 1, 1) for message in messages if rank_of(message) < 3]


def known(flight: SimulatedFlight) -> tuple[object, ...]:
    state = flight.vehicle.state
    ids = state.system_id, state.component_id, state.autopilot, state.vehicle_type
    return (*ids, flight.vehicle.profile, flight.vehicle.address)


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_nobody_who_speaks_beside_the_vehicle_touches_its_goal(autopilot: str) -> None:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    flight.ready().run_for(3.0)
    before = known(flight)
    goal = flight.send(0.0, 20.0, 5.0, speed=1.0)
    flight.run_to_status(goal, "NAVIGATING")
    lines = len(flight.all(LogLine))
    for heard in others():
        for message in heard:
            flight.bridge.receive(message, flight.now)
        flight.tick()
        assert known(flight) == before
        assert flight.vehicle.in_control_mode
    flight.run_for(1.0)
    assert not any("mode" in line.text.lower() for line in flight.all(LogLine)[lines:])
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert known(flight) == before
    assert not flight.check(flight.request(0.0, 0.0, 5.0))


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("system", [0, 1])
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_nobody_who_speaks_before_the_vehicle_is_taken_for_it(autopilot: str, system: int) -> None:
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0), target_system=system
    )
    for heard in others(3 if system else 2):
        for message in heard:
            flight.bridge.receive(message, flight.now)
        assert flight.vehicle.rank < 3
    assert flight.check(flight.request(0.0, 8.0, 3.0)) is not None
    # Those of other kinds with its ids count as a second autopilot until they have been silent.
    flight.ready().run_for(12.0)
    end = flight.run_to_end(flight.send(0.0, 8.0, 3.0))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.vehicle.state.system_id == 1
