"""The endpoints of the router and their counters. Pure: time is an argument."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TypeAlias

from mavlink_vehicle.codec import CodecStatistics, Sender

Source: TypeAlias = tuple[int, int]
"""System and component id of who sent a frame."""


@dataclass
class LinkStatistics(CodecStatistics):
    """Counts of a link since the start, those of its codecs included.

    Attributes:
        forwarded: frames that came here and were passed on to other endpoints.
        sent: frames that went out here, our own and forwarded ones.
        unsent: did not go out here: no room, not connected, or nobody there.
        looped: dropped, because we had sent them ourselves.
        duplicates: dropped, because the same frame had just come by another endpoint.
        spoofed: dropped, because a ground station spoke in the name of a vehicle, or in ours.
        throttled: dropped undecoded, because too many came.
        withheld: not passed on to ground stations, because too much was to be passed on.
        unrouted: for a system that was not heard anywhere else; not passed on.
        beyond_mavlink_1: passed on in MAVLink 2 to a vehicle that speaks MAVLink 1 only, because
            MAVLink 1 has no form of them.
    """

    forwarded: int = 0
    sent: int = 0
    unsent: int = 0
    looped: int = 0
    duplicates: int = 0
    spoofed: int = 0
    throttled: int = 0
    withheld: int = 0
    unrouted: int = 0
    beyond_mavlink_1: int = 0

    @classmethod
    def of(cls, other: CodecStatistics) -> LinkStatistics:
        """Return the counts of a link that has one codec."""
        link = cls()
        link.add(other)
        return link

    def add(self, other: CodecStatistics) -> None:
        """Add the counts of a codec or of another link."""
        for count in fields(other):
            if count.name != "lost":
                here = getattr(self, count.name)
                setattr(self, count.name, here + getattr(other, count.name))
        for source, lost in other.lost.items():
            self.lost[source] = self.lost.get(source, 0) + lost


class Heard(Sender):
    """The frames an endpoint has received from one source.

    Attributes:
        heard_s: when the last one came.
        current: whether the source is to be reached by this endpoint: the last that heard it.
    """

    __slots__ = ("current", "heard_s")

    def __init__(self) -> None:
        """Nothing yet."""
        super().__init__()
        self.heard_s = -math.inf
        self.current = False


class Endpoint:
    """One who can be sent to.

    Attributes:
        station: whether it belongs to a ground station, not to vehicles.
        sources: who was heard there.
        counts: what the router did with its frames; the codec's own counts are not in it.
    """

    def __init__(self, station: bool) -> None:
        """Begin without sources."""
        self.station = station
        self.sources: dict[Source, Heard] = {}
        self.counts = LinkStatistics()


class TokenBucket:
    """Lets a number of frames through per second, and a burst beyond that."""

    def __init__(self, rate_hz: float, burst: float) -> None:
        """Begin full."""
        self._rate_hz = rate_hz
        self._burst = burst
        self._tokens = burst
        self._filled_s = -math.inf

    def take(self, count: float, now: float) -> bool:
        """Take `count` at once if that many are there, else none."""
        tokens = self._tokens + (now - self._filled_s) * self._rate_hz
        if tokens > self._burst:
            tokens = self._burst
        self._filled_s = now
        enough = count <= tokens
        self._tokens = tokens - count if enough else tokens
        return enough


def count_frames(data: bytes) -> int:
    """Count what in `data` would have to be looked at as a frame, without looking closely.

    Garbage counts, too: each place where a frame seems to begin costs as much as a frame.
    """
    count = position = 0
    end = len(data)
    while position < end:
        count += 1
        magic = data[position]
        if magic == 0xFD and position + 2 < end:
            position += data[position + 1] + (25 if data[position + 2] & 1 else 12)
        elif magic == 0xFE and position + 1 < end:
            position += data[position + 1] + 8
        else:
            places = (data.find(b"\xfd", position + 1), data.find(b"\xfe", position + 1))
            position = min((place for place in places if place >= 0), default=end)
    return count
