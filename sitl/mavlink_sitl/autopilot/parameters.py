"""The parameters of a vehicle: name, value, type; the firmware's whole list.

Those that act here have their own place in each vehicle; all others are stored only, and their
defaults are shared by all vehicles of a personality.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum


class ParameterType(IntEnum):
    """The numbers are MAV_PARAM_TYPE's."""

    INT8 = 2
    INT16 = 4
    INT32 = 6
    REAL32 = 9


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter of a personality.

    Attributes:
        name: the firmware's.
        default: its value in a new vehicle.
        type: how it travels.
        listed: whether it is in the list. PX4 leaves out what none of its modules has looked at;
            asked for by name it is there all the same.
    """

    name: str
    default: float
    type: ParameterType = ParameterType.REAL32
    listed: bool = True


@dataclass(frozen=True)
class Renamed:
    """The name that a release has for a parameter of the recorded firmware.

    Attributes:
        name: it.
        factor: what makes the recorded value of its value.
        offset: what is added then.
    """

    name: str
    factor: float = 1.0
    offset: float = 0.0

    def of_recorded(self, spec: ParameterSpec) -> ParameterSpec:
        """The parameter under this name; in another unit it is a float."""
        kind = ParameterType.REAL32 if abs(self.factor) != 1.0 else spec.type
        default = (spec.default - self.offset) / self.factor
        return replace(spec, name=self.name, default=default, type=kind)


@dataclass(frozen=True)
class Changes:
    """The differences of a release's parameters from the recorded ones.

    Attributes:
        gone: names that it does not have.
        inert: what it has besides, or with another default or type; without an effect, unless the
            recorded one has an effect.
        acting: the same of those that have one.
        renamed: by their recorded names, by which the simulator asks for them.
    """

    gone: frozenset[str] = frozenset()
    inert: tuple[ParameterSpec, ...] = ()
    acting: tuple[ParameterSpec, ...] = ()
    renamed: Mapping[str, Renamed] = field(default_factory=dict)


NAMED_AT_MOST = 20
"""An unknown name is answered with all existing ones, where they are no more"""


class UnknownParameterError(KeyError):
    """No parameter has this name."""

    def __init__(self, name: str, known: list[str]) -> None:
        """Name the parameter and the existing ones."""
        self.name = name
        self.known = known
        super().__init__(name)

    def __str__(self) -> str:
        """One sentence, with the existing ones, or of many those with similar names."""
        if len(self.known) <= NAMED_AT_MOST:
            return f"no parameter {self.name!r}; there are: {', '.join(self.known)}"
        similar = difflib.get_close_matches(self.name, self.known)
        if not similar:
            return f"no parameter {self.name!r} among {len(self.known)}"
        return f"no parameter {self.name!r}; similar are: {', '.join(similar)}"


class ParameterTable:
    """The parameters of a personality; shared by its vehicles, and never changed.

    Args:
        acting: those that have an effect here.
        whole: the firmware's list; of those that act too, the specs in `acting` count.
        renamed: parameters that the simulator asks for by another name than the list's.

    Attributes:
        specs: by name, in the order of the names.
        acting: the defaults of those that act.
        listed: the names in the list, in the order of their indices. (The firmware's own order
            is that of its code; it was not recorded.)
        place: the index of each of these.
        renamed: by the recorded names.
    """

    def __init__(
        self,
        acting: Iterable[ParameterSpec],
        whole: Iterable[ParameterSpec] = (),
        renamed: Mapping[str, Renamed] | None = None,
    ) -> None:
        self.renamed = renamed or {}
        given = {spec.name: spec for spec in acting}
        self.acting = {name: given[name].default for name in sorted(given)}
        specs = {**{spec.name: spec for spec in whole}, **given}
        self.specs = {name: specs[name] for name in sorted(specs)}
        self.listed = tuple(name for name, spec in self.specs.items() if spec.listed)
        self.place = {name: place for place, name in enumerate(self.listed)}

    def changed(self, changes: Changes) -> ParameterTable:
        """The parameters of another release. What it changes of others than these is left out."""
        renamed = {old: new for old, new in changes.renamed.items() if old in self.specs}
        specs: dict[str, ParameterSpec] = {}
        acting = set()
        for name, spec in self.specs.items():
            if name not in changes.gone:
                other = renamed[name].of_recorded(spec) if name in renamed else spec
                specs[other.name] = other
                if name in self.acting:
                    acting.add(other.name)
        specs |= {spec.name: spec for spec in (*changes.inert, *changes.acting)}
        acting |= {spec.name for spec in changes.acting}
        return ParameterTable(
            [specs[name] for name in acting], specs.values(), {**self.renamed, **renamed}
        )


class _Values(dict[str, float]):
    """The values of one vehicle: of those that act, and of others that were changed."""

    def __init__(self, table: ParameterTable) -> None:
        super().__init__(table.acting)
        self._specs, self._renamed = table.specs, table.renamed

    def __missing__(self, name: str) -> float:
        other = self._renamed.get(name)
        if other is not None:
            return other.factor * self[other.name] + other.offset
        return self._specs[name].default


class Parameters:
    """The values, kept over a reboot as the firmware keeps them in storage.

    Args:
        table: the personality's parameters.
        values: values other than the defaults.

    Attributes:
        table: the personality's parameters.
        revision: grows with every change.

    Raises:
        UnknownParameterError: a value for a parameter that does not exist.
        ValueError: a value that is not finite.
    """

    def __init__(self, table: ParameterTable, values: Mapping[str, float] | None = None) -> None:
        self.table = table
        self._values = _Values(table)
        self._erased: dict[str, float] | None = None
        self.revision = 0
        for name, value in (values or {}).items():
            self.set(name, value)

    def __getitem__(self, name: str) -> float:
        """The value of a parameter; under a recorded name in the recorded unit."""
        return self._values[name]

    def values_of(self, names: Iterable[str]) -> list[float]:
        """The values of several parameters."""
        return [self[name] for name in names]

    def __contains__(self, name: str) -> bool:
        """Whether there is such a parameter."""
        return name in self.table.specs

    def __len__(self) -> int:
        """How many are listed."""
        return len(self.table.listed)

    @property
    def specs(self) -> Mapping[str, ParameterSpec]:
        """All parameters by name."""
        return self.table.specs

    def acts(self, name: str) -> bool:
        """Whether there is such a parameter, also by its recorded name, and it has an effect."""
        other = self.table.renamed.get(name)
        return (name if other is None else other.name) in self.table.acting

    def of_interest(self) -> list[str]:
        """The names of those that act, and of all others that were changed."""
        return sorted(self._values)

    def names(self) -> tuple[str, ...]:
        """All that are listed, in the order of their indices."""
        return self.table.listed

    def index(self, name: str) -> int | None:
        """The place of a parameter in the list, or None for one that is not in it."""
        return self.table.place.get(name)

    def set(self, name: str, value: float) -> None:
        """Change a value; integers are rounded.

        Raises:
            UnknownParameterError: there is no such parameter.
            ValueError: the value is not finite.
        """
        spec = self.table.specs.get(name)
        if spec is None:
            raise UnknownParameterError(name, list(self.table.specs))
        if not math.isfinite(value):
            raise ValueError(f"parameter {name} must be a finite number, not {value}")
        self.revision += 1
        stored = value if spec.type is ParameterType.REAL32 else float(round(value))
        self._values[name] = stored
        if self._erased is not None:
            self._erased[name] = stored

    def reset(self) -> None:
        """All have their defaults again."""
        self.revision += 1
        self._erased = None
        self._values = _Values(self.table)

    def erase(self) -> None:
        """Empty the storage: at the next start all have their defaults, but for later changes."""
        self._erased = {}

    def power_up(self) -> None:
        """Start with the values in the storage."""
        stored = self._erased
        if stored is not None:
            self.reset()
            self._values.update(stored)
