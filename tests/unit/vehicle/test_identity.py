"""The vehicle among all that sends HEARTBEAT."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.events import VehicleDiscovered
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.state.identity import NOT_VEHICLES
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.messages.autopilot_messages import AutopilotMessages

TYPES = [kind for kind in range(55) if kind != mavlink.MAV_TYPE_QUADROTOR]
AUTOPILOTS = range(23)
ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
GENERIC, INVALID = mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_AUTOPILOT_INVALID
SUB, TRACKER = mavlink.MAV_TYPE_SUBMARINE, mavlink.MAV_TYPE_ANTENNA_TRACKER
MAKE = AutopilotMessages()


def beat(
    kind: int, autopilot: int, source: tuple[int, int], *, armed: bool = False, mode: int = 0
) -> Message:
    message = MAKE.heartbeat(mode=mode, armed=armed, autopilot=autopilot, vehicle_type=kind)
    return with_source(message, *source)


def copter(autopilot: int = ARDUPILOT, system: int = 1, *, armed: bool = False) -> Message:
    return beat(mavlink.MAV_TYPE_QUADROTOR, autopilot, (system, 1), armed=armed, mode=4)


def others() -> Iterator[tuple[int, int]]:
    """All that is no better than a copter: no vehicle, or one that no goals are flown with."""
    for kind, autopilot in itertools.product(TYPES, AUTOPILOTS):
        profile = profile_for(autopilot, kind)
        if kind in NOT_VEHICLES or profile.control_mode is None or profile.unsupported:
            yield kind, autopilot


def found(vehicle: Vehicle) -> list[tuple[int, str]]:
    events = iter(vehicle.next_event, None)
    return [
        (event.system_id, event.profile_name)
        for event in events
        if isinstance(event, VehicleDiscovered)
    ]


SOURCES = [(1, 0), (1, 1), (1, 2), (1, 191), (7, 1), (255, 1), (255, 190)]


@pytest.mark.parametrize(
    ("source", "system"),
    [((1, 0), 0), ((1, 1), 0), ((1, 1), 1), ((1, 191), 0), ((255, 1), 0), ((255, 1), 1)],
)
def test_whatever_speaks_before_the_copter_the_copter_is_the_vehicle(
    source: tuple[int, int], system: int
) -> None:
    for kind, autopilot in others():
        vehicle = Vehicle(VehicleConfig(target_system=system))
        vehicle.start(0.0)
        vehicle.receive(beat(kind, autopilot, source), 1.0)
        vehicle.receive(copter(), 1.5)
        vehicle.receive(beat(kind, autopilot, source, mode=9, armed=True), 2.0)
        state = vehicle.state
        what = f"MAV_TYPE {kind}, MAV_AUTOPILOT {autopilot}"
        assert (state.system_id, state.component_id) == (1, 1), what
        assert vehicle.profile is profile_for(ARDUPILOT, mavlink.MAV_TYPE_QUADROTOR), what
        assert (state.custom_mode, state.armed) == (4, False), what
        assert found(vehicle)[-1] == (1, "ArduCopter"), what
        assert vehicle.address.target_system == 1


@pytest.mark.parametrize("armed", [False, True])
def test_whatever_speaks_after_the_copter_changes_nothing(armed: bool) -> None:
    vehicle = Vehicle()
    vehicle.start(0.0)
    vehicle.receive(copter(PX4, armed=armed), 1.0)
    before = vehicle.state
    for kind, autopilot in itertools.product(TYPES, AUTOPILOTS):
        for source in SOURCES:
            if source == (1, 1) and (kind, autopilot) not in set(others()):
                continue  # what is as good a vehicle and has its ids
            vehicle.receive(beat(kind, autopilot, source, mode=9, armed=not armed), 1.5)
            assert vehicle.state is before, (kind, autopilot, source)
    assert found(vehicle) == [(1, "PX4 multicopter")]


def test_who_is_no_vehicle_is_never_found() -> None:
    for kind, autopilot in itertools.product(range(55), AUTOPILOTS):
        if kind not in NOT_VEHICLES and autopilot != INVALID:
            continue
        for system in (0, 7):
            vehicle = Vehicle(VehicleConfig(target_system=system))
            vehicle.start(0.0)
            vehicle.receive(beat(kind, autopilot, (7, 1)), 1.0)
            assert vehicle.profile is None
            assert not vehicle.heartbeats.alive


def test_the_better_known_vehicle_replaces_the_other_with_all_that_is_known_of_it() -> None:
    vehicle = Vehicle()
    vehicle.start(0.0)
    vehicle.receive(beat(mavlink.MAV_TYPE_QUADROTOR, GENERIC, (9, 1)), 1.0)
    vehicle.receive(with_source(MAKE.position(50.0), 9, 1), 1.1)
    assert vehicle.state.global_position is not None
    assert not vehicle.intakes(9, 1)
    vehicle.receive(beat(SUB, ARDUPILOT, (8, 1)), 1.2)
    assert vehicle.state.global_position is None
    vehicle.receive(copter(system=3), 1.3)
    assert found(vehicle) == [(9, "generic autopilot"), (8, "ArduSub"), (3, "ArduCopter")]
    vehicle.messages_to_send()
    vehicle.handle_timer(2.0)
    targets = {
        message.target_system
        for message in vehicle.messages_to_send()
        if hasattr(message, "target_system")
    }
    assert targets == {3}
    assert vehicle.intakes(3, 1)
    vehicle.receive(copter(PX4, system=4), 2.1)
    assert vehicle.state.system_id == 3


def test_a_vehicle_that_flies_is_not_replaced_before_it_is_disarmed_or_silent() -> None:
    vehicle = Vehicle()
    vehicle.start(0.0)
    vehicle.receive(beat(SUB, ARDUPILOT, (8, 1), armed=True), 1.0)
    vehicle.receive(copter(), 1.1)
    assert vehicle.state.system_id == 8
    for tenths in range(12, 110):
        vehicle.handle_timer(0.1 * tenths)
    assert not vehicle.heartbeats.alive
    vehicle.receive(copter(), 11.1)
    assert vehicle.state.system_id == 1
    assert vehicle.heartbeats.alive
