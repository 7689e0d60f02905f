"""Where the packets of a piece of a tlog are, found for all of them at once.

Every byte that could begin a packet is a candidate. Nearly all candidates that are none fall
away because no other packet follows where it should; the checksum decides about the rest.
What damage leaves behind is searched candidate by candidate, so that a packet is found
wherever it begins. A packet is what has a right checksum and doesn't begin inside another.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from flight_logs.checksums import right_checksums
from flight_logs.dialect import crc_extras, index_by_number

STAMP_SIZE = 8
PACKET_SIZE_LIMIT = 280
"""Bytes of the longest packet: MAVLink 2 with a full payload and a signature."""
PADDING = 512
"""Bytes that must follow a piece in its buffer: nothing is read beyond."""

_MAGIC_1, _MAGIC_2 = 0xFE, 0xFD
_HEADER_1, _HEADER_2 = 6, 10
_CHECKSUM_SIZE = 2
_SIGNATURE_SIZE = 13
_FLAG_SIGNED = 0x01


@dataclass(frozen=True)
class Packets:
    """Packets, or what could be some; all arrays of shape (n,), in the order of the file.

    Attributes:
        start: where the first byte is, in the buffer.
        payload: where the payload begins.
        length: bytes of the payload, as sent.
        stop: where the packet ends.
        message: place in `dialect.messages()`; -1 for one that the dialect doesn't have.
        number: message id.
        signed: whether a signature follows the checksum.
        linked: another packet begins where it should after this one, or the data end there.
    """

    start: NDArray[np.int64]
    payload: NDArray[np.int64]
    length: NDArray[np.int64]
    stop: NDArray[np.int64]
    message: NDArray[np.int16]
    number: NDArray[np.int64]
    signed: NDArray[np.bool_]
    linked: NDArray[np.bool_]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.start)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.int64] | slice) -> Packets:
        """Return some of them: a mask, places or a slice."""
        return Packets(*(getattr(self, field.name)[chosen] for field in fields(self)))


def find_packets(data: NDArray[np.uint8], first: int, end: int) -> tuple[Packets, Packets]:
    """Find the packets that lie in `data[first:end]`.

    Args:
        data: bytes, with `PADDING` zeros from `end` on.
        first: where the first packet may begin.
        end: where the data end.

    Returns:
        The packets, none overlapping another; and what looks like a packet of a message that
        the dialect doesn't have, or like one whose checksum is wrong, outside the packets.
    """
    candidates = _candidates(data, first, end)
    known = candidates.message >= 0
    linked = candidates[known & candidates.linked]
    packets = _without_overlaps(linked[_right(data, linked)])
    rest = candidates[known & ~candidates.linked]
    rest = rest[~_overlap(rest.start, rest.stop, packets)]
    found = rest[_right(data, rest)]
    if len(found):
        packets = _merged(packets, _without_overlaps(found))
    loose = candidates[candidates.linked]
    loose = loose[~_overlap(loose.start - STAMP_SIZE, loose.stop + STAMP_SIZE, packets)]
    return packets, _without_overlaps(loose, apart=STAMP_SIZE)


def _candidates(data: NDArray[np.uint8], first: int, end: int) -> Packets:
    # In arithmetic of one byte, 0xFD + 3 is 0 and 0xFE + 3 is 1.
    start = first + np.flatnonzero(data[first:end] + np.uint8(3) < np.uint8(2))
    version_2 = data[start] == _MAGIC_2
    flags = np.where(version_2, data[start + 2], 0).astype(np.uint8)
    # A row of equal bytes, as an erased medium leaves it, is no header.
    keep = (flags <= _FLAG_SIGNED) & (version_2 | _bytes_differ(data, start))
    start, version_2, signed = start[keep], version_2[keep], flags[keep] == _FLAG_SIGNED
    payload = start + np.where(version_2, _HEADER_2, _HEADER_1)
    length = data[start + 1].astype(np.int64)
    stop = payload + length + _CHECKSUM_SIZE + _SIGNATURE_SIZE * signed
    low = data[payload - 1].astype(np.int64)
    number = np.where(
        version_2, data[start + 7] | data[start + 8].astype(np.int64) << 8 | low << 16, low
    )
    follower = data[np.minimum(stop + STAMP_SIZE, end)]
    index = index_by_number()
    message = index[np.minimum(number, len(index) - 1)]
    linked = (stop == end) | (follower == _MAGIC_1) | (follower == _MAGIC_2)
    found = Packets(start, payload, length, stop, message, number, signed, linked)
    return found[stop <= end]


def _bytes_differ(data: NDArray[np.uint8], start: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell where the bytes of a MAVLink 1 header aren't all the same."""
    first = data[start]
    differ = np.zeros(len(start), dtype=np.bool_)
    for offset in range(1, _HEADER_1):
        differ |= data[start + offset] != first
    return differ


def _right(data: NDArray[np.uint8], packets: Packets) -> NDArray[np.bool_]:
    covered = packets.payload + packets.length - packets.start - 1
    return right_checksums(data, packets.start, covered, crc_extras()[packets.message])


def _without_overlaps(packets: Packets, apart: int = 0) -> Packets:
    """Leave out what begins before the end (and `apart` bytes) of one that is kept."""
    start, stop = packets.start, packets.stop + apart
    clashes = np.flatnonzero(start[1:] < np.maximum.accumulate(stop)[:-1]) + 1
    if len(clashes) == 0:
        return packets
    keep = np.ones(len(packets), dtype=np.bool_)
    last = 0
    for index in clashes.tolist():
        if keep[index - 1]:
            last = index - 1
        keep[index] = start[index] >= stop[last]
    return packets[keep]


def _overlap(
    start: NDArray[np.int64], stop: NDArray[np.int64], packets: Packets
) -> NDArray[np.bool_]:
    """Tell which of the pieces from `start` to `stop` touch one of the packets."""
    # The first packet that ends behind a piece's start is the only one to ask.
    following = np.searchsorted(packets.stop, start, side="right")
    starts = np.append(packets.start, np.iinfo(np.int64).max)
    return np.asarray(starts[following] < stop)


def _merged(one: Packets, other: Packets) -> Packets:
    order = np.argsort(np.concatenate([one.start, other.start]), kind="stable")
    both = (
        np.concatenate([getattr(one, item.name), getattr(other, item.name)])
        for item in fields(Packets)
    )
    return Packets(*both)[order]
