"""The logs that a vehicle stores: one for each time it was armed, as ArduPilot and PX4 log."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable

from mavlink_sitl.exchange import Event, StatusText
from mavlink_sitl.mavlink.files.storage import Storage
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


SAMPLE_US = 100_000
LOGS_MAX = 20
"""The oldest are removed; what remains is numbered again"""
BYTES_MAX = 8 << 20
"""A log ends there: two hours of flight"""
_TEXTS_BEFORE = 20


class Logbook:
    """Storage that outlives a reboot, as the parameters do.

    Args:
        make: begins a log in the firmware's own format.

    Attributes:
        logs: the stored ones, oldest first; the last one may still be written.
        storage: what ground stations have put beside them.
    """

    def __init__(self, make: Callable[[Snapshot], FlightLog]) -> None:
        self.logs: list[FlightLog] = []
        self.storage = Storage()
        self._make = make
        self._open: FlightLog | None = None
        self._next_us = 0
        self._samples = 0
        self._before: deque[tuple[int, StatusText]] = deque(maxlen=_TEXTS_BEFORE)
        self._now_us = 0

    def watch(self, now_us: int, armed: bool, snapshot: Callable[[], Snapshot]) -> None:
        """Begin, continue or end a log.

        Args:
            now_us: simulated time.
            armed: whether the motors are armed.
            snapshot: returns the vehicle's state.
        """
        log = self._open
        if log is None:
            if not armed:
                return
            log = self._begin(snapshot())
        elif armed and now_us < self._next_us:
            return
        state = snapshot()
        self._now_us = state.time_boot_us
        log.sample(state, self._samples)
        self._samples += 1
        self._next_us = now_us + SAMPLE_US
        if not armed or len(log.data) >= BYTES_MAX:
            self._open = None

    def note(self, event: Event, time_boot_us: int) -> None:
        """Take what the firmware says."""
        if not isinstance(event, StatusText):
            return
        if self._open is not None:
            self._open.text(time_boot_us, event)
        else:
            self._before.append((time_boot_us, event))

    def power_up(self) -> None:
        """A firmware starts: what the last one wrote has ended."""
        self._open = None
        self._before.clear()

    def erase(self) -> None:
        """Remove all logs; one that is being written starts over."""
        self.logs.clear()
        self._open = None

    def _begin(self, state: Snapshot) -> FlightLog:
        log = self._open = self._make(state)
        self._samples = 0
        for time_us, text in self._before:
            log.text(time_us, text)
        self._before.clear()
        self.logs = [*self.logs[1 - LOGS_MAX :], log]
        return log
