"""Runs searches that take longer than a setpoint period beside the flight.

A task hands over a piece of work that depends on nothing but its arguments, and asks for its
result at every step. The owner decides how and where the work is done: a live server has a
thread for it, a simulation does it at once. So a flight is the same code in both.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias, TypeVar

__all__ = ["AT_ONCE", "AtOnce", "IsWanted", "Search", "Searcher"]

ResultT = TypeVar("ResultT")
ResultT_co = TypeVar("ResultT_co", covariant=True)

IsWanted: TypeAlias = Callable[[], bool]
"""Returns whether anybody still waits for a search; the search asks now and then."""


class Search(Protocol[ResultT_co]):
    """A search that was begun."""

    def result(self) -> ResultT_co | None:
        """Return the result, None while the search runs; raises what the search raised."""

    def abandon(self) -> None:
        """Discard the result when it comes."""


class Searcher(Protocol):
    """Takes searches on."""

    @property
    def lead_s(self) -> float:
        """The expected duration of a search, which is how far ahead its result must begin."""

    def begin(self, work: Callable[[IsWanted], ResultT]) -> Search[ResultT]:
        """Begin a search. The work may not change anything that others use."""


class _Done:
    def __init__(self, value: Any) -> None:
        self._value = value

    def result(self) -> Any:
        return self._value

    def abandon(self) -> None:
        """Nothing is left to be done."""


class AtOnce:
    """Does the work when it is asked for: for simulated time, which stands still meanwhile."""

    lead_s = 0.0

    def begin(self, work: Callable[[IsWanted], ResultT]) -> Search[ResultT]:
        """Return a search that is over."""
        return _Done(work(lambda: True))


AT_ONCE = AtOnce()
