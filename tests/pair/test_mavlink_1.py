"""Vehicles that speak MAVLink 1: only, to send, or until they hear MAVLink 2."""

from __future__ import annotations

import struct

import pytest
from pymavlink.dialects.v20 import all as mavlink
from pymavlink.generator import mavcrc

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import MAVLINK_1_HEARTBEATS, Codec, make
from mavlink_vehicle.message_layout import MessageLayout
from mavlink_vehicle.mission_items import MissionType
from navigation_bridge.goals.goal import LogLine
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import LandRequest, NavigateRequest, TakeoffRequest
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


FORMATS = {
    "char": "c", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I",
    "int32_t": "i", "uint64_t": "Q", "int64_t": "q", "float": "f", "double": "d",
}  # fmt: skip
AUTOPILOTS = ("ardupilot", "px4")


def flight_of(autopilot: str, mavlink_1: str) -> tuple[SimulatedFlight, list[bytes]]:
    flight = SimulatedFlight(
        simulated=VehicleConfig(ready_after_s=1.0, autopilot=autopilot, mavlink_1=mavlink_1)
    )
    frames: list[bytes] = []
    flight.on_sent = frames.append
    return flight, frames


def lines(flight: SimulatedFlight) -> list[str]:
    return [output.text for _, output in flight.outputs if isinstance(output, LogLine)]


@pytest.mark.parametrize("mavlink_1", ["only", "sends"])
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_vehicle_of_mavlink_1_is_flown(autopilot: str, mavlink_1: str) -> None:
    flight, frames = flight_of(autopilot, mavlink_1)
    flight.run_until(lambda: flight.vehicle.state.position_valid, 40.0)
    flight.run_for(8.0)
    for request in (
        TakeoffRequest(height_m=5.0),
        NavigateRequest("map", (15.0, 5.0, 6.0), (0.0, 0.0, 0.0, 0.0), False, 3.0),
        LandRequest(),
    ):
        end = flight.run_to_end(flight.start(request))
        assert end.state is GoalState.SUCCEEDED, end.message
    assert {frame[0] for frame in frames[-50:]} >= {0xFE}
    assert any("speaks MAVLink 1 only" in text for text in lines(flight))
    for kind in (MissionType.FENCE, MissionType.RALLY):
        why = flight.vehicle.storage.read_list(kind, flight.now)
        assert why is not None
        assert "SERIALn_PROTOCOL 2" in why


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_vehicle_that_changes_to_mavlink_2_is_spoken_to_so(autopilot: str) -> None:
    flight, frames = flight_of(autopilot, "begins")
    flight.run_until(lambda: flight.vehicle.state.position_valid, 40.0)
    flight.run_for(10.0)
    assert {frame[0] for frame in frames} == {0xFD}
    assert not flight.vehicle.state.speaks_mavlink_1
    assert not any("MAVLink" in text for text in lines(flight))


def heartbeat_1(sequence: int) -> bytes:
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    sender.seq = sequence
    frame: bytes = sender.heartbeat_encode(2, 3, 0, 0, 3).pack(sender, force_mavlink1=True)
    return frame


def test_what_does_not_fit_into_mavlink_1_stays_mavlink_2() -> None:
    codec = Codec(1, 191)
    count = make("MISSION_COUNT", target_system=1, count=3)
    assert codec.encode(count)[0] == 0xFD
    for sequence in range(MAVLINK_1_HEARTBEATS):
        assert not codec.speaks_1
        codec.decode(heartbeat_1(sequence))
    assert codec.speaks_1
    assert codec.encode(count)[:2] == bytes((0xFE, 4))
    assert codec.encode(make("MISSION_COUNT", mission_type=1))[0] == 0xFD
    assert codec.encode(make("ODOMETRY"))[0] == 0xFD
    own = [codec.encode(make("HEARTBEAT"))[0] for _ in range(8)]
    assert own.count(0xFD) == 2
    assert Codec(1, 1).decode(codec.encode(make("HEARTBEAT", type=6)))[0].type == 6
    codec.decode(Codec(1, 1).encode(make("HEARTBEAT")))
    assert not codec.speaks_1
    assert codec.encode(count)[0] == 0xFD


def test_the_base_of_every_message_is_what_its_checksum_is_made_of() -> None:
    """CRC_EXTRA covers the fields without extensions (mavlink.io, "Serialization")."""
    for cls in mavlink.mavlink_map.values():
        types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
        crc = mavcrc.x25crc()
        crc.accumulate_str(cls.msgname + " ")
        layout = MessageLayout(cls)
        left = layout.base_size
        for name, length in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True):
            size = struct.calcsize(f"<{FORMATS[types[name]]}") * max(length, 1)
            if left < size:
                break
            left -= size
            crc.accumulate_str(f"{types[name]} ")
            crc.accumulate_str(f"{name} ")
            if length:
                crc.accumulate([length])
        assert left == 0
        assert (crc.crc & 0xFF) ^ (crc.crc >> 8) == cls.crc_extra, cls.msgname
