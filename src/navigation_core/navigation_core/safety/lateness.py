"""Measures how late the control loop runs, and the speed that this allows."""

from __future__ import annotations

import math
from collections import deque

__all__ = ["LATE_S", "TOO_LATE_S", "WINDOW_S", "Lateness", "speed_share"]

LATE_S = 0.25
"""Setpoints that are this much late, five periods at 20 Hz, are no longer the usual jitter."""
TOO_LATE_S = 1.0
"""Later than this nobody steers: PX4 gives OFFBOARD up after COM_OF_LOSS_T, by default 1 s."""
WINDOW_S = 3.0
"""A delay counts for this time: a server that was late a moment ago may be late again."""


class Lateness:
    """Remembers the worst delay of the last seconds.

    Attributes:
        count: how many delays of more than LATE_S there were.
        worst_s: the greatest delay ever.
    """

    def __init__(self) -> None:
        """Begin without a delay."""
        self.count = 0
        self.worst_s = 0.0
        # Falling delays with their times: the first is the worst of those that still count.
        self._delays: deque[tuple[float, float]] = deque()

    def note(self, late_s: float, now: float) -> bool:
        """Record how late something was that was due.

        Args:
            late_s: the delay.
            now: when it was done.

        Returns:
            Whether that was late.
        """
        while self._delays and self._delays[-1][1] <= late_s:
            self._delays.pop()
        self._delays.append((now, late_s))
        self.worst_s = max(self.worst_s, late_s)
        if late_s < LATE_S:
            return False
        self.count += 1
        return True

    def recent_s(self, now: float) -> float:
        """Return the worst delay of the last WINDOW_S seconds."""
        while self._delays and now - self._delays[0][0] > WINDOW_S:
            self._delays.popleft()
        return self._delays[0][1] if self._delays else 0.0


def speed_share(late_s: float) -> float:
    """Return the share of its speed that a vehicle may have when setpoints are this late.

    All of it up to LATE_S, nothing from TOO_LATE_S on.
    """
    if not math.isfinite(late_s):
        return 0.0
    return min(max((TOO_LATE_S - late_s) / (TOO_LATE_S - LATE_S), 0.0), 1.0)
