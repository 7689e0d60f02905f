"""The count of a suite that runs other projects' tests, some of which are expected to fail."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Outcome", "Tally"]


class Outcome(NamedTuple):
    """The result of a test.

    Attributes:
        passed: whether it ended as it should, in time.
        why: the last line that it printed.
        output: all that it printed.
        took_s: real time.
    """

    passed: bool
    why: str
    output: str
    took_s: float


class Tally:
    """Prints each outcome, and counts those that are not as expected."""

    def __init__(self, verbose: bool) -> None:
        """Begin; `verbose` also prints what failing tests print."""
        self._verbose = verbose
        self._counted = self._passed = self._surprises = 0

    def add(self, name: str, outcome: Outcome, reason: str | None) -> None:
        """Count a test; `reason` is why it is expected to fail, None for one that is to pass."""
        self._counted += 1
        self._passed += outcome.passed
        self._surprises += outcome.passed is (reason is not None)
        word = "passed" if outcome.passed else "failed"
        note = "" if outcome.passed else f": {reason or outcome.why}"
        print(f"{word} {outcome.took_s:5.1f} s  {name}{note}", flush=True)
        if self._verbose and not outcome.passed:
            print(outcome.output)

    def end(self) -> int:
        """Print the sum; 0 when all was as expected, else 1."""
        sums = f"{self._passed} of {self._counted} passed"
        print(f"{sums}; {self._surprises} not as expected")
        return 1 if self._surprises else 0
