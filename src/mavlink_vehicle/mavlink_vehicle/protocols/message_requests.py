"""Messages that are wanted once: asked for by MAV_CMD_REQUEST_MESSAGE until they came.

The message itself is the answer; acknowledgements are not looked at. An autopilot answers
FAILED while it has no home or origin yet, and may have one a minute later.
"""

from __future__ import annotations

from collections.abc import Iterable

from mavlink_vehicle.codec import Message, mavlink, message_id
from mavlink_vehicle.protocols.command import Address, CommandRequest

_FIRST_RETRY_S = 1.0
_MAX_RETRY_S = 10.0


class MessageRequests:
    """Asks for each missing message, more and more rarely, until it is there."""

    def __init__(self, names: Iterable[str]) -> None:
        """Say which messages are wanted.

        Raises:
            MessageError: there is no such message.
        """
        self._wanted = frozenset(message_id(name) for name in names)
        self._missing: set[int] = set()
        self._address: Address | None = None
        self._deadline: float | None = None
        self._retry_s = _FIRST_RETRY_S
        self._outbox: list[Message] = []

    @property
    def missing(self) -> frozenset[int]:
        """Ids of the messages that have not come yet."""
        return frozenset(self._missing)

    def start(self, now: float) -> None:
        """Nothing to ask before `resume`."""

    def resume(self, address: Address, now: float) -> None:
        """Ask for everything again."""
        self._address = address
        self._missing = set(self._wanted)
        self._retry_s = _FIRST_RETRY_S
        self._deadline = now if self._missing else None
        self.handle_timer(now)

    def pause(self) -> None:
        """Stop asking."""
        self._deadline = None
        self._outbox.clear()

    def receive(self, message: Message, now: float) -> None:
        """Tick off what came."""
        if self._missing:
            self._missing.discard(message._header.msgId)
            if not self._missing:
                self._deadline = None

    def next_deadline(self) -> float | None:
        """Return when to ask again."""
        return self._deadline

    def handle_timer(self, now: float) -> None:
        """Ask for what is missing."""
        if self._deadline is None or now < self._deadline or self._address is None:
            return
        for number in sorted(self._missing):
            request = CommandRequest(mavlink.MAV_CMD_REQUEST_MESSAGE, (number,))
            self._outbox.append(request.message(self._address, 0))
        self._deadline = now + self._retry_s
        self._retry_s = min(self._retry_s * 2.0, _MAX_RETRY_S)

    def messages_to_send(self) -> list[Message]:
        """Take what is to be sent."""
        messages, self._outbox = self._outbox, []
        return messages

    def next_event(self) -> None:
        """There are none."""
