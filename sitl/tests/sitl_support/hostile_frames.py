"""Frames that a simulated vehicle must survive: mutated, truncated, random, extreme."""

from __future__ import annotations

import inspect
import math
import random
import struct
from collections.abc import Iterator, Sequence
from typing import Any

from pymavlink.dialects.v20 import all as mav

FLOATS = (float("nan"), float("inf"), float("-inf"), 3.4e38, -3.4e38, 1e-45, -0.0, 0.0, 1.0, 5.0)
MESSAGES: list[Any] = [
    kind
    for name, kind in sorted(inspect.getmembers(mav, inspect.isclass))
    if name.startswith("MAVLink_") and name.endswith("_message") and name != "MAVLink_message"
]
UNSIGNED = [kind for kind in MESSAGES if kind.id != mav.MAVLINK_MSG_ID_SETUP_SIGNING]
"""Without a key: a vehicle that has one hears nothing unsigned any more, as it should"""
ADDRESSED = [kind for kind in UNSIGNED if "target_system" in kind.ordered_fieldnames]
ADDRESSED += [kind for kind in MESSAGES if kind.id in (11, 75, 76, 84, 86)] * 8
"""Those that a vehicle may act on: commands, modes and setpoints eight times as often"""
COMMANDS = (75, 76)
COMMAND_NUMBERS = (*(n for n in range(600) if n != 246), 2000, 31999, 42425)
"""Without reboots: a vehicle that starts again hears nothing for a while"""


def extreme_setpoints(
    numbers: Sequence[float], setpoint_frames: Sequence[int], degrees_1e7: Sequence[int]
) -> Iterator[Any]:
    """Yield 3000 setpoints, local and global in turn, of these fields, frames and positions."""
    rng = random.Random(3)
    for number in range(3000):
        values = [rng.choice(numbers) for _ in range(11)]
        frame, mask = rng.choice(setpoint_frames), rng.randrange(0x1000)
        message = mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *values)
        if number % 2:
            x, y = (rng.choice(degrees_1e7) for _ in range(2))
            message = mav.MAVLink_set_position_target_global_int_message(
                0, 1, 1, frame, mask, x, y, *values[2:]
            )
        yield message


def frames(seed: int) -> Iterator[bytes]:
    """Without end: a third with a right checksum and random or extreme content, to the vehicle.

    The rest is cut, bent, joined to others, or noise.
    """
    rng = random.Random(seed)
    recent = [_valid(rng) for _ in range(200)]
    while True:
        kind = rng.randrange(6)
        if kind < 2:
            frame = _valid(rng)
            recent[rng.randrange(len(recent))] = frame
            yield frame
        else:
            yield _spoiled(recent, rng, kind)


def _spoiled(recent: list[bytes], rng: random.Random, kind: int) -> bytes:
    frame = bytearray(rng.choice(recent))
    if kind == 2:
        return bytes(frame[: rng.randrange(len(frame))])
    if kind == 3:
        for _ in range(rng.randint(1, 4)):
            frame[rng.randrange(len(frame))] = rng.randrange(256)
        return bytes(frame)
    if kind == 4:
        return bytes(frame[rng.randrange(len(frame)) :]) + rng.choice(recent)
    return rng.choice([b"", b"\xfd", b"\xfe"]) + rng.randbytes(rng.randrange(300))


def _valid(rng: random.Random) -> bytes:
    """Any message of the dialect, addressed to vehicle 1 where it has an address."""
    kind = rng.choice(UNSIGNED if rng.random() < 0.3 else ADDRESSED)
    payload = bytearray(payload_of(kind, rng))
    if "target_system" in kind.ordered_fieldnames:
        payload[_offset(kind, "target_system")] = rng.choice([0, 1, 1, 1])
    if kind.id in COMMANDS:
        struct.pack_into("<H", payload, _offset(kind, "command"), rng.choice(COMMAND_NUMBERS))
    return frame_of(kind, bytes(payload), rng.randrange(256))


def frame_of(kind: Any, payload: bytes, seq: int = 0) -> bytes:
    """A frame with a right checksum around any payload."""
    number = kind.id & 0xFFFF, kind.id >> 16
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, seq, 255, 190, *number)
    check = mav.x25crc(head + payload)
    check.accumulate(bytes([kind.crc_extra]))
    return b"\xfd" + head + payload + struct.pack("<H", check.crc)


def extreme_payloads(kind: Any) -> Iterator[bytes]:
    """Whole payloads with every field at one extreme; to vehicle 1 where there is an address."""
    for number, filler in (
        (math.nan, b"\xff"),
        (math.inf, b"\x7f"),
        (-math.inf, b"\x80"),
        (3.4e38, b"\xff"),
        (-3.4e38, b"\0"),
        (1e-45, b"\1"),
        (0.0, b"\0"),
    ):
        parts = []
        for count, code in fields(kind.unpacker.format):
            if code in "fd":
                parts.append(struct.pack(f"<{count}{code}", *[number] * count))
            elif code in "sc":
                parts.append(filler * count)
            else:
                size = struct.calcsize(code)
                # Little-endian: the last byte has the sign.
                signed = filler in (b"\x7f", b"\x80")
                one = (b"\0" if filler == b"\x80" else b"\xff") * (size - 1) + filler
                parts.append((one if signed else filler * size) * count)
        payload = bytearray(b"".join(parts))
        for name in ("target_system", "target_component"):
            if name in kind.ordered_fieldnames:
                payload[_offset(kind, name)] = 1
        yield bytes(payload)


def payload_of(kind: Any, rng: random.Random) -> bytes:
    """Random, or of extreme values."""
    if rng.random() < 0.5:
        return rng.randbytes(kind.unpacker.size)
    parts = []
    for count, code in fields(kind.unpacker.format):
        if code in "fd":
            parts += [struct.pack(f"<{code}", rng.choice(FLOATS)) for _ in range(count)]
        else:
            size = count * struct.calcsize(code if code != "s" else "c")
            parts.append(rng.choice([bytes(size), b"\xff" * size, rng.randbytes(size)]))
    return b"".join(parts)


def fields(layout: str) -> list[tuple[int, str]]:
    """Return the fields of a struct format: how many, of which type."""
    found, digits = [], ""
    for letter in layout.lstrip("<"):
        if letter.isdigit():
            digits += letter
        else:
            found.append((int(digits or 1), letter))
            digits = ""
    return found


def _offset(kind: Any, name: str) -> int:
    sizes = [count * struct.calcsize(code) for count, code in fields(kind.unpacker.format)]
    return sum(sizes[: list(kind.ordered_fieldnames).index(name)])
