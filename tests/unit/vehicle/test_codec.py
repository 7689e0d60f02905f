from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, make, mavlink, message_id, with_source
from mavlink_vehicle.errors import MessageError
from mavlink_vehicle.message_layout import FrameHeader
from tests.support.messages.random_messages import CLASSES, random_message


def pack(message: Any, *, version: int = 2, system: int = 1) -> bytes:
    packer = mavlink.MAVLink(None, srcSystem=system, srcComponent=1)
    packer.seq = 7
    return bytes(message.pack(packer, force_mavlink1=version == 1))


# The same in all messages of a class; `_payload`, the raw payload, is set nowhere.
_OF_CLASS = (
    "_fieldnames", "_type", "_signed", "_link_id", "_instances", "_instance_field",
    "_instance_offset",
)  # fmt: skip


def attributes(message: Any) -> dict[str, Any]:
    """Everything in a message that pymavlink's own decoder sets, in a form to compare."""
    found: dict[str, Any] = {name: getattr(message, name) for name in _OF_CLASS}
    found |= vars(message)
    found.pop("_payload", None)  # its extent is not the same in MAVLink 1
    found["_msgbuf"] = bytes(found["_msgbuf"])
    found["_header"] = {name: getattr(found["_header"], name) for name in FrameHeader._fields}
    return found


def test_every_message_decodes_as_pymavlink_does() -> None:
    for cls in CLASSES:
        for seed in range(3):
            for version in (2, 1) if cls.id < 256 else (2,):
                frame = pack(random_message(cls, seed), version=version)
                expected = mavlink.MAVLink(None).decode(bytearray(frame))
                (decoded,) = Codec(255, 190).decode(frame)
                assert type(decoded) is type(expected), cls.msgname
                assert repr(sorted(attributes(decoded).items())) == repr(
                    sorted(attributes(expected).items())
                ), cls.msgname


def test_every_message_can_be_made_of_nothing_and_comes_back() -> None:
    for cls in CLASSES:
        (decoded,) = Codec(1, 1).decode(Codec(1, 191).encode(make(cls.msgname)))
        for name in cls.fieldnames:
            value = getattr(decoded, name)
            assert value in (0, "", 0.0) or set(value) == {0}, (cls.msgname, name)


def test_make_fills_in_zeros_and_keeps_what_is_given() -> None:
    message = make("COMMAND_LONG", command=400, param1=1.0, param7=math.nan)
    assert (message.command, message.param1, message.param2) == (400, 1.0, 0)
    assert math.isnan(message.param7)
    assert make("STATUSTEXT", text="hello").text == "hello"
    assert make("BATTERY_STATUS").voltages == [0] * 10


@pytest.mark.parametrize(
    ("name", "fields", "words"),
    [
        ("HEARTBEET", {}, "no MAVLink message 'HEARTBEET'"),
        ("HEARTBEAT", {"typ": 1}, "has no field typ; its fields are type"),
        ("HEARTBEAT", {"type": 256}, "cannot hold"),
        ("HEARTBEAT", {"type": "two"}, "cannot hold"),
        ("STATUSTEXT", {"text": "x" * 51}, "holds 50 bytes, not 51"),
        ("BATTERY_STATUS", {"voltages": [1, 2]}, "has 10 elements, not 2"),
    ],
)
def test_make_rejects_with_a_sentence(name: str, fields: dict[str, Any], words: str) -> None:
    with pytest.raises(MessageError, match=words):
        make(name, **fields)


def test_message_ids_go_by_name() -> None:
    assert message_id("GLOBAL_POSITION_INT") == 33
    with pytest.raises(MessageError):
        message_id("NOPE")


def test_ids_outside_mavlink_are_rejected() -> None:
    with pytest.raises(MessageError, match="system id is 1 to 255, not 0"):
        Codec(0, 1)
    with pytest.raises(MessageError, match="component id is 1 to 255, not 256"):
        Codec(1, 256)


def test_each_source_counts_its_own_sequence() -> None:
    codec, reader = Codec(1, 191), Codec(255, 190)
    frames = [codec.encode(make("HEARTBEAT")) for _ in range(257)]
    frames.append(codec.encode(with_source(make("HEARTBEAT"), 5, 6)))
    headers = [reader.decode(frame)[0].get_header() for frame in frames]
    assert [h.seq for h in headers] == [*range(256), 0, 0]
    assert (headers[0].srcSystem, headers[0].srcComponent) == (1, 191)
    assert (headers[-1].srcSystem, headers[-1].srcComponent) == (5, 6)
    assert reader.statistics.frames == 258
    assert reader.statistics.lost_total == 0


def test_an_altered_message_that_cannot_be_encoded_is_an_error() -> None:
    message = make("HEARTBEAT")
    message.type = 1000
    with pytest.raises(MessageError, match="HEARTBEAT cannot be encoded"):
        Codec(1, 191).encode(message)


def test_lost_late_and_doubled_frames_are_told_apart() -> None:
    writer, reader = Codec(1, 1), Codec(255, 190)
    frames = [writer.encode(make("HEARTBEAT")) for _ in range(10)]
    for number in (0, 1, 4, 3, 4, 5, 9):
        reader.decode(frames[number])
    assert reader.statistics.lost == {(1, 1): 2 + 3}


def test_truncated_and_extended_payloads_decode() -> None:
    """A newer dialect appends fields; an older one, and MAVLink 2, cut zeros off."""
    frame = Codec(1, 1).encode(make("SYS_STATUS", voltage_battery=12600))
    assert frame[1] < mavlink.MAVLink_sys_status_message.unpacker.size
    (message,) = Codec(1, 191).decode(frame)
    assert message.voltage_battery == 12600
    assert message.onboard_control_sensors_health_extended == 0

    full = mavlink.MAVLink_heartbeat_message(2, 3, 81, 4, 3, 3)
    payload = full.unpacker.pack(4, 2, 3, 81, 3, 3) + b"\x01\x02\x03\x04"
    extended = frame_of(0, payload, full.crc_extra)
    (message,) = Codec(1, 191).decode(extended)
    assert (message.custom_mode, message.mavlink_version) == (4, 3)


def frame_of(number: int, payload: bytes, crc_extra: int, flags: int = 0) -> bytes:
    header = bytes([0xFD, len(payload), flags, 0, 0, 1, 1]) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header[1:] + payload + bytes([crc_extra])).crc
    return bytes(header + payload + crc.to_bytes(2, "little"))


def test_messages_that_the_dialect_lacks_pass_by_unharmed() -> None:
    observed: list[bytes] = []
    codec = Codec(1, 191)
    codec.frame_observer = observed.append
    unknown = frame_of(54321, b"\xfd\xfe\xfd payload", 0)
    known = Codec(1, 1).encode(make("HEARTBEAT", type=2))
    messages = codec.decode(known + unknown + known)
    assert [message.type for message in messages] == [2, 2]
    assert codec.statistics.unknown == 1
    assert codec.statistics.bytes_dropped == 0
    assert observed == [known, unknown, known]


def test_signed_frames_decode_and_other_flags_are_dropped() -> None:
    crc_extra = mavlink.MAVLink_heartbeat_message.crc_extra
    payload = bytes(9)
    known = Codec(1, 1).encode(make("HEARTBEAT", type=2))
    codec = Codec(1, 191)
    signed = frame_of(0, payload, crc_extra, flags=1) + bytes(13)
    assert len(codec.decode(signed + known)) == 2
    strange = frame_of(0, payload, crc_extra, flags=2)
    assert [message.type for message in codec.decode(strange + known)] == [2]


def test_a_damaged_datagram_does_not_harm_the_next_one() -> None:
    writer = Codec(1, 1)
    frames = [writer.encode(make("ATTITUDE", roll=float(n), yawspeed=1.0)) for n in range(3)]
    codec = Codec(1, 191)
    assert codec.decode(frames[0][:-5]) == []
    assert [message.roll for message in codec.decode(frames[1])] == [1.0]
    assert codec.decode(bytes([0xFD, 255, 0])) == []  # promises more than it holds
    assert [message.roll for message in codec.decode(frames[2])] == [2.0]


def test_a_damaged_frame_is_counted_and_what_follows_is_found() -> None:
    writer = Codec(1, 1)
    first = bytearray(writer.encode(make("ATTITUDE", roll=1.0, yawspeed=1.0)))
    first[12] ^= 0x40
    second = writer.encode(make("ATTITUDE", roll=2.0, yawspeed=1.0))
    codec = Codec(1, 191)
    assert [message.roll for message in codec.decode(bytes(first) + second)] == [2.0]
    assert codec.statistics.bad_crc >= 1
    assert codec.statistics.bytes_dropped >= len(first) - 1


SOME = [
    pack(random_message(cls, 1), version=version)
    for cls in CLASSES[::9]
    for version in ((1, 2) if cls.id < 256 else (2,))
]


@given(
    st.lists(st.integers(0, len(SOME) - 1), min_size=1, max_size=8),
    st.lists(st.integers(1, 60), min_size=1, max_size=40),
)
def test_a_stream_may_be_cut_anywhere(numbers: list[int], cuts: list[int]) -> None:
    stream = b"".join(SOME[number] for number in numbers)
    whole = Codec(1, 191).decode(stream)
    codec, pieces, position, turn = Codec(1, 191), [], 0, 0
    while position < len(stream):
        size = cuts[turn % len(cuts)]
        pieces += codec.decode(stream[position : position + size])
        position += size
        turn += 1
    assert [attributes(m) for m in pieces] == [attributes(m) for m in whole]
    assert len(whole) == len(numbers)
    assert codec.statistics.bytes_dropped == 0


@given(
    st.lists(
        st.one_of(st.binary(max_size=40), st.integers(0, len(SOME) - 1).map(lambda n: SOME[n])),
        max_size=12,
    )
)
@settings(max_examples=300)
def test_no_bytes_from_outside_raise(pieces: list[bytes]) -> None:
    codec = Codec(1, 191)
    for piece in pieces:
        codec.decode(piece)
    assert codec.decode(SOME[0] * 20)  # whatever came before, it finds its way again


@given(st.binary(max_size=30), st.integers(0, len(SOME) - 1), st.binary(max_size=30))
def test_a_frame_is_found_between_garbage(before: bytes, number: int, after: bytes) -> None:
    codec = Codec(1, 191)
    clean = before.replace(b"\xfd", b"").replace(b"\xfe", b"")
    messages = codec.decode(clean + SOME[number] + after.replace(b"\xfd", b"-"))
    assert SOME[number] in [bytes(message.get_msgbuf()) for message in messages]
