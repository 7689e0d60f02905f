"""MAVLink's checksum (CRC-16/MCRF4XX) of many packets at once.

https://mavlink.io/en/guide/serialization.html#checksum: over the packet without its first
byte and without the checksum, then over the message's extra byte.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from flight_logs.grouping import groups

_POLYNOMIAL = 0x8408
_START = 0xFFFF
_CHECKSUM_SIZE = 2
_BLOCK_ROWS = 8192  # what is worked on at a time stays in the processor's cache


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
        starts: where the packets begin, shape (k,), each with 4 bytes left behind its checksum.
        covered: bytes between a packet's first one and its checksum, shape (k,).
        extras: the messages' extra bytes, shape (k,).

    Returns:
        Shape (k,).
    """
    right = np.zeros(len(starts), dtype=np.bool_)
    for size, places in groups(covered):
        for begin in range(0, len(places), _BLOCK_ROWS):
            block = places[begin : begin + _BLOCK_ROWS]
            right[block] = _right_block(data, starts[block] + 1, size, extras[block])
    return right


def _right_block(
    data: NDArray[np.uint8], starts: NDArray[np.int64], size: int, extras: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    odd = size % 2
    matrix = rows(data, starts, size + _CHECKSUM_SIZE + odd)
    sent = matrix[:, size] | matrix[:, size + 1].astype(np.uint16) << 8
    matrix[:, size] = extras
    pairs = np.ascontiguousarray(matrix.view("<u2").T)
    by_byte, by_pair = _tables()
    crc = np.full(len(starts), _START, dtype=np.uint16)
    for column in pairs[: (size + odd) // 2]:
        crc = by_pair.take(crc ^ column)
    if not odd:
        crc = by_byte[(crc ^ extras) & 0xFF] ^ crc >> 8
    return np.asarray(crc == sent)


@cache
def _tables() -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """The checksum after one byte, by that byte, and after two, by both: it has only 16 bits."""
    by_byte = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        by_byte = np.where(by_byte & 1, by_byte >> 1 ^ _POLYNOMIAL, by_byte >> 1).astype(np.uint16)
    by_pair = np.arange(1 << 16, dtype=np.uint16)
    for _ in range(2):
        by_pair = by_byte[by_pair & 0xFF] ^ by_pair >> 8
    return by_byte, by_pair
