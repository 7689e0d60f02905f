"""RTCM corrections: framing, fragments, rejections, pace."""

from __future__ import annotations

import random
from itertools import groupby

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Message
from mavlink_vehicle.protocols.streams.rtcm import (
    LONGEST_BYTES,
    RATE_BYTES_S,
    RtcmError,
    RtcmSender,
    fragments,
    rtcm_messages,
)
from mavlink_vehicle.state.vehicle_state import VehicleState

# Message 1005 of the RTCM 10403 standard's own example (also in RTKLIB's and pyrtcm's tests).
EXAMPLE = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")


def rtcm(size: int, seed: int = 0) -> bytes:
    """A message of this size with the checksum of another implementation."""
    payload = random.Random(seed).randbytes(size - 6)
    head = bytes([0xD3]) + len(payload).to_bytes(2, "big") + payload
    crc = 0
    for byte in head:  # bit by bit, as a shift register of 24 bits
        for bit in range(7, -1, -1):
            out = (crc >> 23 & 1) ^ (byte >> bit & 1)
            crc = (crc << 1 & 0xFFFFFF) ^ (0x864CFB if out else 0)
    return head + crc.to_bytes(3, "big")


def put_together(pieces: list[Message]) -> list[bytes]:
    """Join GPS_RTCM_DATA as a receiver does, by the sequence id and the place in the flags."""
    messages = []
    for _, group in groupby(pieces, lambda piece: piece.flags >> 3):
        parts = {piece.flags >> 1 & 3: bytes(piece.data[: piece.len]) for piece in group}
        messages.append(b"".join(parts[place] for place in sorted(parts)))
    return messages


def test_the_standards_example_is_a_message() -> None:
    assert rtcm_messages(EXAMPLE) == [EXAMPLE]


@given(st.lists(st.integers(6, 720), max_size=4))
@settings(max_examples=30, deadline=None)
def test_messages_that_follow_one_another_are_told_apart(sizes: list[int]) -> None:
    messages = [rtcm(size, size) for size in sizes]
    assert rtcm_messages(b"".join(messages)) == messages


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x24GNGGA,1", "Byte 0 of 8 does not begin an RTCM 3 message."),
        (EXAMPLE + b"\x00", "Byte 25 of 26 does not begin an RTCM 3 message."),
        (EXAMPLE[:-1], "An RTCM message of 25 bytes ends after 24."),
        (EXAMPLE[:5] + b"\xff" + EXAMPLE[6:], "The checksum of an RTCM message of 25 bytes"),
        (b"\xd3\xff\xff", "does not begin"),
        (b"", "It contains no RTCM message."),
    ],
)
def test_what_is_no_rtcm_is_rejected_and_not_sent(data: bytes, said: str) -> None:
    sender = RtcmSender()
    with pytest.raises(RtcmError, match=said.replace(".", r"\.")):
        sender.offer(data, 0.0)
    assert sender.messages_to_send() == []
    assert sender.deadline_s is None


@pytest.mark.parametrize(
    ("size", "lengths"),
    [
        (6, [6]),
        (179, [179]),
        (180, [180]),
        (181, [180, 1]),
        (360, [180, 180, 0]),
        (361, [180, 180, 1]),
        (540, [180, 180, 180, 0]),
        (541, [180, 180, 180, 1]),
        (719, [180, 180, 180, 179]),
        (720, [180, 180, 180, 180]),
    ],
)
def test_a_message_is_cut_as_the_autopilots_put_it_together(size: int, lengths: list[int]) -> None:
    data = rtcm(size)
    pieces = fragments(data, 21)
    assert [piece.len for piece in pieces] == lengths
    assert all(piece.flags >> 3 == 21 for piece in pieces)
    if len(pieces) == 1:
        assert pieces[0].flags & 0b111 == 0
    else:
        assert [piece.flags & 1 for piece in pieces] == [1] * len(pieces)
        assert [piece.flags >> 1 & 3 for piece in pieces] == list(range(len(pieces)))
    assert put_together(pieces) == [data]


def test_a_message_that_mavlink_cannot_carry_is_rejected_whole() -> None:
    sender = RtcmSender()
    with pytest.raises(RtcmError, match=f"721 bytes; MAVLink carries at most {LONGEST_BYTES}"):
        sender.offer(EXAMPLE + rtcm(721), 0.0)
    assert sender.messages_to_send() == []


def test_messages_go_out_in_order_with_a_pause_and_new_sequence_ids() -> None:
    sender = RtcmSender()
    messages = [rtcm(size, size) for size in (700, 50, 360)]
    sender.offer(b"".join(messages), 10.0)
    now, sent = 10.0, list[Message]()
    times: list[float] = []
    while (deadline := sender.deadline_s) is not None or not times:
        sent += sender.messages_to_send()
        times.append(now)
        if deadline is not None:
            now = deadline
            sender.handle_timer(now)
    sent += sender.messages_to_send()
    assert put_together(sent) == messages
    assert sorted({piece.flags >> 3 for piece in sent}) == [0, 1, 2]
    assert now - 10.0 >= 750 / RATE_BYTES_S


def test_more_than_can_be_sent_is_rejected_and_a_lost_link_drops_the_rest() -> None:
    sender = RtcmSender()
    for _ in range(21):  # the first goes out at once
        sender.offer(EXAMPLE, 0.0)
    with pytest.raises(RtcmError, match="faster than it is sent"):
        sender.offer(EXAMPLE, 0.0)
    sender.link_lost(VehicleState(), 0.5)
    assert sender.deadline_s is None
    sender.offer(EXAMPLE, 1.0)
    assert sender.messages_to_send()


def test_the_sequence_id_wraps() -> None:
    sender = RtcmSender()
    ids = []
    for count in range(33):
        sender.offer(EXAMPLE, float(count))
        ids += [piece.flags >> 3 for piece in sender.messages_to_send()]
    assert ids[-2:] == [31, 0]
