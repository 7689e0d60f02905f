"""RTCM corrections that arrive as GPS_RTCM_DATA, put together as the firmwares do it."""

from __future__ import annotations

from collections import deque

from mavlink_sitl.mavlink.codec import Message

_FULL_BYTES, _FRAGMENTS_MAX = 180, 4
_KEPT = 200


class Corrections:
    """The RTCM corrections that reach an ArduPilot's GPS receiver, assembled from fragments.

    After AP_GPS::handle_gps_rtcm_fragment.

    Attributes:
        given: the last pieces, oldest first.
    """

    def __init__(self) -> None:
        self.given: deque[bytes] = deque(maxlen=_KEPT)
        self._pieces: dict[int, bytes] = {}
        self._sequence = -1

    def take(self, message: Message) -> None:
        """Process GPS_RTCM_DATA."""
        if message.len > _FULL_BYTES:
            return
        data = bytes(message.data[: message.len])
        if not message.flags & 1:
            self.given.append(data)
            return
        sequence, place = message.flags >> 3, message.flags >> 1 & 3
        if sequence == self._sequence and self._pieces.get(place) == data:
            return
        if sequence != self._sequence or place in self._pieces:
            self._drop(is_other=sequence != self._sequence)
        self._sequence = sequence
        self._pieces[place] = data
        short = [index for index, piece in self._pieces.items() if len(piece) < _FULL_BYTES]
        count = short[-1] + 1 if short else _FRAGMENTS_MAX
        if sorted(self._pieces) == list(range(count)):
            self._give(count)

    def _give(self, count: int) -> None:
        self.given.append(b"".join(self._pieces[index] for index in range(count)))
        self._pieces.clear()

    def _drop(self, *, is_other: bool) -> None:
        """Drop what is incomplete, since another sequence begins, or a fragment comes again."""
        self._pieces.clear()


class Px4Corrections(Corrections):
    """The same of a PX4 1.17, which gives each fragment as it comes (gps.cpp)."""

    def take(self, message: Message) -> None:
        """Process GPS_RTCM_DATA."""
        self.given.append(bytes(message.data[: min(message.len, _FULL_BYTES)]))


class AssembledPx4Corrections(Corrections):
    """The same of a PX4 1.18, which assembles them, too (its page on RTK GPS).

    Some senders leave out the empty fragment after as many full ones: these count as complete when
    another sequence begins.
    """

    def _drop(self, *, is_other: bool) -> None:
        count = len(self._pieces)
        runs = count > 0 and sorted(self._pieces) == list(range(count))
        if is_other and runs and all(len(each) == _FULL_BYTES for each in self._pieces.values()):
            self._give(count)
        self._pieces.clear()
