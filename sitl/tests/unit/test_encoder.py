"""The simulator's frames equal those of pymavlink."""

from __future__ import annotations

import math
import random
import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.mavlink.codec import Encoder, dialect

MESSAGES: list[Any] = list(mav.mavlink_map.values())
INTEGERS = {"uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I"}
INTEGERS |= {"int32_t": "i", "uint64_t": "Q", "int64_t": "q"}
FLOATS = (0.0, 0.0, -0.0, 1.5, -3.4e38, math.inf, math.nan, 1e-45)


def number(kind: str, rng: random.Random) -> float:
    """Any number that fits a field, zeros often, since those at the end are left out."""
    if kind in ("float", "double"):
        return rng.choice(FLOATS)
    top = 2 ** (8 * struct.calcsize(INTEGERS.get(kind, "B")))
    low = 0 if kind[0] == "u" else -top // 2
    return rng.choice((0, low, low + top - 1, rng.randrange(low, low + top)))


def arguments(kind: Any, rng: random.Random) -> list[Any]:
    """All arguments of a message, or those that it must have."""
    values: list[Any] = []
    for name, numbers in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = kind.array_lengths[kind.ordered_fieldnames.index(name)]
        if numbers == "char":
            values.append(rng.randbytes(rng.randrange(length + 1) if length else 1))
        elif length:
            values.append([number(numbers, rng) for _ in range(length)])
        else:
            values.append(number(numbers, rng))
    optional = len(kind.__init__.__defaults__ or ())
    return values[: len(values) - rng.choice((0, optional))]


@pytest.mark.parametrize("seed", range(5))
def test_every_message_of_the_dialect_is_framed_as_pymavlink_does(seed: int) -> None:
    rng = random.Random(seed)
    encoder, theirs = Encoder(7, 1), mav.MAVLink(None, srcSystem=7, srcComponent=1)
    assert len(MESSAGES) > 340
    for kind in MESSAGES:
        values = arguments(kind, rng)
        expected = bytes(kind(*values).pack(theirs))
        ours = getattr(dialect, kind.__name__)(*values)
        assert encoder.encode(ours) == expected, f"{kind.msgname} {values}"
        theirs.seq = (theirs.seq + 1) % 256


def test_a_message_to_send_has_the_fields_of_pymavlinks() -> None:
    values = {"time_boot_ms": 5, "roll": 0.5, "pitch": 1.0, "yaw": 1.5}
    message = dialect.MAVLink_attitude_message(
        **values, rollspeed=2.0, pitchspeed=2.5, yawspeed=3.0
    )
    assert (message.roll, message.yawspeed) == (0.5, 3.0)
    assert dialect.MAV_CMD_NAV_TAKEOFF == 22


def test_a_field_outside_its_type_is_an_error() -> None:
    with pytest.raises(struct.error):
        Encoder(1, 1).encode(dialect.MAVLink_ping_message(0, -1, 0, 0))


def test_signed_frames_are_those_of_pymavlink() -> None:
    key, began = bytes(range(32)), 10**12
    encoder, theirs = Encoder(7, 1), mav.MAVLink(None, srcSystem=7, srcComponent=1)
    encoder.set_up_signing(key, began)
    theirs.signing.secret_key, theirs.signing.sign_outgoing = key, True
    theirs.signing.timestamp = began
    for number in range(3):
        expected = bytes(mav.MAVLink_ping_message(number, number, 1, 2).pack(theirs))
        assert encoder.encode(dialect.MAVLink_ping_message(number, number, 1, 2)) == expected
        theirs.seq += 1
