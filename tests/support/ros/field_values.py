"""Messages in which one field has a value at its limits or beyond, made from their definitions."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from rosidl_parser.definition import (
    AbstractSequence,
    AbstractString,
    Array,
    BasicType,
    NamespacedType,
)

__all__ = ["MANY", "message_type", "variations"]

MANY = 10_000
"""Length of long texts and sequences"""

_FLOATS = (math.nan, math.inf, -math.inf, 1e-310, -1e30, 1e30, -1.0)
_REAL = ("float", "double")
_TEXTS = ("", "x" * MANY, "\n\t\u00e4\U0001f681", "../../etc/passwd")


def variations(message: Any) -> Iterator[tuple[str, Any, Any]]:
    """Return the path of each field with each of its values, and a copy that has it.

    Args:
        message: of any interface; the copies are as it is but for one field.
    """
    for path, value in (*_values(message), *_lengths(message)):
        changed = copy.deepcopy(message)
        target = changed
        *outer, last = path
        for name in outer:
            target = getattr(target, name) if isinstance(name, str) else target[name]
        if isinstance(last, str):
            setattr(target, last, value)
        else:
            target[last] = value
        yield ".".join(map(str, path)), value, changed


def message_type(name: str) -> Any:
    """Return the class of an interface: `std_msgs/msg/String`."""
    package, kind, own = name.split("/")
    return getattr(import_module(f"{package}.{kind}"), own)


def _values(message: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    names = message.get_fields_and_field_types()
    for name, kind in zip(names, message.SLOT_TYPES, strict=True):
        value = getattr(message, name)
        if isinstance(kind, NamespacedType):
            yield from (((name, *path), one) for path, one in _values(value))
        elif isinstance(kind, Array | AbstractSequence):
            yield from (((name, *path), one) for path, one in _of_many(kind, value))
        else:
            yield from (((name,), one) for one in _of_one(kind))


def _lengths(message: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Return the sequences of a message, empty and long."""
    names = message.get_fields_and_field_types()
    for name, kind in zip(names, message.SLOT_TYPES, strict=True):
        value = getattr(message, name)
        if isinstance(kind, NamespacedType):
            yield from (((name, *path), one) for path, one in _lengths(value))
        elif isinstance(kind, AbstractSequence):
            yield (name,), []
            longest = getattr(kind, "maximum_size", MANY)
            yield (name,), [_element(kind.value_type, value) for _ in range(min(MANY, longest))]


def _element(kind: Any, value: Any) -> Any:
    """Return an element of a sequence: its first, or a new one."""
    if len(value):
        return value[0]
    if isinstance(kind, NamespacedType):
        return message_type("/".join([*kind.namespaces, kind.name]))()
    if isinstance(kind, AbstractString):
        return "x"
    return b"\x01" if kind.typename == "octet" else 1.0 if kind.typename in _REAL else 1


def _of_many(kind: Any, value: Any) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Return the values of the first element."""
    inner = kind.value_type
    if len(value) and isinstance(inner, NamespacedType):
        yield from (((0, *path), one) for path, one in _values(value[0]))
    elif len(value):
        yield from (((0,), one) for one in _of_one(inner))


def _of_one(kind: Any) -> tuple[Any, ...]:
    if isinstance(kind, AbstractString):
        return _TEXTS
    assert isinstance(kind, BasicType)
    name = kind.typename
    if name == "boolean":
        return (False, True)
    if name == "float":
        return (*(v for v in _FLOATS if v != 1e-310), 1e-40)
    if name == "double":
        return (*_FLOATS, -1e300, 1e300)
    if name == "octet":
        return (b"\x00", b"\xff")
    bits, signed = int("".join(filter(str.isdigit, name))), not name.startswith("u")
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    return (low, low + 1, 1, high - 1, high)
