"""The memory layout of each message, from pymavlink's definitions of the dialect.

Nothing here is written by hand but the names that NumPy has for C's types: the fields, their
order on the wire, their units and enums are those of the generated classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavlink_vehicle.codec import mavlink

HEADER_FIELDS = ("time_s", "system", "component", "sequence_number")
"""The fields before the message's own ones in each record"""

PAYLOAD_OFFSET = 16
"""Where the payload begins in a record: fields keep the alignment that the wire gives them."""

_HEADER_FORMATS = ("<f8", "u1", "u1", "u1")
_HEADER_OFFSETS = (0, 8, 9, 10)
_ALIGNMENT = 8
_FORMATS = {
    "char": "S1",
    "int8_t": "i1",
    "uint8_t": "u1",
    "int16_t": "<i2",
    "uint16_t": "<u2",
    "int32_t": "<i4",
    "uint32_t": "<u4",
    "int64_t": "<i8",
    "uint64_t": "<u8",
    "float": "<f4",
    "double": "<f8",
}


@dataclass(frozen=True)
class MessageTable:
    """One message of the dialect.

    Attributes:
        number: the message's id.
        name: as in the dialect, for example "ATTITUDE".
        size: bytes of the payload with all extensions, before zeros are cut off.
        crc_extra: the byte that each checksum includes beside the packet.
        dtype: of a record: `HEADER_FIELDS`, then the fields in the order of the wire.
        units: unit of each field that has one, as the dialect writes it ("degE7", "cm/s").
        enums: name of the enum of each field that has one.
        bitmasks: the fields whose values are sums of their enum's entries.
    """

    number: int
    name: str
    size: int
    crc_extra: int
    dtype: np.dtype[np.void]
    units: Mapping[str, str]
    enums: Mapping[str, str]
    bitmasks: frozenset[str]


@cache
def messages() -> tuple[MessageTable, ...]:
    """All messages of the dialect, by rising number."""
    return tuple(
        _message(cls) for number, cls in sorted(mavlink.mavlink_map.items()) if number >= 0
    )


def _message(cls: Any) -> MessageTable:
    types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    formats = [
        _format(types[name], length)
        for name, length in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True)
    ]
    sizes = [np.dtype(item).itemsize for item in formats]
    offsets = [PAYLOAD_OFFSET + sum(sizes[:index]) for index in range(len(sizes))]
    end = PAYLOAD_OFFSET + cls.unpacker.size
    dtype = np.dtype(
        {
            "names": [*HEADER_FIELDS, *cls.ordered_fieldnames],
            "formats": [*_HEADER_FORMATS, *formats],
            "offsets": [*_HEADER_OFFSETS, *offsets],
            "itemsize": -(-end // _ALIGNMENT) * _ALIGNMENT,
        }
    )
    return MessageTable(
        number=int(cls.id),
        name=str(cls.msgname),
        size=int(cls.unpacker.size),
        crc_extra=int(cls.crc_extra),
        dtype=dtype,
        units={"time_s": "s", **cls.fieldunits_by_name},
        enums=dict(cls.fieldenums_by_name),
        bitmasks=frozenset(
            name for name, display in cls.fielddisplays_by_name.items() if display == "bitmask"
        ),
    )


def _format(c_type: str, length: int) -> str | tuple[str, tuple[int]]:
    if c_type == "char":
        return f"S{max(length, 1)}"
    return (_FORMATS[c_type], (length,)) if length else _FORMATS[c_type]


@cache
def message_names() -> Mapping[str, MessageTable]:
    """The messages by their names."""
    return {message.name: message for message in messages()}


def message_indices(numbers: NDArray[np.uint32]) -> NDArray[np.int16]:
    """Return the places in `messages()` by message number; -1 where the dialect has none."""
    index = _index_by_number()
    return index[np.minimum(numbers, len(index) - 1)]


@cache
def _index_by_number() -> NDArray[np.int16]:
    table = messages()
    index = np.full(table[-1].number + 2, -1, dtype=np.int16)
    index[[message.number for message in table]] = np.arange(len(table))
    return index


@cache
def crc_extras() -> NDArray[np.uint8]:
    """The checksum's extra byte of each of `messages()`."""
    return np.array([message.crc_extra for message in messages()], dtype=np.uint8)


@cache
def enum_entries(enum: str) -> Mapping[int, str]:
    """Names of an enum's entries by value; the marker of the end, which is no value, is left out.

    Raises:
        KeyError: the dialect has no such enum.
    """
    return {
        int(value): str(entry.name)
        for value, entry in mavlink.enums[enum].items()
        if not entry.name.endswith("_ENUM_END")
    }
