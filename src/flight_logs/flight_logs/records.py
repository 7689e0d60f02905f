"""Turns packet positions into records: one structured array per message."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.checksums import rows
from flight_logs.dialect import PAYLOAD_OFFSET, MessageTable, message_indices, messages
from flight_logs.framing import MAGIC_1, STAMP_SIZE, Packets
from flight_logs.grouping import grouped

Records: TypeAlias = NDArray[np.void]
"""A structured array of one message, shape (n,): see `dialect.MessageTable.dtype`."""

HEADERS = np.dtype(
    [("time_s", "<f8"), ("system", "u1"), ("component", "u1"), ("sequence_number", "u1")]
)
"""What is known of a packet whatever it holds."""

_HEADER_1 = 6
_SOURCE_SIZE = 3
"""Sequence number, system and component stand side by side, behind length (and flags)."""


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
    order, kinds = grouped(message_indices(packets.number))
    packets, time_s = packets.at(order), time_s[order]
    version_1 = packets.payload - packets.start == _HEADER_1
    source = rows(data, packets.start + np.where(version_1, 2, 4), _SOURCE_SIZE)
    found = {}
    for index, chosen in kinds:
        if wanted is None or table[index].name in wanted:
            records = _records(data, packets.at(chosen), table[index])
            records["time_s"] = time_s[chosen]
            records["sequence_number"], records["system"], records["component"] = source[chosen].T
            found[table[index].name] = records
    return found


def _records(data: NDArray[np.uint8], packets: Packets, message: MessageTable) -> Records:
    """Return records with the messages' fields; what stands before those is zero."""
    records: Records = np.zeros(len(packets), dtype=message.dtype)
    if message.size:
        payload = rows(data, packets.payload, message.size)
        if packets.length.min() < message.size:
            # Zeros at the end of a payload aren't sent; the checksum follows instead.
            columns = np.arange(message.size, dtype=np.uint8)
            payload *= columns < packets.length[:, np.newaxis]
        bytes_of: NDArray[Any] = records.view(np.uint8).reshape(len(packets), -1)
        bytes_of[:, PAYLOAD_OFFSET : PAYLOAD_OFFSET + message.size] = payload
    return records


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
