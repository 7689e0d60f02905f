"""Telemetry logs: 8 bytes of microseconds since 1970, big-endian, then one raw frame."""

from __future__ import annotations

import struct
from typing import BinaryIO


class TlogWriter:
    """Writes frames of both directions in the order in which they passed."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def write(self, unix_time_us: int, frame: bytes) -> None:
        """One record."""
        self._stream.write(struct.pack(">Q", unix_time_us) + frame)
