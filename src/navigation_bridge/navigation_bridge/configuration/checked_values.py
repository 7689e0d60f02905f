"""Kinds of values in parameters, files and messages, and records of them. No ROS.

A kind is declared once. From it come the check, the conversion, the sentence about a value that
cannot be used, and the JSON Schema.
"""

from __future__ import annotations

import reprlib
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import Generic, TypeAlias, TypeVar, overload

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
D = TypeVar("D")
H = TypeVar("H", bound=Hashable)
Schema: TypeAlias = dict[str, object]
_KEY = "member"
_LARGEST = sys.float_info.max
# A value from outside may be huge, or contain itself.
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxdict, _REPR.maxstring, _REPR.maxother = 2, 4, 4, 60, 60


class InvalidValueError(ValueError):
    """A value cannot be used; the text is a sentence that begins with where the value is."""

    def __init__(self, problem: str, where: str = "") -> None:
        """Describe it.

        Args:
            problem: what follows the value's name in the sentence.
            where: the value's name, as far as it is known.
        """
        super().__init__(f"{where.rstrip() or 'it'} {problem}")
        self.problem = problem
        self.where = where

    def inside(self, part: str) -> InvalidValueError:
        """Return the same about a value in a member, an item or a labelled object."""
        joint = "." if self.where and self.where[0] not in "[ " and part[-1] != " " else ""
        return InvalidValueError(self.problem, f"{part}{joint}{self.where}")


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return a question after the closest of the names that are known; empty without one."""
    import difflib  # noqa: PLC0415 - for this error alone

    near = difflib.get_close_matches(name, list(known), 1)
    return f"did you mean '{near[0]}'?" if near else ""


def shown(value: object) -> str:
    """Return a value as a sentence shows it."""
    try:
        return _REPR.repr(value)
    except ValueError:  # an integer with thousands of digits
        return "a number with too many digits"


@dataclass(frozen=True)
class Kind(Generic[T_co]):
    """A kind of values.

    Attributes:
        read: returns a value, checked and converted; raises InvalidValueError.
        schema: its JSON Schema.
    """

    read: Callable[[object], T_co]
    schema: Schema


def number(
    minimum: float = -_LARGEST, maximum: float = _LARGEST, *, exclusive: bool = False
) -> Kind[float]:
    """Return finite numbers; the limits are legal, but for an `exclusive` minimum."""
    limits = f"between {minimum:g} and {maximum:g}"
    if minimum == -_LARGEST:
        limits = "a finite number"
    elif exclusive:
        limits = f"greater than {minimum:g} and at most {maximum:g}"
    elif maximum == _LARGEST:
        limits = f"at least {minimum:g}"

    def read(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InvalidValueError(f"must be a number, not {shown(value)}.")
        # The comparisons exclude NaN. An integer may be too large for a float.
        if not minimum <= value <= maximum or (exclusive and value == minimum):
            raise InvalidValueError(f"is {shown(value)}; it must be {limits}.")
        return float(value)

    schema: Schema = {"type": "number"}
    if minimum != -_LARGEST:
        schema["exclusiveMinimum" if exclusive else "minimum"] = minimum
    if maximum != _LARGEST:
        schema["maximum"] = maximum
    return Kind(read, schema)


def whole(minimum: float = -_LARGEST, maximum: float = _LARGEST) -> Kind[int]:
    """Return whole numbers; the limits are legal."""
    any_number = number(minimum, maximum)

    def read(value: object) -> int:
        any_number.read(value)
        if not isinstance(value, int):
            raise InvalidValueError(f"must be a whole number, not {shown(value)}.")
        return value

    return Kind(read, {**any_number.schema, "type": "integer"})


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise InvalidValueError(f"must be true or false, not {shown(value)}.")
    return value


FLAG = Kind(_flag, {"type": "boolean"})


def text(longest: int | None = None) -> Kind[str]:
    """Return texts of at most `longest` characters."""

    def read(value: object) -> str:
        if not isinstance(value, str):
            raise InvalidValueError(f"must be text, not {shown(value)}.")
        if longest is not None and len(value) > longest:
            raise InvalidValueError(f"must be text of at most {longest} characters.")
        return value

    return Kind(read, {"type": "string", **({"maxLength": longest} if longest else {})})


TEXT = text()


def words(meanings: Mapping[H, T]) -> Kind[T]:
    """Return words or numbers, each with its meaning."""

    def read(value: object) -> T:
        # True is no 1, and a list is no key.
        for word, meaning in meanings.items():
            if value == word and type(value) is type(word):
                return meaning
        listed = ", ".join(map(str, meanings))
        raise InvalidValueError(f"is {shown(value)}; it must be one of {listed}.")

    schema: Schema = {"enum": list(meanings)}
    if all(isinstance(word, str) for word in meanings):
        schema = {"type": "string", **schema}
    return Kind(read, schema)


def either(*own: T) -> Kind[T]:
    """Return words that mean themselves."""
    return words(dict(zip(own, own, strict=True)))


def items(kind: Kind[T], fewest: int = 0, most: int | None = None) -> Kind[tuple[T, ...]]:
    """Return lists of values of one kind."""

    def read(value: object) -> tuple[T, ...]:
        if not isinstance(value, list):
            raise InvalidValueError(f"must be a list, not {shown(value)}.")
        if len(value) < fewest or (most is not None and len(value) > most):
            limits = f"at least {fewest}" if most is None else f"{fewest} to {most}"
            raise InvalidValueError(f"has {len(value)} items; it must have {limits}.")
        return tuple(_read_at(f"[{i}]", kind, item) for i, item in enumerate(value))

    schema: Schema = {"type": "array", "items": kind.schema}
    if fewest:
        schema["minItems"] = fewest
    if most is not None:
        schema["maxItems"] = most
    return Kind(read, schema)


def row(*kinds: Kind[T]) -> Kind[tuple[T, ...]]:
    """Return lists with a fixed number of values, each of a kind of its own."""
    count = len(kinds)

    def read(value: object) -> tuple[T, ...]:
        if not isinstance(value, list) or len(value) != count:
            raise InvalidValueError(f"must be a list of {count}, not {shown(value)}.")
        return tuple(_read_at(f"[{i}]", kinds[i], item) for i, item in enumerate(value))

    inner = {"prefixItems": [kind.schema for kind in kinds]}
    return Kind(read, {"type": "array", "minItems": count, "maxItems": count, **inner})


def pair(first: Kind[T], second: Kind[T]) -> Kind[tuple[T, T]]:
    """Return lists of two values, each of a kind of its own."""
    both = row(first, second)

    def read(value: object) -> tuple[T, T]:
        one, other = both.read(value)
        return one, other

    return Kind(read, both.schema)


def maybe(kind: Kind[T]) -> Kind[T | None]:
    """Return values of one kind, and null for an unknown one."""

    def read(value: object) -> T | None:
        return None if value is None else kind.read(value)

    return Kind(read, {"anyOf": [kind.schema, {"type": "null"}]})


def _object(value: object) -> dict[object, object]:
    if not isinstance(value, dict):
        raise InvalidValueError(f"must be an object, not {shown(value)}.")
    return value


OBJECT = Kind(_object, {"type": "object"})
"""Objects with members that somebody else checks"""


@dataclass(frozen=True)
class RecordMember(Generic[T_co]):
    """One member of a record.

    Attributes:
        kind: of its value.
        required: whether it must be given.
        name: its name in the record, if that is not the field's or the argument's.
        text: its meaning, for the schema.
        default: its default, for the schema.
    """

    kind: Kind[T_co]
    required: bool = False
    name: str = ""
    text: str = ""
    default: object = None

    @property
    def schema(self) -> Schema:
        """Its JSON Schema."""
        found = {"description": self.text} if self.text else {}
        default = {} if self.default in (None, "", ()) else {"default": self.default}
        return {**found, **self.kind.schema, **default}


@overload
def member(kind: Kind[T], name: str = ..., text: str = ...) -> T: ...


@overload
def member(
    kind: Kind[T], name: str = ..., text: str = ..., *, default: D, required: bool = ...
) -> T | D: ...


def member(
    kind: Kind[object],
    name: str = "",
    text: str = "",
    *,
    default: object = MISSING,
    required: bool = False,
) -> object:
    """Declare a member of a record at the field of a dataclass that it sets.

    Args:
        kind: of its value.
        name: its name in the record, if that is not the field's.
        text: its meaning.
        default: the field's default; without one, the member must be given.
        required: whether it must be given although the field has a default.
    """
    if default is MISSING:
        return field(metadata={_KEY: RecordMember(kind, True, name, text)})
    return field(
        default=default, metadata={_KEY: RecordMember(kind, required, name, text, default)}
    )


def record(
    make: Callable[..., T],
    checks: Mapping[str, Kind[object]] | None = None,
    fixed: Mapping[str, object] | None = None,
    *,
    is_open: bool = False,
    **members: RecordMember[object],
) -> Kind[T]:
    """Return objects with named members.

    Args:
        make: a dataclass whose fields are declared by `member`, or any callable.
        checks: members that must be given, and that `make` does not take.
        fixed: arguments of `make` that are given here, and not by members.
        is_open: whether other members are ignored, instead of rejected.
        members: by argument of `make`, those that are not declared at fields.
    """
    own = fields(make) if is_dataclass(make) else ()
    declared = {each.name: each.metadata[_KEY] for each in own if _KEY in each.metadata} | members
    found = {
        each.name or argument: (argument, each)
        for argument, each in declared.items()
        if argument not in (fixed or {})
    }
    found |= {
        name: ("", RecordMember(kind, required=True)) for name, kind in (checks or {}).items()
    }

    def read(given_object: object) -> T:
        value = _object(given_object)
        for name in value:
            if name not in found and not is_open:
                listed = f"known are {', '.join(found)}." if found else "no member is known."
                advice = suggestion(str(name)[:60], found) or listed
                key = shown(name)
                raise InvalidValueError(
                    f"is unknown; {advice}", key[1:-1] if key[1:-1] == name else key
                )
        given = dict(fixed or {})
        for name, (argument, each) in found.items():
            if name in value:
                checked = _read_at(name, each.kind, value[name])
                given |= {argument: checked} if argument else {}
            elif each.required:
                raise InvalidValueError("is missing.", name)
        return make(**given)

    schema: Schema = {"type": "object", **({} if is_open else {"additionalProperties": False})}
    if required := [name for name, (_, each) in found.items() if each.required]:
        schema["required"] = required
    return Kind(read, {**schema, "properties": {n: each.schema for n, (_, each) in found.items()}})


def one_of(tag: str, kinds: Mapping[str, Kind[T]], label: str | None = None) -> Kind[T]:
    """Return objects whose member `tag` decides their kind.

    Args:
        tag: name of the member, which is not a member of the records.
        kinds: records by the value of that member.
        label: name of a member that names the object in sentences, or that of its kind.
    """
    tags = either(*kinds)

    def read(given: object) -> T:
        value = _object(given)
        if tag not in value:
            raise InvalidValueError(f"is missing; give one of {', '.join(kinds)}.", tag)
        name = _read_at(tag, tags, value[tag])
        rest = {key: each for key, each in value.items() if key != tag}
        if label is None:
            return kinds[name].read(rest)
        said = value.get(label, name)
        return _read_at(f" ({said if isinstance(said, str) else name}): ", kinds[name], rest)

    return Kind(read, {"oneOf": [_tagged(kind.schema, tag, n) for n, kind in kinds.items()]})


def _tagged(schema: Schema, tag: str, value: str) -> Schema:
    """Return the schema of an object, or of one of several, with one more member."""
    kinds, required, members = map(schema.get, ("oneOf", "required", "properties"))
    if isinstance(kinds, list):
        return {"oneOf": [_tagged(each, tag, value) for each in kinds]}
    required = [tag, *(required if isinstance(required, list) else ())]
    members = {tag: {"const": value}, **(members if isinstance(members, dict) else {})}
    return {**schema, "required": required, "properties": members}


def _read_at(where: str, kind: Kind[T], value: object) -> T:
    try:
        return kind.read(value)
    except InvalidValueError as error:
        raise error.inside(where) from None
