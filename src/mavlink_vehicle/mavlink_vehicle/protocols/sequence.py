"""Sorts packets into the order of sending by MAVLink's sequence number.

HEARTBEAT carries no time, and an old one that arrives after a newer one would show a mode that
has been left since: it would look like a pilot's intervention.
"""

from __future__ import annotations

_HALF = 128
_RESYNC_S = 1.0


class SequenceOrder:
    """Follows the sequence numbers (0 to 255, wrapping) of one sender."""

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        self._newest: int | None = None
        self._advanced_s = 0.0

    def place(self, sequence: int, now: float) -> int:
        """Return the packet's place in the order of sending; it grows from packet to packet.

        A number up to half the circle behind the newest is a late packet. After a second
        without progress any number is taken as a new one: the sender restarted, or so much was
        lost that the number says nothing.
        """
        newest = self._newest
        if newest is None:
            self._newest = sequence
            self._advanced_s = now
            return sequence
        ahead = (sequence - newest) % 256
        if ahead >= _HALF and now - self._advanced_s < _RESYNC_S:
            return newest + ahead - 256
        if ahead:
            self._newest = newest + ahead
            self._advanced_s = now
        return newest + ahead
