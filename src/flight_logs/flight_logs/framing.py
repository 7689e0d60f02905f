"""Finds the packets in a piece of a tlog, all at once.

Every byte that could begin a packet is a candidate. Nearly all candidates that are none fall
away because no other packet follows where it should; the checksum decides about the rest.
What damage leaves behind is searched candidate by candidate, so that a packet is found
wherever it begins. A packet is what has a right checksum and doesn't begin inside another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight_logs.checksums import right_checksums, rows
from flight_logs.dialect import crc_extras, message_indices

STAMP_SIZE = 8
PACKET_SIZE_LIMIT = 280
"""Bytes of the longest packet: MAVLink 2 with a full payload and a signature."""
PADDING = 512
"""Bytes that must follow a piece in its buffer: nothing is read beyond."""

MAGIC_1, MAGIC_2 = 0xFE, 0xFD
_HEADER_1, _HEADER_2 = 6, 10
_CHECKSUM_SIZE = 2
_SIGNATURE_SIZE = 13
_FLAG_SIGNED = 0x01


@dataclass(frozen=True)
class Packets:
    """Packets; all arrays of shape (n,), in the order of the file.

    Attributes:
        start: where the first byte is, in the buffer.
        payload: where the payload begins.
        length: bytes of the payload, as sent.
        stop: where the packet ends.
        signed: whether a signature follows the checksum.
        number: the message's number.
    """

    start: NDArray[np.int64]
    payload: NDArray[np.int64]
    length: NDArray[np.uint8]
    stop: NDArray[np.int64]
    signed: NDArray[np.bool_]
    number: NDArray[np.int64]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.start)

    def at(self, places: NDArray[np.int64] | slice) -> Packets:
        """Return some of them."""
        return Packets(
            self.start[places],
            self.payload[places],
            self.length[places],
            self.stop[places],
            self.signed[places],
            self.number[places],
        )


@dataclass(frozen=True)
class Loose:
    """Bytes in the place of a packet that are none; all arrays of shape (n,).

    Attributes:
        start: where the first byte is, in the buffer.
        stop: where it ends.
        number: the message's number.
        known: whether the dialect has that message, so that the checksum must be wrong.
    """

    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    number: NDArray[np.int64]
    known: NDArray[np.bool_]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.start)

    def at(self, places: NDArray[np.int64] | slice) -> Loose:
        """Return some of them."""
        return Loose(self.start[places], self.stop[places], self.number[places], self.known[places])


def find_packets(data: NDArray[np.uint8], first: int, end: int) -> tuple[Packets, Loose]:
    """Find the packets that lie in `data[first:end]`.

    Args:
        data: bytes, with `PADDING` zeros from `end` on.
        first: where the first packet may begin.
        end: where the data end.

    Returns:
        The packets, none overlapping another; and, outside the packets and their times, what
        another packet follows as if it were one.
    """
    candidates = _candidates(data, first, end)
    start, stop = candidates.start, candidates.stop
    known = message_indices(candidates.number) >= 0
    # A signature is not covered by the checksum: another packet may stand in what damage left.
    checked = candidates.payload + candidates.length + _CHECKSUM_SIZE
    follower = data[np.minimum(stop + STAMP_SIZE, end)]
    linked = (stop == end) | (follower == MAGIC_1) | (follower == MAGIC_2)
    places = _right(data, candidates, np.flatnonzero(known & linked))
    places = places[_apart(start[places], checked[places])]
    unlinked = np.flatnonzero(known & ~linked)
    touching = _touching(start[unlinked], checked[unlinked], start[places], checked[places])
    found = _right(data, candidates, unlinked[~touching])
    if len(found):
        places = np.sort(np.append(places, found[_apart(start[found], checked[found])]))
    stop[places[:-1]] = np.minimum(stop[places[:-1]], start[places[1:]])
    linked[places] = False
    loose = np.flatnonzero(linked)
    before, behind = start[loose] - STAMP_SIZE, stop[loose] + STAMP_SIZE
    loose = loose[~_touching(before, behind, start[places], stop[places])]
    loose = loose[_apart(start[loose], stop[loose] + STAMP_SIZE)]
    found_loose = Loose(start[loose], stop[loose], candidates.number[loose], known[loose])
    return candidates.at(places), found_loose


def _candidates(data: NDArray[np.uint8], first: int, end: int) -> Packets:
    """Return where packets could begin."""
    # In arithmetic of one byte, 0xFD + 3 is 0 and 0xFE + 3 is 1.
    start = first + np.flatnonzero(data[first:end] + np.uint8(3) < np.uint8(2))
    header = rows(data, start, _HEADER_2)
    version_2 = header[:, 0] == MAGIC_2
    flags = header[:, 2] * version_2
    signed = flags == _FLAG_SIGNED
    payload = start + np.where(version_2, _HEADER_2, _HEADER_1)
    stop = payload + header[:, 1] + _CHECKSUM_SIZE + _SIGNATURE_SIZE * signed
    possible = (flags <= _FLAG_SIGNED) & (stop <= end)
    # A header whose bytes are all the same is what an erased medium holds.
    alike = np.flatnonzero(header[:, 0] == header[:, 1])
    possible[alike] &= (header[alike, 2:_HEADER_1] != header[alike, :1]).any(axis=1)
    keep = np.flatnonzero(possible)
    header, version_2 = header[keep], version_2[keep]
    long_number = header[:, 7:].astype(np.int64) @ np.array([1, 1 << 8, 1 << 16])
    number = np.where(version_2, long_number, header[:, 5])
    return Packets(start[keep], payload[keep], header[:, 1], stop[keep], signed[keep], number)


def _right(
    data: NDArray[np.uint8], candidates: Packets, places: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return those of the places where the checksum is right."""
    start = candidates.start[places]
    covered = candidates.payload[places] + candidates.length[places] - start - 1
    extras = crc_extras()[message_indices(candidates.number[places])]
    return places[right_checksums(data, start, covered, extras)]


def _apart(start: NDArray[np.int64], stop: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell what to keep so that nothing begins before the end of something that is kept."""
    keep = np.ones(len(start), dtype=np.bool_)
    clashes = np.flatnonzero(start[1:] < np.maximum.accumulate(stop)[:-1]) + 1
    last = 0
    for index in clashes.tolist():
        if keep[index - 1]:
            last = index - 1
        keep[index] = start[index] >= stop[last]
    return keep


def _touching(
    start: NDArray[np.int64],
    stop: NDArray[np.int64],
    packet_start: NDArray[np.int64],
    packet_stop: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Tell which of the pieces from `start` to `stop` share a byte with one of the packets."""
    # Of the packets that end behind a piece's start, the first is the only one to ask.
    following = np.searchsorted(packet_stop, start, side="right")
    starts = np.append(packet_start, np.iinfo(np.int64).max)
    return np.asarray(starts[following] < stop)
