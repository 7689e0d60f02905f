"""A service of an autopilot (operations, mission lists, logs, corrections), and what runs them all.

A service says which messages it handles, what another state of the link means to it, when it wants
to be called, and what it sends. `Services` runs all of them, and knows none by what it does; what
follows for one of them from an event of another stands in `consequences.py`.
"""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar, Protocol

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["Conversation", "SendingRank", "Services", "VehicleService"]


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

    Its deadline, its waiting messages and its events are attributes, so that a turn calls only the
    services that have something to do.

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


Follow = Callable[[VehicleEvent, float], None]
"""Does what follows from an event, at a time in seconds."""


class Services:
    """The services in the order of their timers and events; knows none by what it does."""

    def __init__(self, services: tuple[VehicleService, ...]) -> None:
        """Run these."""
        self._services = services
        self._follow: Follow | None = None
        self._events: deque[VehicleEvent] = deque()
        self._observing = self._with("state_changed")
        self._overhearing = self._with("overhear")
        self._by_rank = sorted(services, key=lambda service: service.rank)
        self._asked_directly = [service for service in services if service.asked_directly]
        self._routes: dict[type[Message], list[VehicleService]] = {}
        for service in services:
            for kind in service.handles:
                self._routes.setdefault(kind, []).append(service)

    def __iter__(self) -> Iterator[VehicleService]:
        """Iterate over the services."""
        return iter(self._services)

    def _with(self, method: str) -> tuple[VehicleService, ...]:
        """Return the services that have a method of their own."""
        default = getattr(VehicleService, method)
        return tuple(
            service for service in self._services if getattr(type(service), method) is not default
        )

    def start(self, now: float) -> None:
        """Begin to work."""
        for service in self._services:
            service.start(now)

    # Messages

    def receive(self, message: Message, now: float, *, of_companion: bool = False) -> None:
        """Give a message, perhaps of another component, to the services that handle it."""
        for service in self._routes.get(message.__class__, ()):
            if service.hears_companions or not of_companion:
                service.receive(message, now)
                self.take_events(service, now)

    def overhear(self, message: Message, now: float) -> None:
        """Give them what another sender says to the autopilot."""
        for service in self._overhearing:
            service.overhear(message, now)

    def messages_to_send(self, *, may_command: bool) -> list[Message]:
        """Return and clear what is to be sent, by rank."""
        messages: list[Message] = []
        for service in self._by_rank:
            if service.outbox or service.pending is not None:
                made = service.messages_to_send()
                # A service that repeats its command takes this for a loss on the link.
                if may_command or not service.commands:
                    messages += made
        return messages

    # Timers

    def next_deadline(self) -> float | None:
        """When `handle_timer` wants to be called."""
        earliest = None
        for service in self._services:
            time = service.deadline_s
            if time is not None and (earliest is None or time < earliest):
                earliest = time
        return earliest

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        due = False
        for service in self._services:
            time = service.deadline_s
            if time is not None and time <= now:
                due = True
                service.handle_timer(now)
        if due:
            self.collect(now)

    # Changes

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Have them begin to ask."""
        for service in self._services:
            service.vehicle_came(conversation, now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Have them stop asking."""
        for service in self._services:
            service.link_lost(state, now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Have them drop what was learned, and end what was under way."""
        for service in self._services:
            service.vehicle_gone(reason, now)
        self.collect(now)

    def vehicle_armed(self) -> None:
        """Have them end what must not continue in flight."""
        for service in self._services:
            service.vehicle_armed()

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Show them the difference of two states."""
        for service in self._observing:
            service.state_changed(before, state, now)
            self.take_events(service, now)

    # Events

    def follow_with(self, follow: Follow) -> None:
        """Call this for each event of a service, when it has been taken."""
        self._follow = follow

    def report(self, event: VehicleEvent) -> None:
        """Add an event that no service has made."""
        self._events.append(event)

    def collect(self, now: float) -> None:
        """Take the events of all services."""
        for service in self._services:
            if service.events:
                self.take_events(service, now)

    def take_events(self, service: VehicleService, now: float) -> None:
        """Take the events of one service, and do what follows from them."""
        while (event := service.next_event()) is not None:
            self._events.append(event)
            if self._follow is not None:
                self._follow(event, now)

    def next_event(self) -> VehicleEvent | None:
        """Return and remove the next event."""
        if self._events:
            return self._events.popleft()
        for service in self._asked_directly:
            if service.events:
                return service.next_event()
        return None
