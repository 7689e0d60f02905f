"""Declarations of parameters: each stands once, at the field of the settings that it sets. No ROS.

ROS descriptors, checks, ``--help``, the JSON Schema and ``docs/parameters.md`` are made from them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Generic, Protocol, TypeAlias, TypedDict, TypeVar, overload

from navigation_bridge.configuration.checked_values import (
    FLAG,
    TEXT,
    InvalidValueError,
    Kind,
    either,
    items,
    number,
    whole,
)
from navigation_bridge.configuration.parameter_values import ConfigurationError, ParameterValue

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from typing_extensions import Unpack

T = TypeVar("T")
D = TypeVar("D", bound="DataclassInstance")
E = TypeVar("E", bound=Enum)
V = TypeVar("V", bound=ParameterValue)
Values = Mapping[str, ParameterValue]
Limits: TypeAlias = tuple[float, float]
_KEY = "parameter"
_LINK = re.compile(r"\[([^]]+)\]\([^)]+\)")


class _Marks(TypedDict, total=False):
    """Further attributes of a :class:`ParameterSpec`."""

    fixed: bool
    server_wide: bool
    rehearsed: bool
    schema: Mapping[str, object]


class _Source(Protocol):
    """Makes the value of one field of the settings from parameters."""

    def specs(self) -> Iterator[ParameterSpec]:
        """Yield the parameters that are declared at the field."""

    def made(self, values: Values) -> object:
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
        limits: smallest and largest legal number, or None.
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
    limits: Limits | None
    choices: tuple[str, ...] | None
    read: Callable[[ParameterValue], object]
    fixed: bool = False
    server_wide: bool = False
    rehearsed: bool = False
    schema: Mapping[str, object] = field(default_factory=dict)

    @property
    def description(self) -> str:
        """The meaning without marks of Markdown."""
        return _LINK.sub(r"\1", self.text).replace("`", "")

    def specs(self) -> Iterator[ParameterSpec]:
        """Yield itself."""
        yield self

    def made(self, values: Values) -> object:
        """Return the field's value."""
        return self.read(values[self.name])

    @property
    def kind(self) -> Kind[object]:
        """The kind of its values: the type of its default, with its range or its choices."""
        if isinstance(self.default, bool):
            return FLAG
        if isinstance(self.default, list):
            return items(TEXT)
        if isinstance(self.default, str):
            return TEXT if self.choices is None else either(*self.choices)
        return (whole if isinstance(self.default, int) else number)(*self.limits or ())

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
    """One more field that follows from a parameter with words, which is declared at another."""

    name: str
    read: Callable[[str], object]

    def specs(self) -> Iterator[ParameterSpec]:
        yield from ()

    def made(self, values: Values) -> object:
        return self.read(str(values[self.name]))


@dataclass(frozen=True)
class _Group(Generic[T]):
    """Fields of one dataclass that parameters set; its other fields keep their defaults."""

    kind: Callable[..., T]
    sources: Mapping[str, _Source]

    def specs(self) -> Iterator[ParameterSpec]:
        for source in self.sources.values():
            yield from source.specs()

    def made(self, values: Values) -> T:
        return self.kind(**{name: source.made(values) for name, source in self.sources.items()})


@overload
def parameter(
    name: str,
    default: V,
    text: str,
    limits: Limits | None = ...,
    *,
    read: Callable[[V], T],
    **marks: Unpack[_Marks],
) -> T: ...


@overload
def parameter(
    name: str, default: str, text: str, *, words: Mapping[str, T], **marks: Unpack[_Marks]
) -> T: ...


@overload
def parameter(
    name: str,
    default: V,
    text: str,
    limits: Limits | None = ...,
    **marks: Unpack[_Marks],
) -> V: ...


def parameter(
    name: str,
    default: V,
    text: str,
    limits: Limits | None = None,
    *,
    words: Mapping[str, object] | None = None,
    read: Callable[[V], object] | None = None,
    **marks: Unpack[_Marks],
) -> object:
    """Declare a parameter at the field of a dataclass that it sets.

    Args:
        name: ROS parameter name, with its unit.
        default: the parameter's default, and thereby the field's; its type is the parameter's.
        text: its meaning, in sentences of Markdown.
        limits: smallest and largest legal number.
        words: the legal strings, each with the field's value.
        read: makes the field's value from the parameter's; raises ConfigurationError.
        marks: ``fixed``, ``server_wide``, ``rehearsed`` and ``schema`` of :class:`ParameterSpec`.
    """
    spec = _spec(name, default, text, limits, words, read, **marks)
    return field(default=spec.read(default), metadata={_KEY: spec})


def of_core(
    name: str,
    text: str,
    limits: Limits | None = None,
    *,
    default: V | None = None,
    words: Mapping[str, object] | None = None,
    read: Callable[[V], object] | None = None,
    **marks: Unpack[_Marks],
) -> Callable[[object], ParameterSpec]:
    """Declare a parameter for a field of a dataclass that does not know parameters.

    The field's default is the parameter's.

    Args:
        name: ROS parameter name, with its unit.
        text: its meaning, in sentences of Markdown.
        limits: smallest and largest legal number.
        default: the parameter's default where it is not the field's; always with ``read``.
        words: the legal strings, each with the field's value.
        read: makes the field's value from the parameter's; raises ConfigurationError.
        marks: ``fixed``, ``server_wide``, ``rehearsed`` and ``schema`` of :class:`ParameterSpec`.
    """

    def declared(of_field: object) -> ParameterSpec:
        if default is not None:
            return _spec(name, default, text, limits, words, read, **marks)
        own = of_field
        if words is not None:
            own = next(word for word, value in words.items() if value == of_field)
        if not isinstance(own, (int, float, str)):
            raise TypeError(f"The field of parameter {name} has no default for it: {own!r}.")
        return _spec(name, own, text, limits, words, None, **marks)

    return declared


def also(name: str, read: Callable[[str], object]) -> Callable[[object], _Source]:
    """Return what sets one more field from a parameter, which is declared at another one."""
    return lambda _: _Also(name, read)


def inside(
    kind: type[D], **of_fields: Callable[[object], _Source]
) -> Callable[[object], _Group[D]]:
    """Declare the parameters of a dataclass inside another one that declares none."""
    return lambda _: _group(kind, of_fields)


def group(kind: type[D], **of_fields: Callable[[object], _Source]) -> D:
    """Declare a field that is itself a dataclass of parameters.

    Args:
        kind: the dataclass.
        of_fields: the parameters of a dataclass that declares none, by its fields.
    """
    # It may need parameters that are declared elsewhere, so it has no default.
    result: D = field(kw_only=True, metadata={_KEY: _group(kind, of_fields)})
    return result


def specs_of(kind: type[DataclassInstance]) -> tuple[ParameterSpec, ...]:
    """Return all parameters that are declared in a dataclass and those inside it."""
    return tuple(_group(kind, {}).specs())


def make(kind: type[D], values: Values) -> D:
    """Return a dataclass of settings made from the values of all its parameters.

    Raises:
        ConfigurationError: a value cannot be used.
    """
    return _group(kind, {}).made(values)


def words_of(kind: type[E]) -> dict[str, E]:
    """Return the members of an enum by their values."""
    return {str(member.value): member for member in kind}


def _group(kind: type[D], of_fields: Mapping[str, Callable[[object], _Source]]) -> _Group[D]:
    found = {each.name: each for each in fields(kind)}
    sources: dict[str, _Source] = {
        name: each.metadata[_KEY] for name, each in found.items() if _KEY in each.metadata
    }
    for name, declared in of_fields.items():
        factory = found[name].default_factory
        sources[name] = declared(found[name].default if factory is MISSING else factory())
    return _Group(kind, sources)


def _spec(
    name: str,
    default: V,
    text: str,
    limits: Limits | None,
    words: Mapping[str, object] | None,
    read: Callable[[V], object] | None,
    **marks: Unpack[_Marks],
) -> ParameterSpec:
    kind, choices = type(default), None if words is None else tuple(words)

    def read_value(value: ParameterValue) -> object:
        if isinstance(value, int) and kind is float:
            value = float(value)
        if not isinstance(value, kind):
            raise ConfigurationError(f"Parameter {name} is {value!r}, no {kind.__name__}.")
        if words is not None:
            return words[str(value)]
        return value if read is None else read(value)

    return ParameterSpec(name, default, text, limits, choices, read_value, **marks)
