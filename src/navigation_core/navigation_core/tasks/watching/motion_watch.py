"""Watches whether a vehicle that flies by itself gets on."""

from __future__ import annotations

from collections.abc import Sequence

from navigation_core.geometry import Vector3, distance
from navigation_core.tasks.conditions import Headway

# A vehicle that has moved by less than this in the given time is stuck.
_MOVED_M = 0.5


class MotionWatch:
    """Whether the vehicle moves, and whether its motion leads anywhere."""

    def __init__(self, astray_after_s: float) -> None:
        """Begin; the vehicle may be without headway for this time."""
        self._moved_s = 0.0
        self._moved_from: Vector3 | None = None
        self._headway = Headway(astray_after_s)

    def restart(self, now: float) -> None:
        """Count from now on: it does something else."""
        self._moved_s = now
        self._headway.restart()

    def has_other_lengths(self) -> None:
        """Count the headway from now on: it is headed for another point."""
        self._headway.restart()

    def is_stuck(self, position: Vector3 | None, now: float, patience_s: float) -> bool:
        """Record the position, and return whether it has not moved for too long."""
        before = self._moved_from
        if position is not None and (before is None or distance(position, before) > _MOVED_M):
            self._moved_from, self._moved_s = position, now
        return now - self._moved_s > patience_s

    def is_astray(self, lengths_m: Sequence[float], now: float, longer_s: float = 0.0) -> bool:
        """Record lengths that shrink with progress, and return whether none has for too long.

        Args:
            lengths_m: always as many, or none while they are not known.
            now: time in seconds.
            longer_s: time that it may stand by right.
        """
        return self._headway.is_lost(lengths_m, now, longer_s)
