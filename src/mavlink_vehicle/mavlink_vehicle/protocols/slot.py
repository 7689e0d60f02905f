"""The base of what holds one part of the protocols at a time, and passes on what it sends."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from typing import Generic, Protocol, TypeVar

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.protocols.service import VehicleService

EventT = TypeVar("EventT", bound=VehicleEvent)


class Part(Protocol):
    """A part of the protocols that runs for a while."""

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""

    def handle_timer(self, now: float) -> None:
        """Do what is due."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""


PartT = TypeVar("PartT", bound=Part)


class Slot(VehicleService, Generic[PartT, EventT]):
    """Runs one part at a time; a subclass decides what follows from what it does.

    Attributes:
        pending: the part that is under way; None without one.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self.pending: PartT | None = None
        self._last_words: list[Message] = []
        self._events: deque[EventT] = deque()

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""
        if self.pending is not None:
            self.pending.receive(message, now)
            self._collect(now)

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.pending is None else self.pending.deadline_s

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        if self.pending is not None:
            self.pending.handle_timer(now)
            self._collect(now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        messages, self._last_words = self._last_words, []
        if self.pending is not None:
            messages += self.pending.messages_to_send()
        return messages

    def next_event(self) -> EventT | None:
        """Return and remove the next event."""
        return self._events.popleft() if self._events else None

    def _vacate(self) -> None:
        """Empty the slot; what its part still has to say is said, such as an acknowledgement."""
        if self.pending is not None:
            self._last_words += self.pending.messages_to_send()
            self.pending = None

    @abstractmethod
    def _collect(self, now: float) -> None:
        """Take what the part has done; empty the slot if it has ended."""
