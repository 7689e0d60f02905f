"""Queue of the messages that a protocol sends."""

from __future__ import annotations

from mavlink_vehicle.codec import Message

__all__ = ["Outbox", "TimedOutbox"]


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


class TimedOutbox(Outbox):
    """An outbox of what has at most one deadline, at which it repeats, continues or gives up."""

    def __init__(self) -> None:
        """Begin without a deadline."""
        super().__init__()
        self._deadline: float | None = None

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Do what is due once the deadline has come."""
        if self._deadline is not None and now >= self._deadline:
            self._on_deadline(now)

    def _on_deadline(self, now: float) -> None:
        """Repeat, continue or give up, and set or clear the deadline."""
