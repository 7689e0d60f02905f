"""Corrupt, truncated and hostile packets never stop the simulator."""

from __future__ import annotations

import inspect
import math
import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation, VehicleConfig
from mavlink_sitl.mavlink.codec import Decoder
from sitl_support.ground_station import GUIDED, GroundStation, alive, copter, flying
from sitl_support.hostile_frames import extreme_setpoints, fields


@settings(max_examples=200, deadline=None)
@given(st.lists(st.binary(max_size=300), max_size=20))
def test_the_decoder_takes_any_bytes(pieces: list[bytes]) -> None:
    decoder = Decoder()
    for piece in pieces:
        decoder.feed(piece)
    decoder.reset()
    frame = bytes(mav.MAVLink_ping_message(1, 2, 3, 4).pack(mav.MAVLink(None, 255, 190)))
    assert [m.get_type() for m in decoder.feed(frame)] == ["PING"]


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=40), st.lists(st.integers(1, 30), max_size=30))
def test_frames_survive_garbage_around_them_and_any_cutting(noise: bytes, cuts: list[int]) -> None:
    noise = noise.replace(b"\xfd", b"").replace(b"\xfe", b"")
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    frames = [bytes(mav.MAVLink_ping_message(n, n, 3, 4).pack(out)) for n in range(4)]
    data = noise + noise.join(frames) + noise
    decoder = Decoder()
    messages = []
    for cut in [*cuts, len(data)]:
        messages += decoder.feed(data[:cut])
        data = data[cut:]
    assert [m.seq for m in messages] == [0, 1, 2, 3]


def test_a_truncated_datagram_does_not_swallow_the_next() -> None:
    station = copter()
    frame = station.pack(mav.MAVLink_command_long_message(1, 1, 31999, 0, 0, 0, 0, 0, 0, 0, 0))
    station.vehicle.link.write(frame[:-5])
    assert station.command(31999) == 3


def test_a_frame_in_pieces_is_whole_on_a_stream() -> None:
    station = copter()
    frame = station.pack(mav.MAVLink_command_long_message(1, 1, 31999, 0, 0, 0, 0, 0, 0, 0, 0))
    for byte in frame:
        station.vehicle.link.write(bytes([byte]), datagram=False)
    assert [m.get_type() for m in station.read()] == ["COMMAND_ACK"]


def test_a_signed_frame_is_understood() -> None:
    station = copter()
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    out.signing.secret_key = bytes(range(32))
    out.signing.sign_outgoing = True
    out.signing.timestamp = 1
    message = mav.MAVLink_command_long_message(1, 1, 31999, 0, 0, 0, 0, 0, 0, 0, 0)
    station.vehicle.link.write(bytes(message.pack(out)))
    assert [m.get_type() for m in station.read()] == ["COMMAND_ACK"]


def mutated(frames: list[bytes], rng: random.Random) -> bytes:
    """A frame that is cut, doubled, bent or replaced by noise."""
    frame = bytearray(rng.choice(frames))
    kind = rng.randrange(5)
    if kind == 0:
        frame = frame[: rng.randrange(len(frame))]
    elif kind == 1:
        for _ in range(rng.randint(1, 4)):
            frame[rng.randrange(len(frame))] = rng.randrange(256)
    elif kind == 2:
        frame = frame + frame[rng.randrange(len(frame)) :]
    elif kind == 3:
        frame = bytearray(rng.randbytes(rng.randrange(64)))
    else:
        frame[0] = rng.choice([0xFD, 0xFE])
    return bytes(frame)


def test_20_000_mutated_frames_in_flight() -> None:
    station = flying(5.0)
    frames = [
        station.pack(mav.MAVLink_command_long_message(1, 1, 176, 0, 1, 4, 0, 0, 0, 0, 0)),
        station.pack(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)),
        station.pack(mav.MAVLink_param_request_list_message(1, 1)),
        station.pack(mav.MAVLink_request_data_stream_message(1, 1, 0, 50, 1)),
    ]
    rng = random.Random(1)
    for number in range(20_000):
        station.vehicle.link.write(mutated(frames, rng))
        if number % 200 == 0:
            station.simulation.run_for(0.01)
            station.vehicle.link.read()
    alive(station)


EXTREMES = (math.nan, math.inf, -math.inf, 3.4028234e38, -3.4028234e38, 1e-45, -0.0, 0.0, 1.0)


def extreme_payload(message: type, rng: random.Random) -> bytes:
    """The largest payload of a message with extreme numbers in it."""
    unpacker: struct.Struct = message.unpacker  # type: ignore[attr-defined]
    values: list[object] = []
    for count, code in fields(unpacker.format):
        if code == "s":
            values.append(rng.randbytes(count))
            continue
        if code == "c":
            values += [rng.randbytes(1) for _ in range(count)]
            continue
        for _ in range(count):
            if code in "fd":
                values.append(rng.choice(EXTREMES))
            else:
                bits = 8 * struct.calcsize(code)
                low = 0 if code.isupper() else -(2 ** (bits - 1))
                values.append(rng.choice([low, low + 2**bits - 1, 0, 1, 42]))
    return unpacker.pack(*values)


MESSAGES = [
    kind
    for name, kind in sorted(inspect.getmembers(mav, inspect.isclass))
    if name.startswith("MAVLink_") and name.endswith("_message") and name != "MAVLink_message"
]


def frame_of(message: type, payload: bytes) -> bytes:
    """A frame with a right checksum around any payload."""
    number: int = message.id  # type: ignore[attr-defined]
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 255, 190, number & 0xFFFF, number >> 16)
    check = mav.x25crc(head + payload)
    check.accumulate(bytes([message.crc_extra]))  # type: ignore[attr-defined]
    return b"\xfd" + head + payload + struct.pack("<H", check.crc)


@pytest.mark.parametrize("airborne", [False, True])
def test_every_message_of_the_dialect_with_extreme_fields(airborne: bool) -> None:
    station = flying(5.0) if airborne else copter().ready()
    rng = random.Random(2)
    assert len(MESSAGES) > 250
    for kind in MESSAGES:
        for _ in range(2 if airborne else 1):
            payload = bytearray(extreme_payload(kind, rng))
            # Address it to the vehicle where it has an address.
            names = kind.ordered_fieldnames if hasattr(kind, "ordered_fieldnames") else ()
            if "target_system" in names:
                offset = _offset(kind, "target_system")
                payload[offset] = 1
            station.vehicle.link.write(frame_of(kind, bytes(payload)))
        station.simulation.run_for(0.01)
        station.vehicle.link.read()
    alive(station)


def _offset(kind: type, name: str) -> int:
    names = list(kind.ordered_fieldnames)  # type: ignore[attr-defined]
    layout = fields(kind.unpacker.format)  # type: ignore[attr-defined]
    sizes = [count * struct.calcsize(code) for count, code in layout]
    return sum(sizes[: names.index(name)])


COMMANDS = (16, 17, 20, 21, 22, 176, 178, 179, 185, 192, 300, 401, 410, 510, 511, 512, 520)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_known_command_with_extreme_parameters(command: int) -> None:
    station = flying(5.0)
    rng = random.Random(command)
    for _ in range(150):
        values = [rng.choice((*EXTREMES, 4.0, 9.0, 33.0)) for _ in range(7)]
        if rng.random() < 0.5:
            message = mav.MAVLink_command_long_message(1, 1, command, 0, *values)
        else:
            x, y = (rng.choice([-(2**31), 2**31 - 1, 0, 490000000]) for _ in range(2))
            frame = rng.choice([0, 3, 5, 6, 10, 11, 255])
            message = mav.MAVLink_command_int_message(
                1, 1, frame, command, 0, 0, *values[:4], x, y, values[6]
            )
        answers = station.send(message)
        assert [m.get_type() for m in answers].count("COMMAND_ACK") == 1
        station.simulation.run_for(0.02)
    alive(station)


def test_setpoints_with_extreme_fields_in_every_frame_and_mask() -> None:
    station = flying(5.0)
    numbers, kinds = (*EXTREMES, 1e9, -1e9, 5.0), (0, 1, 3, 5, 6, 7, 8, 9, 11, 12)
    places = (-(2**31), 2**31 - 1, 0, -353632610)
    for message in extreme_setpoints(numbers, kinds, places):
        station.vehicle.link.write(station.pack(message))
        station.simulation.run_for(0.02)
        station.vehicle.link.read()
    alive(station)


@pytest.mark.parametrize("parameter", ["WPNAV_SPEED", "PSC_JERK_XY", "LAND_SPEED", "WPNAV_JERK"])
@pytest.mark.parametrize("value", [0.0, -1e9, 1e9, 3.4e38, 1e-40])
def test_absurd_parameters_do_not_stop_a_flight(parameter: str, value: float) -> None:
    station = flying(5.0)
    station.send(mav.MAVLink_param_set_message(1, 1, parameter.encode(), value, 9))
    station.setpoint(0xDF8, (20.0, 0.0, -8.0))
    station.run(3.0)
    for mode in (5, 6, 9, GUIDED):
        station.mode(mode)
        station.run(1.0)
    alive(station)


def test_a_flood_of_messages_does_not_grow_the_answers() -> None:
    """A list of parameters asked for a thousand times is sent once at a time."""
    simulation = Simulation([VehicleConfig(ready_after_s=1.0)])
    station = GroundStation(simulation)
    for _ in range(1000):
        station.send(mav.MAVLink_param_request_list_message(1, 1))
    station.run(2.0)
    values = station.messages("PARAM_VALUE")
    assert len(values) <= 2 * values[0].param_count
