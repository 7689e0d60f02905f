"""Reads telemetry logs."""

from __future__ import annotations

import struct
from collections.abc import Iterator


def read_records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Time (microseconds since 1970) and frame of each record.

    Raises:
        ValueError: what stands after a time is not the beginning of a frame; the message
            names the offset. A record that is cut short at the end is left out.
    """
    offset = 0
    while offset + 11 <= len(data):
        (time_us,) = struct.unpack_from(">Q", data, offset)
        magic, length, flags = data[offset + 8 : offset + 11]
        if magic == 0xFD:
            size = length + 12 + (13 if flags & 1 else 0)
        elif magic == 0xFE:
            size = length + 8
        else:
            raise ValueError(f"no MAVLink frame at offset {offset + 8} (0x{magic:02x})")
        if offset + 8 + size > len(data):
            return
        yield time_us, data[offset + 8 : offset + 8 + size]
        offset += 8 + size
