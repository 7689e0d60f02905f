"""Reads a log with the policies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tests.explore.course import Course
from tests.explore.log import Entry
from tests.explore.policies import POLICIES
from tests.explore.scenario import Scenario
from tests.explore.temporal import Policy


@dataclass(frozen=True)
class Violation:
    """A policy that did not hold.

    Attributes:
        policy: its name.
        time_s: simulated time.
        craft: of which vehicle.
        what: what was seen.
        entry: its place in the log.
    """

    policy: str
    time_s: float
    craft: int
    what: str
    entry: int


class Checker:
    """Reads a log with policies, entry by entry.

    Attributes:
        found: what was violated, the first of each policy.
    """

    def __init__(self, scenario: Scenario, policies: Sequence[Policy] = POLICIES) -> None:
        """Begin."""
        self.found: dict[str, Violation] = {}
        self._course = Course(scenario)
        self._policies = [policy.fresh() for policy in policies]
        self._reading: dict[tuple[str, type], list[Policy]] = {}
        self._place = 0

    @property
    def looked(self) -> dict[str, int]:
        """How often each policy had something to look at."""
        return {policy.name: policy.looked for policy in self._policies}

    def take(self, entry: Entry) -> None:
        """Read the next entry."""
        view = self._course.take(entry)
        for policy in self._of(entry.kind, type(entry.value)):
            what = policy.read(entry, view)
            if what and policy.name not in self.found:
                self.found[policy.name] = Violation(
                    policy.name, entry.time_s, entry.craft, what[:300], self._place
                )
        self._place += 1

    def _of(self, kind: str, of: type) -> list[Policy]:
        """Return the policies that look at entries of a kind whose value is of a class."""
        if (kind, of) not in self._reading:
            readers = [policy for policy in self._policies if policy.reads(kind, of)]
            self._reading[kind, of] = readers
        return self._reading[kind, of]
