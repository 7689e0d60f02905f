"""From the places of packets to records: one structured array for each message."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.checksums import rows
from flight_logs.dialect import HEADER_FIELDS, PAYLOAD_OFFSET, MessageTable, messages
from flight_logs.framing import Packets
from flight_logs.grouping import groups

Records: TypeAlias = NDArray[np.void]
"""A structured array of one message, shape (n,): see `dialect.MessageTable.dtype`."""

# Sequence number, system and component stand side by side, behind length (and flags).
_SOURCE_OFFSETS = {6: 2, 10: 4}


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
    found = {}
    for index, places in groups(packets.message):
        if wanted is None or table[index].name in wanted:
            found[table[index].name] = _records(
                data, packets.at(places), time_s[places], table[index]
            )
    return found


def _records(
    data: NDArray[np.uint8], packets: Packets, time_s: NDArray[np.float64], message: MessageTable
) -> Records:
    records: Records = np.zeros(len(packets), dtype=message.dtype)
    if message.size:
        payload = rows(data, packets.payload, message.size)
        if packets.length.min() < message.size:
            # Zeros at the end of a payload aren't sent; the checksum follows instead.
            columns = np.arange(message.size, dtype=np.uint8)
            payload *= columns < packets.length[:, np.newaxis]
        bytes_of: NDArray[Any] = records.view(np.uint8).reshape(len(packets), -1)
        bytes_of[:, PAYLOAD_OFFSET : PAYLOAD_OFFSET + message.size] = payload
    version_1 = packets.payload - packets.start == min(_SOURCE_OFFSETS)
    source = packets.start + np.where(version_1, _SOURCE_OFFSETS[6], _SOURCE_OFFSETS[10])
    values = (time_s, data[source + 1], data[source + 2], data[source])
    for name, value in zip(HEADER_FIELDS, values, strict=True):
        records[name] = value
    return records


def empty_records(message: MessageTable) -> Records:
    """Return no records of a message."""
    return np.zeros(0, dtype=message.dtype)
