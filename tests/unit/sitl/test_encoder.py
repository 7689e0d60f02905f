"""The simulator's frames are those that pymavlink makes."""

from __future__ import annotations

import random

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.mavlink.codec import Decoder, Encoder
from tests.support.hostile_frames import MESSAGES, payload_of


@pytest.mark.parametrize("seed", range(3))
def test_every_message_of_the_dialect_is_framed_as_pymavlink_does(seed: int) -> None:
    rng = random.Random(seed)
    encoder, theirs = Encoder(7, 1), mav.MAVLink(None, srcSystem=7, srcComponent=1)
    decoder = Decoder()
    compared = 0
    for kind in MESSAGES:
        payload = bytes(kind.unpacker.size) if seed == 0 else payload_of(kind, rng)
        head = (len(payload), 0, 0, 3, 255, 190, kind.id & 0xFFFF, kind.id >> 16)
        body = bytes(head[:6]) + head[6].to_bytes(2, "little") + bytes(head[7:]) + payload
        check = mav.x25crc(body + bytes([kind.crc_extra])).crc
        for message in decoder.feed(b"\xfd" + body + check.to_bytes(2, "little")):
            try:
                expected = bytes(message.pack(theirs))
            except (UnicodeEncodeError, mav.struct.error):
                continue  # text that pymavlink cannot write back itself
            assert encoder.encode(message) == expected, message.get_type()
            theirs.seq = (theirs.seq + 1) % 256
            compared += 1
    assert compared > 250
