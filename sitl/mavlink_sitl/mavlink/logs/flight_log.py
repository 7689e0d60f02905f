"""Base of the two formats of a flight log."""

from __future__ import annotations

from abc import ABC, abstractmethod

from mavlink_sitl.exchange import StatusText
from mavlink_sitl.mavlink.messages.snapshot import Snapshot


class FlightLog(ABC):
    """One flight, from arming to disarming.

    Attributes:
        data: the file's contents so far.
        begun_unix_s: when it began; 0 while the vehicle did not know the time.
    """

    def __init__(self, s: Snapshot) -> None:
        self.data = bytearray()
        self.begun_unix_s = s.unix_time_us // 1_000_000

    @abstractmethod
    def sample(self, s: Snapshot, count: int) -> None:
        """Add where the vehicle is and what it does.

        Args:
            s: the vehicle.
            count: number of the sample, from 0; slow values are not in every one.
        """

    @abstractmethod
    def text(self, time_boot_us: int, text: StatusText) -> None:
        """Add words of the firmware."""
