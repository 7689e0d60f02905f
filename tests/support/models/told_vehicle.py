"""A vehicle without a link, which is told messages at times of a test's choosing."""

from __future__ import annotations

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig


class ToldVehicle:
    """A vehicle, the time, and all that the vehicle has sent.

    Attributes:
        vehicle: started.
        now: in seconds.
        sent: may be cleared.
    """

    def __init__(self, config: VehicleConfig, now: float = 0.0) -> None:
        """Start the vehicle."""
        self.vehicle = Vehicle(config)
        self.now = now
        self.sent: list[Message] = []
        self.vehicle.start(now)

    def tell(self, *messages: Message) -> list[VehicleEvent]:
        """Give messages to the vehicle; return what has happened."""
        for message in messages:
            self.vehicle.receive(message, self.now)
        return self.events()

    def wait(self, seconds: float) -> list[VehicleEvent]:
        """Let time pass in which no message comes; return what has happened."""
        end_s = self.now + seconds
        while (deadline := self.vehicle.next_deadline()) is not None and deadline <= end_s:
            self.now = max(self.now, deadline)
            self.vehicle.handle_timer(self.now)
            self.sent += self.vehicle.messages_to_send()
        self.now = end_s
        return self.events()

    def events(self) -> list[VehicleEvent]:
        """Return what has happened since this was last asked."""
        self.sent += self.vehicle.messages_to_send()
        events = []
        while (event := self.vehicle.next_event()) is not None:
            events.append(event)
        return events

    def commands(self, command: int) -> list[Message]:
        """Return the commands of a number that were sent, as COMMAND_LONG."""
        return [m for m in self.sent if m.get_type() == "COMMAND_LONG" and m.command == command]
