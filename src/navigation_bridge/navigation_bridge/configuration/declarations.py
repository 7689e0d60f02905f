"""Declarations of parameters: each stands once, at the field of the settings that it sets. No ROS.

ROS descriptors, checks, ``--help``, the JSON Schema and ``docs/parameters.md`` are made from them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from enum import Enum
from typing import Any, Protocol, TypeVar, overload

from navigation_bridge.configuration.checked_values import (
    TEXT,
    InvalidValueError,
    Kind,
    either,
    items,
    number,
    whole,
)
from navigation_bridge.configuration.parameter_values import ConfigurationError, ParameterValue

__all__ = [
    "ParameterSpec",
    "also",
    "group",
    "inside",
    "make",
    "of_core",
    "parameter",
    "specs_of",
    "words_of",
]

T = TypeVar("T")
E = TypeVar("E", bound=Enum)
Values = Mapping[str, ParameterValue]
_KEY = "parameter"
_LINK = re.compile(r"\[([^]]+)\]\([^)]+\)")


def _same(value: T) -> T:
    return value


class _Source(Protocol):
    """Makes the value of one field of the settings from parameters."""

    def specs(self) -> Iterator[ParameterSpec]:
        """Yield the parameters that are declared at the field."""

    def made(self, values: Values) -> Any:
        """Return the field's value.

        Raises:
            ConfigurationError: a parameter's value cannot be used.
        """


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter.

    Attributes:
        name: ROS parameter name, with its unit.
        default: value used when nothing is configured; its type is the parameter's type.
        text: its meaning, in sentences of Markdown.
        minimum: smallest legal number, or None.
        maximum: largest legal number, or None.
        choices: legal strings, or None for any.
        read: makes the field's value from the parameter's.
        fixed: read once, at the start. All others may change at run time; an active goal keeps its
            values.
        server_wide: of the server as a whole; all others belong to each vehicle.
        rehearsed: it decides a flight, so a rehearsal takes the server's value.
        schema: further keys of its JSON Schema.
    """

    name: str
    default: ParameterValue
    text: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] | None = None
    read: Callable[[Any], Any] = _same
    fixed: bool = False
    server_wide: bool = False
    rehearsed: bool = False
    schema: Mapping[str, Any] = field(default_factory=dict)

    @property
    def description(self) -> str:
        """The meaning without marks of Markdown."""
        return _LINK.sub(r"\1", self.text).replace("`", "")

    def specs(self) -> Iterator[ParameterSpec]:
        """Yield itself."""
        yield self

    def made(self, values: Values) -> Any:
        """Return the field's value."""
        value = values[self.name]
        if isinstance(value, int) and isinstance(self.default, float):
            value = float(value)
        return self.read(value)

    @property
    def kind(self) -> Kind[Any]:
        """The kind of its values: the type of its default, with its range or its choices."""
        if isinstance(self.default, list):
            return items(TEXT)
        if isinstance(self.default, str):
            return TEXT if self.choices is None else either(*self.choices)
        limits = () if self.minimum is None else (self.minimum, self.maximum)
        return (whole if isinstance(self.default, int) else number)(*limits)

    def check(self, value: ParameterValue) -> None:
        """Check a value's type, range and choice, and each text of a list.

        Raises:
            ConfigurationError: it cannot be used.
        """
        try:
            checked = self.kind.read(value)
        except InvalidValueError as error:
            raise ConfigurationError(f"Parameter {error.inside(self.name)}") from None
        if isinstance(checked, tuple):
            self.read(value)


@dataclass(frozen=True)
class _Also:
    """One more field that follows from a parameter, which is declared at another."""

    name: str
    read: Callable[[Any], Any]

    def specs(self) -> Iterator[ParameterSpec]:
        yield from ()

    def made(self, values: Values) -> Any:
        return self.read(values[self.name])


@dataclass(frozen=True)
class _Group:
    """Fields of one dataclass that parameters set; its other fields keep their defaults."""

    kind: type
    sources: Mapping[str, _Source]

    def specs(self) -> Iterator[ParameterSpec]:
        for source in self.sources.values():
            yield from source.specs()

    def made(self, values: Values) -> Any:
        return self.kind(**{name: source.made(values) for name, source in self.sources.items()})


@overload
def parameter(
    name: str,
    default: ParameterValue,
    text: str,
    minimum: float | None = ...,
    maximum: float | None = ...,
    *,
    read: Callable[[Any], T],
    **more: Any,
) -> T: ...


@overload
def parameter(name: str, default: str, text: str, *, words: Mapping[str, T], **more: Any) -> T: ...


@overload
def parameter(
    name: str,
    default: T,
    text: str,
    minimum: float | None = ...,
    maximum: float | None = ...,
    **more: Any,
) -> T: ...


def parameter(
    name: str,
    default: Any,
    text: str,
    minimum: float | None = None,
    maximum: float | None = None,
    *,
    words: Mapping[str, Any] | None = None,
    read: Callable[[Any], Any] | None = None,
    **more: Any,
) -> Any:
    """Declare a parameter at the field of a dataclass that it sets.

    Args:
        name: ROS parameter name, with its unit.
        default: the parameter's default, and thereby the field's; its type is the parameter's.
        text: its meaning, in sentences of Markdown.
        minimum: smallest legal number.
        maximum: largest legal number.
        words: the legal strings, each with the field's value.
        read: makes the field's value from the parameter's; raises ConfigurationError.
        more: ``fixed``, ``server_wide``, ``rehearsed`` and ``schema`` of :class:`ParameterSpec`.
    """
    spec = _spec(name, default, text, minimum, maximum, words, read, **more)
    return field(default=spec.read(default), metadata={_KEY: spec})


def of_core(
    name: str,
    text: str,
    minimum: float | None = None,
    maximum: float | None = None,
    *,
    words: Mapping[str, Any] | None = None,
    read: Callable[[Any], Any] | None = None,
    write: Callable[[Any], ParameterValue] = lambda value: value,
    default: ParameterValue | None = None,
    **more: Any,
) -> Callable[[Any], ParameterSpec]:
    """Declare a parameter for a field of a dataclass that does not know parameters.

    The field's default is the parameter's.

    Args:
        name: ROS parameter name, with its unit.
        text: its meaning, in sentences of Markdown.
        minimum: smallest legal number.
        maximum: largest legal number.
        words: the legal strings, each with the field's value.
        read: makes the field's value from the parameter's; raises ConfigurationError.
        write: makes the parameter's default from the field's, the inverse of ``read``.
        default: the parameter's default where the field has none.
        more: ``fixed``, ``server_wide``, ``rehearsed`` and ``schema`` of :class:`ParameterSpec`.
    """

    def declared(of_field: Any) -> ParameterSpec:
        own = default
        if own is None and words is not None:
            own = next(word for word, value in words.items() if value == of_field)
        elif own is None:
            own = write(of_field)
        return _spec(name, own, text, minimum, maximum, words, read, **more)

    return declared


def also(name: str, read: Callable[[Any], Any]) -> Callable[[Any], _Source]:
    """Return what sets one more field from a parameter, which is declared at another one."""
    return lambda _: _Also(name, read)


def inside(kind: type, **of_fields: Callable[[Any], _Source]) -> Callable[[Any], _Source]:
    """Declare the parameters of a dataclass inside another one that declares none."""
    return lambda _: _group(kind, of_fields)


def group(kind: type[T], **of_fields: Callable[[Any], _Source]) -> T:
    """Declare a field that is itself a dataclass of parameters.

    Args:
        kind: the dataclass.
        of_fields: the parameters of a dataclass that declares none, by its fields.
    """
    # It may need parameters that are declared elsewhere, so it has no default.
    result: T = field(kw_only=True, metadata={_KEY: _group(kind, of_fields)})
    return result


def specs_of(kind: type) -> tuple[ParameterSpec, ...]:
    """Return all parameters that are declared in a dataclass and those inside it."""
    return tuple(_group(kind, {}).specs())


def make(kind: type[T], values: Values) -> T:
    """Return a dataclass of settings made from the values of all its parameters.

    Raises:
        ConfigurationError: a value cannot be used.
    """
    made: T = _group(kind, {}).made(values)
    return made


def words_of(kind: type[E]) -> dict[str, E]:
    """Return the members of an enum by their values."""
    return {str(member.value): member for member in kind}


def _group(kind: type, of_fields: Mapping[str, Callable[[Any], _Source]]) -> _Group:
    found: dict[str, Field[Any]] = {each.name: each for each in fields(kind)}
    sources = {name: each.metadata[_KEY] for name, each in found.items() if _KEY in each.metadata}
    for name, declared in of_fields.items():
        factory = found[name].default_factory
        sources[name] = declared(found[name].default if factory is MISSING else factory())
    return _Group(kind, sources)


def _spec(
    name: str,
    default: Any,
    text: str,
    minimum: float | None,
    maximum: float | None,
    words: Mapping[str, Any] | None,
    read: Callable[[Any], Any] | None,
    **more: Any,
) -> ParameterSpec:
    choices = None if words is None else tuple(words)
    read = read if words is None else words.__getitem__
    return ParameterSpec(name, default, text, minimum, maximum, choices, read or _same, **more)
