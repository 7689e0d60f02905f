"""Turns packet positions into records: one structured array per message."""

from __future__ import annotations

from collections.abc import Collection
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.dialect import PAYLOAD_OFFSET, MessageTable, messages
from flight_logs.frames.checksums import rows
from flight_logs.frames.framing import MAGIC_1, STAMP_SIZE, Packets
from flight_logs.frames.grouping import grouped

Records: TypeAlias = NDArray[np.void]
"""A structured array of one message, shape (n,): see `dialect.MessageTable.dtype`."""

HEADERS = np.dtype(
    [("time_s", "<f8"), ("system", "u1"), ("component", "u1"), ("sequence_number", "u1")]
)
"""The fields known of every packet, whatever its message."""

_SOURCE_SIZE = 3
"""Sequence number, system and component stand side by side, behind length (and flags)."""
_MASKS = np.repeat([np.uint8(0xFF), np.uint8(0)], [PAYLOAD_OFFSET + 255, 280])
"""Where to cut a record from, so that its last byte of all bits is the payload's last."""


def records_by_name(
    data: NDArray[np.uint8],
    packets: Packets,
    time_s: NDArray[np.float64],
    wanted: Collection[str] | None,
) -> dict[str, Records]:
    """Decode the packets.

    Args:
        data: the bytes they are in.
        packets: where they are.
        time_s: time of each, shape (n,).
        wanted: names of the messages to decode; None for all.

    Returns:
        Records by the name of the message, in the order of the file.
    """
    table = messages()
    order, kinds = grouped(packets.index)
    payload, length = packets.payload[order], packets.length[order]
    heads = np.empty((len(order), 2), dtype="<u8")
    heads[:, 0] = time_s.view("<u8")[order]
    source = packets.source[order]
    heads[:, 1] = source >> 8 | (source & 0xFF) << 16
    found = {}
    for index, chosen in kinds:
        if wanted is None or table[index].name in wanted:
            found[table[index].name] = _records(
                data, payload[chosen], length[chosen], heads[chosen], table[index]
            )
    return found


def _records(
    data: NDArray[np.uint8],
    payload: NDArray[np.int64],
    length: NDArray[np.uint8],
    heads: NDArray[np.uint64],
    message: MessageTable,
) -> Records:
    """Return records of one message, zero where there is no field."""
    size = message.dtype.itemsize
    cells = rows(data, payload - PAYLOAD_OFFSET, size)
    # Zeros at the end of a payload aren't sent; the checksum follows instead.
    cells &= rows(_MASKS, 255 - np.minimum(length, message.size).astype(np.int64), size)
    cells.view("<u8")[:, :2] = heads
    return cells.view(message.dtype)[:, 0]


def headers_of(data: NDArray[np.uint8], start: NDArray[np.int64]) -> Records:
    """Return time, sender and sequence number of packets that can't be decoded, in their order.

    Args:
        data: the bytes they are in.
        start: where each begins, behind the eight bytes of its time; shape (n,).
    """
    headers: Records = np.zeros(len(start), dtype=HEADERS)
    if len(start):
        stamps_us = rows(data, start - STAMP_SIZE, STAMP_SIZE).view(">u8")[:, 0]
        headers["time_s"] = stamps_us.astype(np.float64) * 1e-6
        source = rows(data, start + np.where(data[start] == MAGIC_1, 2, 4), _SOURCE_SIZE)
        headers["sequence_number"], headers["system"], headers["component"] = source.T
    return headers


def empty_records(message: MessageTable) -> Records:
    """Return no records of a message."""
    return np.zeros(0, dtype=message.dtype)
