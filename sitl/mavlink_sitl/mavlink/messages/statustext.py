"""STATUSTEXT in chunks of 50 bytes."""

from __future__ import annotations

from mavlink_sitl.exchange import StatusText
from mavlink_sitl.mavlink.codec import Message, dialect

CHUNK = 50


class StatusTextEncoder:
    """Words to messages; the chunks of a long text share an id.

    Args:
        numbers_all: a PX4 numbers every text, from 0 on; an ArduPilot only the long ones, from 1
            on, and again from 1 after 65535.
    """

    def __init__(self, numbers_all: bool = False) -> None:
        """No text yet."""
        self._numbers_all = numbers_all
        self._last_id = -1 if numbers_all else 0

    def messages(self, text: StatusText) -> list[Message]:
        """One message, or several chunks of a long text."""
        raw = text.text.encode("ascii", "replace")
        severity = int(text.severity)
        if self._numbers_all:
            self._last_id = (self._last_id + 1) % 65536
        elif len(raw) <= CHUNK:
            return [dialect.MAVLink_statustext_message(severity, raw, 0, 0)]
        else:
            self._last_id = self._last_id % 65535 + 1
        chunks = [raw[i : i + CHUNK] for i in range(0, len(raw), CHUNK)]
        return [
            dialect.MAVLink_statustext_message(severity, chunk, self._last_id, sequence)
            for sequence, chunk in enumerate(chunks[:256])
        ]
