"""The parameters of a vehicle: name, value, type. Each of them has an effect."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
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


class UnknownParameterError(KeyError):
    """No parameter has this name."""

    def __init__(self, name: str, known: list[str]) -> None:
        """Name the parameter and the existing ones."""
        self.name = name
        self.known = known
        super().__init__(name)

    def __str__(self) -> str:
        """One sentence."""
        return f"no parameter {self.name!r}; there are: {', '.join(self.known)}"


class Parameters:
    """The values, kept over a reboot as the firmware keeps them in storage.

    Args:
        specs: the personality's parameters.
        values: values other than the defaults.

    Raises:
        UnknownParameterError: a value for a parameter that does not exist.
        ValueError: a value that is not finite.
    """

    def __init__(
        self, specs: tuple[ParameterSpec, ...], values: Mapping[str, float] | None = None
    ) -> None:
        self.specs = {spec.name: spec for spec in sorted(specs, key=lambda spec: spec.name)}
        listed = [name for name, spec in self.specs.items() if spec.listed]
        self._listed = {name: place for place, name in enumerate(listed)}
        self._values = {name: spec.default for name, spec in self.specs.items()}
        self.revision = 0
        """Grows with every change"""
        for name, value in (values or {}).items():
            self.set(name, value)

    def __getitem__(self, name: str) -> float:
        """The value of a parameter."""
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        """Whether there is such a parameter."""
        return name in self._values

    def __len__(self) -> int:
        """How many are listed."""
        return len(self._listed)

    def names(self) -> list[str]:
        """All that are listed, in the order of their indices."""
        return list(self._listed)

    def index(self, name: str) -> int | None:
        """The place of a parameter in the list, or None for one that is not in it."""
        return self._listed.get(name)

    def set(self, name: str, value: float) -> None:
        """Change a value; integers are rounded.

        Raises:
            UnknownParameterError: there is no such parameter.
            ValueError: the value is not finite.
        """
        spec = self.specs.get(name)
        if spec is None:
            raise UnknownParameterError(name, list(self.specs))
        if not math.isfinite(value):
            raise ValueError(f"parameter {name} must be a finite number, not {value}")
        self.revision += 1
        self._values[name] = value if spec.type is ParameterType.REAL32 else float(round(value))
