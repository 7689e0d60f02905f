"""MAVLink's checksum (CRC-16/MCRF4XX) of many packets at once.

https://mavlink.io/en/guide/serialization.html#checksum: over the packet without its first
byte and without the checksum, then over the message's extra byte.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_POLYNOMIAL = 0x8408
_START = 0xFFFF
_CHECKSUM_SIZE = 2
_BLOCK_ROWS = 8192  # what is worked on at a time stays in the processor's cache
# Packets of similar length are worked on together, in rows of these widths. The first is more
# than the longest header and payload have.
_WIDTHS = (266, 192, 128, 96, 80, 64, 56, 48, 40, 32, 24, 16, 0)


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
    starts: NDArray[np.int64],
    covered: NDArray[np.int64],
    extras: NDArray[np.uint8],
) -> NDArray[np.bool_]:
    """Tell for each packet whether its checksum is right.

    Args:
        data: bytes, shape (n,).
        starts: where the packets begin, shape (k,), each with 270 bytes left behind it.
        covered: bytes between a packet's first one and its checksum, shape (k,).
        extras: the messages' extra bytes, shape (k,).

    Returns:
        Shape (k,).
    """
    order = np.argsort(covered.astype(np.uint16), kind="stable")[::-1]
    starts, covered, extras = starts[order] + 1, covered[order], extras[order]
    right = np.empty(len(order), dtype=np.bool_)
    begin = 0
    for width, below in pairwise(_WIDTHS):
        end = int(np.searchsorted(-covered, -below))
        for first in range(begin, end, _BLOCK_ROWS):
            block = slice(first, min(first + _BLOCK_ROWS, end))
            matrix = rows(data, starts[block], width + _CHECKSUM_SIZE)
            right[block] = _right_block(matrix, covered[block], extras[block])
        begin = end
    result = np.empty_like(right)
    result[order] = right
    return result


def _right_block(
    matrix: NDArray[np.uint8], covered: NDArray[np.int64], extras: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Tell of packets in rows, longest first, whether the checksums behind them are right."""
    cells = matrix.reshape(-1)
    ends = np.arange(0, len(cells), matrix.shape[1]) + covered
    sent = cells[ends] | cells[ends + 1].astype(np.uint16) << 8
    cells[ends] = extras
    pairs = np.ascontiguousarray(matrix.view("<u2").T)
    by_byte, by_pair = _tables()
    crc = np.full(len(matrix), _START, dtype=np.uint16)
    whole_pairs = (covered + 1) // 2
    longer = np.searchsorted(-whole_pairs, -np.arange(int(whole_pairs[0])))
    for column, count in enumerate(longer.tolist()):
        crc[:count] = by_pair.take(crc[:count] ^ pairs[column, :count])
    # The extra byte makes an odd number of bytes of an even one.
    with_last = by_byte[(crc ^ extras) & 0xFF] ^ crc >> 8
    return np.asarray(np.where(covered % 2, crc, with_last) == sent)


@cache
def _tables() -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Make the table by which a checksum continues.

    After one byte it is `by_byte[low byte of (crc ^ byte)] ^ crc >> 8`, and after two, as it has
    no more than 16 bits, `by_pair[crc ^ pair]`.
    """
    by_byte = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        by_byte = np.where(by_byte & 1, by_byte >> 1 ^ _POLYNOMIAL, by_byte >> 1).astype(np.uint16)
    by_pair = np.arange(1 << 16, dtype=np.uint16)
    for _ in range(2):
        by_pair = by_byte[by_pair & 0xFF] ^ by_pair >> 8
    return by_byte, by_pair
