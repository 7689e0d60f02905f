"""Tells late packets from new ones by MAVLink's sequence number.

HEARTBEAT carries no time, and an old one that arrives after a newer one would show a mode that
has been left since: it would look like a pilot's intervention.
"""

from __future__ import annotations

_HALF = 128
_RESYNC_S = 1.0


class SequenceWatch:
    """Follows the sequence numbers (0 to 255, wrapping) of one sender."""

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        self._newest: int | None = None
        self._advanced_s = 0.0

    def is_late(self, sequence: int, now: float) -> bool:
        """Take in a packet's number; True when a newer packet came before it, or it is a double.

        After a second without progress any number is taken as new: the sender restarted, or so
        much was lost that the number says nothing.
        """
        if (
            self._newest is not None
            and now - self._advanced_s < _RESYNC_S
            and not 0 < (sequence - self._newest) % 256 < _HALF
        ):
            return True
        self._newest = sequence
        self._advanced_s = now
        return False
