"""Runs the services of a vehicle: routes of messages, timers, order of sending, events."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

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
