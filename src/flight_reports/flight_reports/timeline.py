"""Values that hold from one time until the next value. Pure."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

Value = TypeVar("Value")


@dataclass(frozen=True)
class Timeline(Generic[Value]):
    """Values and the times (s) from which on they hold, in order."""

    times_s: tuple[float, ...] = ()
    values: tuple[Value, ...] = ()

    @classmethod
    def of(cls, pairs: Iterable[tuple[float, Value]]) -> Timeline[Value]:
        """Return the timeline of (time, value) pairs, which are in order."""
        listed = tuple(pairs)
        return cls(tuple(time_s for time_s, _ in listed), tuple(value for _, value in listed))

    def __len__(self) -> int:
        """How many values."""
        return len(self.values)

    def __iter__(self) -> Iterator[tuple[float, Value]]:
        """Yield (time, value)."""
        return zip(self.times_s, self.values, strict=True)

    def count(self, time_s: float) -> int:
        """Return how many values there are up to a time."""
        return bisect_right(self.times_s, time_s)

    def at(self, time_s: float) -> Value | None:
        """Return the value that holds at a time, or None before the first."""
        count = self.count(time_s)
        return self.values[count - 1] if count else None
