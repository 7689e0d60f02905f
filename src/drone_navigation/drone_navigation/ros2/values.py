"""Messages from YAML and as YAML."""

from __future__ import annotations

import array
import importlib

import numpy as np
import yaml
from builtin_interfaces.msg import Time
from rosidl_parser.definition import AbstractNestedType, NamespacedType
from std_msgs.msg import Header

from drone_navigation.ros2.session import CommandError, Message, MessageClass

__all__ = ["as_yaml", "filled", "read_yaml"]

_WIDTH = 10**9
SHOWN_MAX = 128
"""Elements of an array and characters of a string that ``topic echo`` shows."""


def read_yaml(text: str) -> dict[str, object]:
    """Return the values of a message.

    Raises:
        CommandError: they are not a map.
    """
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise CommandError(f"The passed value is not valid YAML: {error}") from error
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise CommandError(
            "The passed value needs to be a dictionary in YAML format, such as '{data: 1}', "
            f"and not {text!r}"
        )
    return values


def filled(kind: MessageClass, values: object, now: Time | None = None, path: str = "") -> Message:
    """Return a message of a class with values; the other fields keep their defaults.

    Args:
        kind: the class.
        values: a map by field, messages as maps.
        now: what stands for a header ``auto`` and a time ``now``; None allows neither.
        path: the field in which the message stands, for errors.

    Raises:
        CommandError: a value does not fit its field.
    """
    # Without this argument a message takes anything, and the process is aborted when it is sent.
    message = kind(check_fields=True)
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    if not isinstance(values, dict):
        raise _unfit(path, f"it needs fields such as {{{', '.join(types)}}}")
    for name, value in values.items():
        where = f"{path}.{name}" if path else str(name)
        if name not in types:
            raise _unfit(where, f"there is no such field, but {', '.join(types) or 'none at all'}")
        try:
            setattr(message, name, _value(getattr(message, name), types[name], value, now, where))
        except (AssertionError, OverflowError, TypeError, ValueError) as error:
            raise _unfit(where, " ".join(str(error).split())) from error
    return message


def _value(before: object, of: object, value: object, now: Time | None, where: str) -> object:
    """Return a value as its field takes it; the field checks it."""
    if isinstance(of, NamespacedType):
        if now is not None and value == "now" and isinstance(before, Time):
            return now
        if now is not None and value == "auto" and isinstance(before, Header):
            return Header(stamp=now)
        return filled(_class_of(of), value, now, where)
    if isinstance(of, AbstractNestedType):
        return _elements(before, of.value_type, value, now, where)
    if isinstance(before, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(before, str) and isinstance(value, (int, float)):
        return str(value)
    return value


def _elements(before: object, of: object, values: object, now: Time | None, where: str) -> object:
    """Return an array in the form in which its field has it."""
    if not isinstance(values, list):
        raise _unfit(where, f"it needs a list, and not {values!r}")
    if isinstance(of, NamespacedType):
        kind = _class_of(of)
        return [filled(kind, each, now, f"{where}[{i}]") for i, each in enumerate(values)]
    if isinstance(before, np.ndarray):
        return np.array(values, dtype=before.dtype)
    if isinstance(before, array.array):
        return array.array(before.typecode, values)
    return values


def _class_of(of: NamespacedType) -> MessageClass:
    found: MessageClass = getattr(importlib.import_module(".".join(of.namespaces)), of.name)
    return found


def _unfit(where: str, why: str) -> CommandError:
    return CommandError(f"Failed to populate message fields: {where or 'the message'}: {why}")


def as_yaml(value: object, shown_max: int | None = None) -> str:
    """Return a message as YAML, its arrays and strings cut after a number of elements."""
    text: str = yaml.dump(
        _plain(value, shown_max), allow_unicode=True, width=_WIDTH, sort_keys=False,
        default_flow_style=False,
    )  # fmt: skip
    # PyYAML ends a document of a single scalar with this mark.
    return text.removesuffix("...\n")


def _plain(value: object, shown_max: int | None) -> object:
    fields = getattr(value, "get_fields_and_field_types", None)
    if fields is not None:
        return {name: _plain(getattr(value, name), shown_max) for name in fields()}
    if isinstance(value, str):
        is_long = shown_max is not None and len(value) > shown_max
        return f"{value[:shown_max]}..." if is_long else value
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, (np.ndarray, array.array)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        cut = ["..."] if shown_max is not None and len(value) > shown_max else []
        return [_plain(each, shown_max) for each in value[:shown_max]] + cut
    return value
