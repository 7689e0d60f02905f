"""Clocks: the sources of time."""

from __future__ import annotations

import time
from typing import Protocol

from mavlink_vehicle.errors import SettingError


class Clock(Protocol):
    """Gives the time in seconds, from any beginning; it never goes back."""

    @property
    def rate(self) -> float:
        """Its seconds per second of the wall clock."""

    def now(self) -> float:
        """Return the time in seconds."""


class MonotonicClock:
    """The machine's monotonic clock, or that times `speedup` for a simulator that runs fast."""

    def __init__(self, speedup: float = 1.0) -> None:
        """Begin at the machine's own time."""
        if not 0.0 < speedup < 1e6:
            raise SettingError(f"speedup is {speedup}; it must be a positive number.")
        self._rate = speedup

    @property
    def rate(self) -> float:
        """The speedup."""
        return self._rate

    def now(self) -> float:
        """Return the time in seconds."""
        return time.monotonic() * self._rate


class ManualClock:
    """Stands still until it is set: for tests and replays."""

    def __init__(self, now_s: float = 0.0) -> None:
        """Begin at `now_s`."""
        self._now_s = now_s

    @property
    def rate(self) -> float:
        """It doesn't follow the wall clock; a driver takes its deadlines as they are."""
        return 1.0

    def now(self) -> float:
        """Return the time it was last set to."""
        return self._now_s

    def advance_to(self, now_s: float) -> None:
        """Go forward to `now_s`; a time that has passed changes nothing."""
        self._now_s = max(self._now_s, now_s)
