"""A ground station does its work through the server's router while the bridge flies.

The ground station is pymavlink's own connection, and the vehicle the simulator: real UDP.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from navigation_core.outcomes import OutcomeCode
from tests.support.flights.udp_flight import UdpFlight, udp_flight
from tests.support.stations.pymavlink_station import PymavlinkStation

pytestmark = pytest.mark.wide


SYSTEM, COMPONENT = 254, 190
A_PARAMETER = {"ardupilot": b"WPNAV_SPEED", "px4": b"MIS_TAKEOFF_ALT"}
REQUESTS = ["MISSION_REQUEST_INT", "MISSION_REQUEST"]
ITEMS = [(47.3977, 8.5456, 10.0), (47.3979, 8.5458, 12.0), (47.3981, 8.5456, 14.0)]


@pytest.fixture(scope="module", params=["ardupilot", "px4"])
def firmware(request: Any) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def flight(firmware: str) -> Iterator[UdpFlight]:
    with udp_flight("--autopilot", firmware) as flight:
        flight.end(flight.send(0.0, 0.0, 5.0))
        yield flight


@pytest.fixture
def station(flight: UdpFlight) -> Iterator[PymavlinkStation]:
    station = PymavlinkStation(flight.station_port, system=SYSTEM)
    station.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    yield station
    station.close()


def hear(station: PymavlinkStation, names: list[str], wanted: Callable[[Any], bool]) -> Any:
    """Wait for one message that is wanted among those of its kind."""
    for _ in range(200):
        message = station.hear(names)
        if wanted(message):
            return message
    raise AssertionError(f"200 times {names}, but not the one")


def answers_us(message: Any) -> bool:
    return bool((message.target_system, message.target_component) == (SYSTEM, COMPONENT))


def read_parameter(station: PymavlinkStation, name: bytes) -> None:
    """Ask until it is told, as ground stations do; a busy vehicle leaves a request out."""
    request = mav.MAVLink_param_request_read_message(1, 1, name, -1)
    for _ in range(20):
        station.send(request)
        answer = station.try_to_hear("PARAM_VALUE", 1.0)
        if answer is not None and answer.param_id.encode() == name:
            return
    raise AssertionError(f"{name!r} was not told")


def upload(station: PymavlinkStation) -> None:
    """Upload a mission; the first item is home on one firmware and a waypoint on the other."""
    station.send(mav.MAVLink_mission_count_message(1, 1, len(ITEMS)))
    sent: set[int] = set()
    while len(sent) < len(ITEMS):
        number = hear(station, REQUESTS, answers_us).seq
        latitude, longitude, altitude = ITEMS[number]
        place = (int(latitude * 1e7), int(longitude * 1e7), altitude)
        station.send(
            mav.MAVLink_mission_item_int_message(1, 1, number, 6, 16, 0, 1, 0, 0, 0, 0, *place)
        )
        sent.add(number)
    assert hear(station, ["MISSION_ACK"], answers_us).type == 0


def test_a_station_works_with_the_vehicle_while_the_bridge_flies(
    flight: UdpFlight, station: PymavlinkStation, firmware: str
) -> None:
    goal = flight.send(15.0, 0.0, 5.0)
    # Telemetry comes without having been asked for.
    assert station.hear("GLOBAL_POSITION_INT").get_srcSystem() == 1
    read_parameter(station, A_PARAMETER[firmware])
    upload(station)
    station.send(mav.MAVLink_mission_request_list_message(1, 1))
    assert hear(station, ["MISSION_COUNT"], answers_us).count == len(ITEMS)
    for number, (latitude, _, _) in enumerate(ITEMS[1:], 1):
        station.send(mav.MAVLink_mission_request_int_message(1, 1, number))
        item = hear(station, ["MISSION_ITEM_INT"], lambda m, n=number: m.seq == n)  # type: ignore[misc]
        assert item.x == pytest.approx(latitude * 1e7, abs=2)
    station.send(mav.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    ack = hear(station, ["COMMAND_ACK"], lambda m: m.command == 512 and m.get_srcSystem() == 1)
    assert (ack.result, answers_us(ack)) == (0, True)
    assert station.hear("AUTOPILOT_VERSION").get_srcSystem() == 1
    assert flight.on_thread(lambda: flight.bridge.goals.active_id) == goal
    end = flight.end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    counts = flight.counts()
    assert counts.forwarded > 0
    assert (counts.spoofed, counts.looped, counts.unrouted, counts.throttled) == (0, 0, 0, 0)


def test_a_station_of_mavlink_2_reaches_a_vehicle_of_mavlink_1(firmware: str) -> None:
    options = ("--autopilot", firmware, "--mavlink1", "only")
    with udp_flight(*options) as flight:
        flight.wait(lambda: flight.bridge.vehicle.state.speaks_mavlink_1, "MAVLink 1")
        station = PymavlinkStation(flight.station_port, system=SYSTEM)
        try:
            station.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            read_parameter(station, A_PARAMETER[firmware])
            upload(station)
        finally:
            station.close()
        assert flight.counts().beyond_mavlink_1 == 0
