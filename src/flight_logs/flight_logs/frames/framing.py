"""Finds the packets in a piece of a tlog, all at once.

Every byte that could begin a packet is a candidate. Nearly all candidates that are none fall
away because no other packet follows where it should; the checksum decides about the rest.
The places around damage are searched candidate by candidate, so that a packet is found
wherever it begins. A packet is what has a right checksum and doesn't begin inside another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight_logs.dialect import crc_extras, message_indices
from flight_logs.frames.checksums import right_checksums, rows

STAMP_SIZE = 8
PACKET_SIZE_LIMIT = 280
"""Bytes of the longest packet: MAVLink 2 with a full payload and a signature."""
FRONT = 280
"""Bytes that must stand before a piece in its buffer: packets are cut out with some of them."""
PADDING = 512
"""Bytes that must follow a piece in its buffer: nothing is read beyond."""

MAGIC_1, MAGIC_2 = 0xFE, 0xFD
HEADER_1, HEADER_2 = 6, 10
_HEAD_SIZE = 20
"""Bytes of a time and a header, and what fills the last word of four."""
_CHECKSUM_SIZE = 2
_SIGNATURE_SIZE = 13
_FLAG_SIGNED = 0x01
_BLOCK_BYTES = 256 << 10  # a block stays in the processor's cache


@dataclass(frozen=True)
class Packets:
    """Packets; all arrays of shape (n,), in the order of the file.

    Attributes:
        start: where the first byte is, in the buffer.
        payload: where the payload begins.
        length: bytes of the payload, as sent.
        stop: where the packet ends.
        signed: whether a signature follows the checksum.
        index: place of the message in `dialect.messages()`.
        stamp_us: the eight bytes before it.
        source: sequence number, system and component, from the lowest byte on.
    """

    start: NDArray[np.int64]
    payload: NDArray[np.int64]
    length: NDArray[np.uint8]
    stop: NDArray[np.int64]
    signed: NDArray[np.bool_]
    index: NDArray[np.int16]
    stamp_us: NDArray[np.uint64]
    source: NDArray[np.uint32]

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
            self.index[places],
            self.stamp_us[places],
            self.source[places],
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
    number: NDArray[np.uint32]
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
        first: where the first packet may begin, `FRONT` or more.
        end: where the data end.

    Returns:
        The packets, none overlapping another; and, outside the packets and their times, what
        another packet follows as if it were one.
    """
    candidates, linked = _candidates(data, first, end)
    start, stop, known = candidates.start, candidates.stop, candidates.index >= 0
    # A signature is not covered by the checksum: another packet may stand in what damage left.
    checked = candidates.payload + candidates.length + _CHECKSUM_SIZE
    places = _right(data, candidates, np.flatnonzero(known & linked))
    places = _apart(places, start, checked)
    unlinked = np.flatnonzero(known & ~linked)
    touching = _touching(start[unlinked], checked[unlinked], start[places], checked[places])
    found = _right(data, candidates, unlinked[~touching])
    if len(found):
        places = np.sort(np.append(places, _apart(found, start, checked)))
    packets = candidates.at(places)
    np.minimum(packets.stop[:-1], packets.start[1:], out=packets.stop[:-1])
    linked[places] = False
    loose = np.flatnonzero(linked)
    before, behind = start - STAMP_SIZE, stop + STAMP_SIZE
    loose = loose[~_touching(before[loose], behind[loose], packets.start, packets.stop)]
    loose = _apart(loose, start, behind)
    number, _ = _numbers_and_sources(_heads(data, start[loose]))
    return packets, Loose(start[loose], stop[loose], number, known[loose])


def _candidates(data: NDArray[np.uint8], first: int, end: int) -> tuple[Packets, NDArray[np.bool_]]:
    """Return where packets could begin, and which another follows."""
    blocks = [
        _candidates_of_block(data, block, min(block + _BLOCK_BYTES, end), end)
        for block in range(first, max(end, first + 1), _BLOCK_BYTES)
    ]
    *columns, linked = (np.concatenate(column) for column in zip(*blocks, strict=True))
    return Packets(*columns), linked


def _heads(data: NDArray[np.uint8], start: NDArray[np.int64]) -> NDArray[np.uint8]:
    return rows(data, start - STAMP_SIZE, _HEAD_SIZE)


def _numbers_and_sources(heads: NDArray[np.uint8]) -> tuple[NDArray[Any], NDArray[Any]]:
    words = heads.view("<u4")
    number = words[:, 3] >> 24 | (words[:, 4] & 0xFFFF) << 8
    source = words[:, 3] & 0xFFFFFF
    old = np.flatnonzero(heads[:, STAMP_SIZE] == MAGIC_1)
    number[old] = heads[old, STAMP_SIZE + 5]
    source[old] = words[old, 2] >> 16 | (words[old, 3] & 0xFF) << 16
    return number, source


def _candidates_of_block(
    data: NDArray[np.uint8], first: int, last: int, end: int
) -> tuple[NDArray[np.generic], ...]:
    # In arithmetic of one byte, 0xFD + 3 is 0 and 0xFE + 3 is 1.
    start = first + np.flatnonzero(data[first:last] + np.uint8(3) < np.uint8(2))
    heads = _heads(data, start)
    stamp_us, header = heads[:, :STAMP_SIZE].view(">u8")[:, 0], heads[:, STAMP_SIZE:]
    magic, length = header[:, 0], header[:, 1]
    version_2 = magic == MAGIC_2
    flags = header[:, 2] * version_2
    signed = flags == _FLAG_SIGNED
    payload = start + (version_2 * np.uint8(HEADER_2 - HEADER_1) + np.uint8(HEADER_1))
    stop = payload + (length + (signed * np.uint16(_SIGNATURE_SIZE) + np.uint16(_CHECKSUM_SIZE)))
    possible = (flags <= _FLAG_SIGNED) & (stop <= end)
    # A header whose bytes are all the same is what an erased medium holds.
    alike = np.flatnonzero(magic == length)
    possible[alike] &= (header[alike, 2:HEADER_1] != header[alike, :1]).any(axis=1)
    follower = data[np.minimum(stop + STAMP_SIZE, end)]
    linked = (stop == end) | (follower + np.uint8(3) < np.uint8(2))
    number, source = _numbers_and_sources(heads)
    index = message_indices(number)
    index[~possible] = -1
    return start, payload, length, stop, signed, index, stamp_us, source, linked & possible


def _right(
    data: NDArray[np.uint8], candidates: Packets, places: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return those of the places where the checksum is right."""
    ends = candidates.payload[places] + candidates.length[places]
    covered = ends - candidates.start[places] - 1
    extras = crc_extras()[candidates.index[places]]
    return places[right_checksums(data, ends, covered, extras)]


def _apart(
    places: NDArray[np.int64], start: NDArray[np.int64], stop: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return those of the places that don't begin before the end of another that is kept."""
    start, stop = start[places], stop[places]
    if (start[1:] >= stop[:-1]).all():
        return places
    keep = np.ones(len(start), dtype=np.bool_)
    clashes = np.flatnonzero(start[1:] < np.maximum.accumulate(stop)[:-1]) + 1
    last = 0
    for index in clashes.tolist():
        if keep[index - 1]:
            last = index - 1
        keep[index] = start[index] >= stop[last]
    return places[keep]


def _touching(
    start: NDArray[np.int64],
    stop: NDArray[np.int64],
    packet_start: NDArray[np.int64],
    packet_stop: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return which of the pieces from `start` to `stop` share a byte with one of the packets."""
    # Of the packets that end behind a piece's start, the first is the only one to ask.
    following = np.searchsorted(packet_stop, start, side="right")
    starts = np.append(packet_start, np.iinfo(np.int64).max)
    return np.asarray(starts[following] < stop)
