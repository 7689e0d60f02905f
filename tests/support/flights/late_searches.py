"""Searches that take their time, on the clock of a simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from navigation_core.searches import IsWanted, Search

ResultT = TypeVar("ResultT")


class LateSearch(Generic[ResultT]):
    """A search whose result is there from a time on."""

    def __init__(self, value: ResultT, ready_s: float, clock: Callable[[], float]) -> None:
        """Take the result, and when it may be seen."""
        self._value, self._ready_s, self._clock = value, ready_s, clock
        self.abandoned = False

    def result(self) -> ResultT | None:
        """Return the result once it is time."""
        assert not self.abandoned, "a search that nobody waits for was asked"
        return self._value if self._clock() >= self._ready_s else None

    def abandon(self) -> None:
        """Take note."""
        self.abandoned = True


class LateSearcher:
    """Takes a while for each search, and believes that it takes another while.

    Attributes:
        takes_s: what each search takes.
        lead_s: what the flight is told.
        begun: how many have begun.
    """

    def __init__(self, clock: Callable[[], float], takes_s: float, lead_s: float) -> None:
        """Prepare.

        Args:
            clock: the time of the simulation.
            takes_s: what each search takes.
            lead_s: what the flight is told.
        """
        self._clock, self.takes_s = clock, takes_s
        self.lead_s = lead_s
        self.begun = 0

    def begin(self, work: Callable[[IsWanted], ResultT]) -> Search[ResultT]:
        """Begin a search."""
        self.begun += 1
        return LateSearch(work(lambda: True), self._clock() + self.takes_s, self._clock)
