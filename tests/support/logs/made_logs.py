"""Logs made for tests: packets of all kinds, with times before them."""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence
from typing import Any

from mavlink_vehicle.codec import mavlink
from tests.support.messages.random_messages import CLASSES, STRANGE_FLOATS, random_message

START_US = 1_700_000_000_000_000
STEP_US = 20_000
UNKNOWN_NUMBER = 54_321
_STAMP = struct.Struct(">Q")
_VERSION_1_NUMBERS = 256


def random_packets(seed: int, count: int) -> list[bytes]:
    """Packets of random messages: a third MAVLink 1, some signed, one in ten not known."""
    source = random.Random(seed)
    signing = mavlink.MAVLink(None, srcSystem=3, srcComponent=1)
    signing.signing.secret_key = bytes(range(32))
    signing.signing.sign_outgoing = True
    plain = mavlink.MAVLink(None, srcSystem=1, srcComponent=190)
    packets = []
    for index in range(count):
        if source.random() < 0.1:
            packets.append(unknown_packet(source.randbytes(source.randrange(30))))
            continue
        cls = source.choice(CLASSES)
        message = random_message(cls, f"{seed}/{index}", STRANGE_FLOATS)
        packer = signing if source.random() < 0.2 else plain
        packer.seq = index % 256
        old = packer is plain and cls.id < _VERSION_1_NUMBERS and source.random() < 0.4
        packets.append(bytes(message.pack(packer, force_mavlink1=old)))
    return packets


def unknown_packet(payload: bytes) -> bytes:
    """A packet of a message that the dialect doesn't have."""
    number = struct.pack("<I", UNKNOWN_NUMBER)[:3]
    return bytes([0xFD, len(payload), 0, 0, 7, 1, 1]) + number + payload + b"\x12\x34"


def packet_of_length(cls: Any, payload: bytes, version: int = 2, signed: bool = False) -> bytes:
    """A packet of a message with a payload of any length, as a sender of another dialect makes."""
    number = struct.pack("<I", cls.id)
    source = bytes([9, 1, 1])
    if version == 1:
        head = bytes([len(payload)]) + source + number[:1]
    else:
        head = bytes([len(payload), signed, 0]) + source + number[:3]
    check = mavlink.x25crc(head + payload + bytes([cls.crc_extra])).crc
    magic = b"\xfe" if version == 1 else b"\xfd"
    return magic + head + payload + struct.pack("<H", check) + bytes(13 * signed)


def tlog_of(packets: Sequence[bytes], start_us: int = START_US, step_us: int = STEP_US) -> bytes:
    """The packets, one every `step_us`."""
    return b"".join(
        _STAMP.pack(start_us + index * step_us) + packet for index, packet in enumerate(packets)
    )
