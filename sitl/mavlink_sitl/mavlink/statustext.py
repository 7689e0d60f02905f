"""STATUSTEXT in chunks of 50 bytes."""

from __future__ import annotations

from mavlink_sitl.exchange import StatusText
from mavlink_sitl.mavlink.codec import Message, dialect

CHUNK = 50


class StatusTexts:
    """Words to messages; long ones share an id, which starts again at 1 after 65535."""

    def __init__(self) -> None:
        """No long text yet."""
        self._last_id = 0

    def messages(self, text: StatusText) -> list[Message]:
        """One message, or several chunks of a long text."""
        raw = text.text.encode("ascii", "replace")
        severity = int(text.severity)
        if len(raw) <= CHUNK:
            return [dialect.MAVLink_statustext_message(severity, raw, 0, 0)]
        self._last_id = self._last_id % 65535 + 1
        chunks = [raw[i : i + CHUNK] for i in range(0, len(raw), CHUNK)]
        return [
            dialect.MAVLink_statustext_message(severity, chunk, self._last_id, sequence)
            for sequence, chunk in enumerate(chunks[:256])
        ]
