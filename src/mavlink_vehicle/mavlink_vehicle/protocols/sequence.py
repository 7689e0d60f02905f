"""Sorts packets into the order of sending by MAVLink's sequence number.

HEARTBEAT carries no time, and an old one that arrives after a newer one would show a mode that
has been left since: it would look like a pilot's intervention.
"""

from __future__ import annotations

_HALF = 128
_RESYNC_S = 1.0


class SequenceOrder:
    """Follows the sequence numbers (0 to 255, wrapping) of one sender.

    Attributes:
        last: place of the last packet in the order of sending.
        arrived: number of packets that came.
        missing: number of packets that did not come, or have not yet.
    """

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        self.last = -1
        self.arrived = self.missing = 0
        self._newest: int | None = None
        self._advanced_s = 0.0

    def place(self, sequence: int, now: float) -> int:
        """Return the packet's place in the order of sending; it grows from packet to packet.

        A number up to half the circle behind the newest is a late packet. After a second
        without progress any number is taken as a new one: the sender restarted, or half a circle
        or more was lost.
        """
        self.arrived += 1
        newest = self._newest
        if newest is None:
            self.last = self._newest = sequence
            self._advanced_s = now
            return sequence
        ahead = (sequence - newest) & 0xFF
        if ahead >= _HALF and now - self._advanced_s < _RESYNC_S:
            self.last = newest + ahead - 256
            self.missing -= 1
            return self.last
        if ahead:
            self.missing += ahead - 1
            self._newest = newest + ahead
            self._advanced_s = now
        self.last = newest + ahead
        return self.last


class ModeOrder(SequenceOrder):
    """Sorts the messages of one vehicle, of which some show its mode."""

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        super().__init__()
        self._mode_place = self._beat_place = -1

    def begin_again(self) -> None:
        """Follow another sender from now on."""
        self._newest = None
        self._mode_place = self._beat_place = -1

    def follow(self, sequence: int, is_heartbeat: bool, is_mode: bool, now: float) -> bool | None:
        """Record a message; returns whether its mode has been left since, None if all it says.

        A HEARTBEAT that was overtaken by CURRENT_MODE would show a mode that has been left
        since, but it is a sign of life, and shows whether the vehicle is armed.

        Args:
            sequence: its sequence number.
            is_heartbeat: whether it is a HEARTBEAT.
            is_mode: whether it is a CURRENT_MODE.
            now: time in seconds.
        """
        place = self.place(sequence, now)
        if not is_heartbeat and not is_mode:
            return False
        is_old = place < self._mode_place
        if is_old and (is_mode or place < self._beat_place):
            return None
        self._mode_place = max(self._mode_place, place)
        if is_heartbeat:
            self._beat_place = place
        return is_old
