"""What every part of the protocols has that sends."""

from __future__ import annotations

from mavlink_vehicle.codec import Message

__all__ = ["Outbox"]


class Outbox:
    """Messages that wait until whoever owns the link takes them."""

    def __init__(self) -> None:
        """Begin with nothing to send."""
        self._outbox: list[Message] = []

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        if not self._outbox:
            return []
        messages, self._outbox = self._outbox, []
        return messages
