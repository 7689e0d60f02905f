"""Range readings of the autopilot and of sensors on computers beside it."""

from __future__ import annotations

from mavlink_vehicle.codec import Message
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.ranges import RANGE_MESSAGES, RangeReader


class RangeSensors(VehicleService):
    """Reports each reading.

    Attributes:
        reader: counts what makes no sense.
    """

    handles = RANGE_MESSAGES
    hears_companions = True

    def __init__(self) -> None:
        """Begin without readings."""
        super().__init__()
        self.reader = RangeReader()

    def receive(self, message: Message, now: float) -> None:
        """Read a message."""
        measured = self.reader.read(message, now) if isinstance(message, RANGE_MESSAGES) else None
        if measured is not None:
            self.events.append(measured)
