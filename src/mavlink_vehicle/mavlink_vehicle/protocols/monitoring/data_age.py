"""Calculates how old the vehicle's data is when it is read, by the vehicle's clock against ours.

A starved server reads packets that have waited in a buffer for seconds, in order, and each looks
new. So the vehicle's time since boot is compared with ours. The two clocks are related by an
answer to TIMESYNC that came quickly: a message read just before it was new. Between such answers
the vehicle's clock is taken to run on at the rate that it showed between the last ones, as that of
a simulator may run at a tenth or at twenty times of ours. An answer that took longer than the
quickest says nothing; the quickest may become slower in time, as links do.
"""

from __future__ import annotations

from collections import deque

_UINT32 = 1 << 32
# More than the quickest round trip: jitter of a usual link.
_QUICK_S = 0.15
# By how much the quickest round trip may grow in a second.
_SLOWER_PER_S = 0.005
# With 2 s between two questions, the rate is known to a few per cent.
_KEPT = 4
_LEAST_SPAN_S = 1.5
# A time since boot comes at least once a second (SYSTEM_TIME).
_OF_ONE_CLOCK_MS = 2000


class DataAge:
    """Relates the clock of one vehicle to ours."""

    def __init__(self) -> None:
        """Begin without knowing."""
        self._known: deque[tuple[float, int]] = deque(maxlen=_KEPT)
        self._rate: float | None = None
        self._quickest: tuple[float, float] | None = None
        self._boot_count = 0

    def answered(
        self, round_trip_s: float, vehicle_ns: int, boot_ms: int | None, boot_count: int, now: float
    ) -> None:
        """Process an answer to TIMESYNC.

        Args:
            round_trip_s: how long it took until it was read.
            vehicle_ns: the vehicle's time in it: since boot on ArduPilot and PX4 (observed).
            boot_ms: the vehicle's newest time since boot that was read before it, or None.
            boot_count: restarts of the vehicle, whose clock begins again.
            now: time in seconds.
        """
        if boot_count != self._boot_count:
            self._boot_count = boot_count
            self._known.clear()
            self._rate = None
        quickest_s = round_trip_s
        if self._quickest is not None:
            before_s, at_s = self._quickest
            quickest_s = min(quickest_s, before_s + _SLOWER_PER_S * (now - at_s))
        self._quickest = quickest_s, now
        if boot_ms is None or round_trip_s > quickest_s + _QUICK_S:
            return
        vehicle_ms = vehicle_ns // 1_000_000 % _UINT32
        if abs(_difference_ms(vehicle_ms, boot_ms)) > _OF_ONE_CLOCK_MS:
            vehicle_ms = boot_ms  # it counts from elsewhere
        self._known.append((now, vehicle_ms))
        first_s, first_ms = self._known[0]
        passed_ms, passed_s = _difference_ms(vehicle_ms, first_ms), now - first_s
        known = passed_s >= _LEAST_SPAN_S and passed_ms > 0
        self._rate = 1e-3 * passed_ms / passed_s if known else None

    def age_s(self, boot_ms: int | None, boot_count: int, now: float) -> float | None:
        """Return the age of a sample by the vehicle's clock; None while unknown.

        The shortest time on the link does not count.

        Args:
            boot_ms: when the vehicle took it, since boot; None: not known.
            boot_count: restarts of the vehicle.
            now: time in seconds.
        """
        if boot_ms is None or boot_count != self._boot_count or self._rate is None:
            return None
        last_s, last_ms = self._known[-1]
        return max(now - last_s - 1e-3 * _difference_ms(boot_ms, last_ms) / self._rate, 0.0)


def _difference_ms(boot_ms: int, before_ms: int) -> int:
    """Return the time between two times since boot; the counter ends after 49.7 days."""
    return (boot_ms - before_ms + _UINT32 // 2) % _UINT32 - _UINT32 // 2
