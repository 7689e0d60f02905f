"""When a sample of the vehicle was measured, in this computer's time. No ROS.

A message has the vehicle's time since boot. The link delays it by a time that varies, never by
less than its shortest delay. So the smallest difference between arrival and time since boot
relates the two clocks; only that shortest delay, a few milliseconds on most links, stays in it.
"""

from __future__ import annotations

import math

# Looked back on is once to twice this time. Two crystals drift apart by 50 us in a second, but the
# clock of a PX4 in its own simulator by 7 ms (recorded), which is 40 ms in that time.
_PERIOD_S = 3.0


class SampleTimes:
    """Relates the clock of one vehicle to ours."""

    def __init__(self) -> None:
        """Begin without samples."""
        self._clock_count: int | None = None
        self._begun_s = 0.0
        self._smallest_s = self._smallest_before_s = math.inf

    def observe(self, clock_count: int, time_boot_ms: int, arrived_s: float) -> None:
        """Take a message that has just come.

        Args:
            clock_count: which clock of the vehicle that is.
            time_boot_ms: the vehicle's time of the message; 0 is not set.
            arrived_s: our time.
        """
        if not time_boot_ms:
            return
        difference_s = arrived_s - 1e-3 * time_boot_ms
        if clock_count != self._clock_count:
            self._clock_count, self._begun_s = clock_count, arrived_s
            self._smallest_s = self._smallest_before_s = math.inf
        elif arrived_s - self._begun_s >= _PERIOD_S:
            self._begun_s = arrived_s
            self._smallest_before_s, self._smallest_s = self._smallest_s, math.inf
        self._smallest_s = min(self._smallest_s, difference_s)

    def age_s(self, time_boot_ms: int, now: float) -> float:
        """Return how long ago a sample was measured; 0 before anything was observed."""
        smallest_s = min(self._smallest_s, self._smallest_before_s)
        if math.isinf(smallest_s) or not time_boot_ms:
            return 0.0
        return max(now - smallest_s - 1e-3 * time_boot_ms, 0.0)
