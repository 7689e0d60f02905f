"""Queue of the messages that a protocol sends."""

from __future__ import annotations

from mavlink_vehicle.codec import Message

__all__ = ["Outbox", "TimedOutbox"]


class Outbox:
    """Messages that wait until whoever owns the link takes them."""

    def __init__(self) -> None:
        """Begin with nothing to send."""
        self.outbox: list[Message] = []

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        if not self.outbox:
            return []
        messages, self.outbox = self.outbox, []
        return messages


class TimedOutbox(Outbox):
    """An outbox of what has at most one deadline, at which it repeats, continues or gives up.

    Attributes:
        deadline_s: when `handle_timer` wants to be called, or None.
    """

    deadline_s: float | None = None

    def __init__(self) -> None:
        """Begin without a deadline."""
        super().__init__()
        self.deadline_s = None

    def handle_timer(self, now: float) -> None:
        """Do what is due once the deadline has come."""
        if self.deadline_s is not None and now >= self.deadline_s:
            self._on_deadline(now)

    def _on_deadline(self, now: float) -> None:
        """Repeat, continue or give up, and set or clear the deadline."""
