"""The interface of a service of an autopilot: operations, mission lists, logs, corrections.

A service says which messages it handles, what another state of the link means to it, when it wants
to be called, and what it sends. `services.Services` runs all of them, and knows none by what it
does; what follows for one of them from an event of another stands in `consequences.py`.
"""

from __future__ import annotations

import enum
from collections import deque
from dataclasses import dataclass
from typing import ClassVar, Protocol

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["Conversation", "SendingRank", "VehicleService"]


class SendingRank(enum.IntEnum):
    """The order in which what is sent at one moment goes out; each has a test of its own."""

    MODE_QUESTION = enum.auto()
    """Asks for the mode after a gap of ours, before anything that depends on it."""
    LOGS = enum.auto()
    """The end of a download goes out before what arms the vehicle."""
    LISTS = enum.auto()
    """A PX4 would take the end of a reading for the end of the upload that comes after it."""
    OPERATIONS = enum.auto()
    """A mode or arming is asked for before the setpoints that it is for."""
    SETPOINTS = enum.auto()
    """The vehicle flies by them, so that nothing that can wait goes before them."""
    HEARTBEAT = enum.auto()
    """A vehicle without it runs into its failsafe."""
    QUESTIONS = enum.auto()
    """They are repeated: on a full link they can be lost first."""
    DATA = enum.auto()
    """Corrections and poses: many bytes, and the next ones make up for those lost."""


@dataclass(frozen=True)
class Conversation:
    """The addresses of a conversation, and the kind of vehicle."""

    address: Address
    profile: Profile


class SendingPart(Protocol):
    """A part of a service that sends."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""


class VehicleService(TimedOutbox):
    """One service, sans I/O; what it does not care about it leaves as it is here.

    What is due, waits to be sent or has happened shows in attributes, so that a turn calls only
    the services that have something to do.

    Attributes:
        rank: when its messages go out among those of others.
        handles: the classes of the messages that `receive` gets.
        commands: whether what it sends moves the vehicle or changes its mode. That is dropped while
            the mode has not been seen since we stood still.
        hears_companions: whether it also gets those of other components of the vehicle.
        asked_directly: whether requests that make events come to it past the vehicle.
        pending: what runs in it for a while, with messages of its own; None without.
        events: those that have not been taken.
    """

    rank: ClassVar[SendingRank] = SendingRank.QUESTIONS
    handles: tuple[type[Message], ...] = ()
    commands: ClassVar[bool] = False
    hears_companions: ClassVar[bool] = False
    asked_directly: ClassVar[bool] = False
    pending: SendingPart | None = None

    def __init__(self) -> None:
        """Begin with nothing to send and nothing to report."""
        super().__init__()
        self.events: deque[VehicleEvent] = deque()

    def start(self, now: float) -> None:
        """Begin to work; no vehicle is known yet."""

    def receive(self, message: Message, now: float) -> None:
        """Process a message of the autopilot."""

    def overhear(self, message: Message, now: float) -> None:
        """Process what another sender says to the autopilot."""

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Begin to ask: the vehicle was found, has restarted, or is heard again."""

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking: its HEARTBEAT is missing."""

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Drop what is known of it: it restarted, or another vehicle was found."""

    def vehicle_armed(self) -> None:
        """End what must not continue in flight."""

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Process the difference of two states; measurements alone make none."""

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent, by what is pending, too."""
        messages, self.outbox = self.outbox, []
        if self.pending is not None:
            messages += self.pending.messages_to_send()
        return messages

    def next_event(self) -> VehicleEvent | None:
        """Return and remove the next event."""
        return self.events.popleft() if self.events else None
