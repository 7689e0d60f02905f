"""MAVLink's checksum (CRC-16/MCRF4XX) of many packets at once.

https://mavlink.io/en/guide/serialization.html#checksum: over the packet without its first
byte and without the checksum, then over the message's extra byte.

A checksum is the remainder of a polynomial over bits, divided by x^16 + x^12 + x^5 + 1. The
squares of this divisor divide as well: x^256 leaves what x^192 + x^80 + 1 leaves. So all words of
many packets but the last are added to later ones, without a table.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_POLYNOMIAL = 0x8408
_START = 0xFFFF
_WORD_SIZE = 8
_MASKS = np.array([(1 << 64) - (1 << 64 - 8 * count) for count in range(9)], dtype=np.uint64)
"""For a word of which that many bytes, the last ones, belong to a packet."""
_COVERED_LIMIT = 265
"""Bytes that a checksum covers at most: a header without its first byte, and a full payload."""
# Packets of similar length are worked on together: as many words as the widest of them has.
_WIDTHS = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 16, 24, 34)
_BLOCK = 8192  # a block stays in the processor's cache


def rows(data: NDArray[np.uint8], starts: NDArray[np.int64], size: int) -> NDArray[np.uint8]:
    """Copy `size` bytes from each of `starts`.

    Args:
        data: bytes, shape (n,).
        starts: places in `data`, shape (k,), each with `size` bytes left.
        size: 1 or more.

    Returns:
        Shape (k, size).
    """
    # Records of one byte's stride: a row is then one copy of memory.
    windows: NDArray[np.void] = np.ndarray(
        (len(data) - size + 1,), dtype=f"V{size}", buffer=data, strides=(1,)
    )
    return windows[starts].view(np.uint8).reshape(len(starts), size)


def right_checksums(
    data: NDArray[np.uint8],
    ends: NDArray[np.int64],
    covered: NDArray[np.int64],
    extras: NDArray[np.uint8],
) -> NDArray[np.bool_]:
    """Return for each packet whether its checksum is right.

    Args:
        data: bytes, shape (n,).
        ends: where the packets' checksums stand, shape (k,), each with 8 bytes left, and as many
            before it as the widest packets have.
        covered: bytes between a packet's first one and its checksum, shape (k,).
        extras: the messages' extra bytes, shape (k,).

    Returns:
        Shape (k,).
    """
    kind = _tables().width.take(covered)
    order = np.argsort(kind, kind="stable")
    right = np.empty(len(order), dtype=np.bool_)
    begin = 0
    for width, packets in enumerate(np.bincount(kind).tolist()):
        for first in range(begin, begin + packets, _BLOCK):
            block = order[first : min(first + _BLOCK, begin + packets)]
            right[block] = _right_block(data, ends[block], covered[block], extras[block], width)
        begin += packets
    return right


def _right_block(
    data: NDArray[np.uint8],
    ends: NDArray[np.int64],
    covered: NDArray[np.int64],
    extras: NDArray[np.uint8],
    width: int,
) -> NDArray[np.bool_]:
    """Return the same for packets whose covered bytes fill at most `width` words."""
    cells = rows(data, ends - width * _WORD_SIZE, (width + 1) * _WORD_SIZE)
    words = np.ascontiguousarray(cells.view("<u8").T)
    for place in range(width - int(covered.min()) // _WORD_SIZE):
        inside = covered - (width - 1 - place) * _WORD_SIZE
        words[place] &= _MASKS.take(inside, mode="clip")
    tables = _tables()
    sent = words[width].astype(np.uint16)
    # The value that the checksum of the covered bytes alone must have, if it began with 0.
    wanted = tables.before_byte.take(sent ^ tables.by_byte.take(extras))
    wanted ^= tables.of_start.take(covered)
    return np.asarray(_remainders(words[:width]) == wanted)


def _remainders(words: NDArray[np.uint64]) -> NDArray[np.uint16]:
    """Return what polynomials leave; each is a column of one word or more, which change."""
    count = len(words)
    for place in range(count - 1):
        word = words[place]
        if place < count - 4:  # by x^256 = x^192 + x^80 + 1
            words[place + 1] ^= word
            words[place + 2] ^= word << 48
            words[place + 3] ^= word >> 16
            words[place + 4] ^= word
        elif place < count - 2:  # by x^128 = x^96 + x^40 + 1
            word ^= word << 32
            words[place + 1] ^= word >> 32 ^ word << 24
            words[place + 2] ^= word >> 40 ^ word
        else:  # by x^64 = x^48 + x^20 + 1
            high = word << 44
            word ^= word << 16
            word ^= word << 32
            word ^= high
            words[place + 1] ^= word >> 48 ^ word >> 20 ^ word
    by_pair = _tables().by_pair
    pairs = words[-1].view("<u2").reshape(-1, 4)
    crc: NDArray[np.uint16] = by_pair.take(pairs[:, 0])
    for column in (1, 2, 3):
        crc = by_pair.take(crc ^ pairs[:, column])
    return crc


class _Tables(NamedTuple):
    """How a checksum continues.

    Attributes:
        by_byte: after one byte it is `by_byte[low byte of (crc ^ byte)] ^ crc >> 8`,
        by_pair: and after two, as it has no more than 16 bits, `by_pair[crc ^ pair]`.
        before_byte: what it was, by what it is after a byte 0.
        of_start: what the start has become after that many bytes 0.
        width: words for that many bytes, of `_WIDTHS`.
    """

    by_byte: NDArray[np.uint16]
    by_pair: NDArray[np.uint16]
    before_byte: NDArray[np.uint16]
    of_start: NDArray[np.uint16]
    width: NDArray[np.uint8]


@cache
def _tables() -> _Tables:
    by_byte = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        by_byte = np.where(by_byte & 1, by_byte >> 1 ^ _POLYNOMIAL, by_byte >> 1).astype(np.uint16)
    numbers = np.arange(1 << 16, dtype=np.uint16)
    after_byte = by_byte[numbers & 0xFF] ^ numbers >> 8
    before_byte = np.empty_like(numbers)
    before_byte[after_byte] = numbers
    of_start = np.full(_COVERED_LIMIT + 1, _START, dtype=np.uint16)
    for count in range(_COVERED_LIMIT):
        of_start[count + 1] = after_byte[of_start[count]]
    sizes = _WORD_SIZE * np.array(_WIDTHS)
    widths = np.array(_WIDTHS, dtype=np.uint8)
    width = widths[np.searchsorted(sizes, np.arange(_COVERED_LIMIT + 1))]
    return _Tables(by_byte, after_byte[after_byte], before_byte, of_start, width)
