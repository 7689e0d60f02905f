"""Turns records into Arrow columns, with unit and enum of each field."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from flight_logs.dialect import HEADER_FIELDS, MessageTable, enum_entries, message_names
from flight_logs.frames.records import Records


def to_table(records: Records, message: MessageTable, enum_names: bool = False) -> pa.Table:
    """Return the records as a table, in the order of their fields.

    Text ends at its first zero byte. Arrays are lists of fixed length. A field's metadata
    hold, where the dialect has them, `unit`, `enum`, `bitmask` ("true") and `entries`, which
    is JSON from value to name; the schema's hold `message` and `message_id`.

    Args:
        records: of one message.
        message: which.
        enum_names: write names of enum entries in place of numbers; bits joined by "|".
    """
    columns, fields = [], []
    for name in records.dtype.names or ():
        column = _column(records[name], message, name, enum_names)
        columns.append(column)
        fields.append(pa.field(name, column.type, metadata=_metadata(message, name)))
    about = {"message": message.name, "message_id": str(message.number)}
    return pa.Table.from_arrays(columns, schema=pa.schema(fields, metadata=about))


def flattened(table: pa.Table) -> pa.Table:
    """Return the table with a column for each element of a list, `name_0` and so on."""
    columns: dict[str, pa.Array] = {}
    for field in table.schema:
        column = table.column(field.name)
        if not pa.types.is_fixed_size_list(field.type):
            columns[field.name] = column
            continue
        values = column.combine_chunks().flatten()
        length = field.type.list_size
        for index in range(length):
            columns[f"{field.name}_{index}"] = values[index::length]
    return pa.table(columns)


def fields_table(names: Iterable[str]) -> pa.Table:
    """Return what the dialect says of the messages' fields: message, field, unit, enum."""
    rows = [
        {
            "message": name,
            "field": field,
            "unit": message_names()[name].units.get(field, ""),
            "enum": message_names()[name].enums.get(field, ""),
        }
        for name in names
        for field in message_names()[name].dtype.names or ()
    ]
    return pa.Table.from_pylist(rows)


def _column(
    values: NDArray[np.generic], message: MessageTable, name: str, enum_names: bool
) -> pa.Array:
    if values.dtype.kind == "S":
        return pa.array([_text(value) for value in values.tolist()], type=pa.string())
    if values.ndim > 1:
        flat = pa.array(np.ascontiguousarray(values).ravel())
        return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
    if enum_names and name in message.enums and name not in HEADER_FIELDS:
        return _names(values, message.enums[name], name in message.bitmasks)
    return pa.array(np.ascontiguousarray(values))


def _text(value: bytes) -> str:
    return value.split(b"\x00", 1)[0].decode("utf-8", "replace")


def _names(values: NDArray[np.generic], enum: str, bitmask: bool) -> pa.Array:
    entries = enum_entries(enum)
    different, places = np.unique(values, return_inverse=True)
    # A NaN or a fraction, in a field of another kind than integer, stays what it is.
    whole = (1 << 8 * values.dtype.itemsize) - 1
    names = [
        _bits(int(value) & whole, entries) if bitmask else entries.get(value, f"{value:g}")
        for value in different.tolist()
    ]
    return pa.array(names, type=pa.string()).take(pa.array(places))


def _bits(value: int, entries: Mapping[int, str]) -> str:
    bits = [1 << place for place in range(value.bit_length()) if value >> place & 1]
    return "|".join(entries.get(bit, hex(bit)) for bit in bits)


def _metadata(message: MessageTable, name: str) -> dict[str, str] | None:
    about = {}
    if name in message.units:
        about["unit"] = message.units[name]
    if name in message.enums:
        about["enum"] = message.enums[name]
        about["entries"] = json.dumps(enum_entries(message.enums[name]))
    if name in message.bitmasks:
        about["bitmask"] = "true"
    return about or None
