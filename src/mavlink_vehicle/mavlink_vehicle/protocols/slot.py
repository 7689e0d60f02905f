"""The base of what holds one part of the protocols at a time, and passes on what it sends."""

from __future__ import annotations

from abc import abstractmethod
from typing import Generic, Protocol, TypeVar

from mavlink_vehicle.codec import Message
from mavlink_vehicle.protocols.service import SendingPart, VehicleService


class Part(SendingPart, Protocol):
    """A part of the protocols that runs for a while."""

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""

    def handle_timer(self, now: float) -> None:
        """Do what is due."""


PartT = TypeVar("PartT", bound=Part)


class Slot(VehicleService, Generic[PartT]):
    """Runs one part at a time; a subclass decides what follows from what it does.

    Attributes:
        pending: the part that is under way; None without one.
        outbox: what parts that have ended still say.
    """

    def __init__(self) -> None:
        """Begin empty."""
        super().__init__()
        self.pending: PartT | None = None

    def receive(self, message: Message, now: float) -> None:
        """Process one message of the autopilot."""
        if self.pending is not None:
            self.pending.receive(message, now)
            self._collect(now)

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        if self.pending is not None:
            self.pending.handle_timer(now)
            self._collect(now)

    def _vacate(self) -> None:
        """Empty the slot; what its part still has to say is said, such as an acknowledgement."""
        if self.pending is not None:
            self.outbox += self.pending.messages_to_send()
            self.pending = None

    def _collect(self, now: float) -> None:
        """Take what the part has done, and when it wants to be called."""
        self._take_done(now)
        self._set_deadline()

    def _set_deadline(self) -> None:
        """Take over the deadline of the part; called after each call of it."""
        self.deadline_s = None if self.pending is None else self.pending.deadline_s

    @abstractmethod
    def _take_done(self, now: float) -> None:
        """Take what the part has done; empty the slot if it has ended."""
