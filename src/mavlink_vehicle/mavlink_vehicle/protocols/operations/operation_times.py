"""The times at which an operation acts by itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

# Of a server that stops repeatedly only this much is excused, so that there is an end.
_EXCUSED_MAX_S = 60.0


@dataclass
class OperationTimes:
    """The times of one operation, in seconds.

    Attributes:
        limit_s: it times out.
        silent_until_s: nothing is sent before; somebody else has asked for another mode.
        again_s: the command is sent again; None while that is not planned.
        reasons_until_s: end of the wait for the reasons of a rejection; None without one.
        rejected_until_s: a temporary rejection is followed by another attempt until then; None
            before the first.
    """

    limit_s: float = 0.0
    silent_until_s: float = -math.inf
    again_s: float | None = None
    reasons_until_s: float | None = None
    rejected_until_s: float | None = None
    _excusable_s: float = _EXCUSED_MAX_S

    def excuse(self, gap_s: float) -> float:
        """Add a time in which the server did not run; return how much of it is excused."""
        gap_s = min(gap_s, self._excusable_s)
        self._excusable_s -= gap_s
        self.limit_s += gap_s
        if self.again_s is not None:
            self.again_s += gap_s
        if self.reasons_until_s is not None:
            self.reasons_until_s += gap_s
        if self.rejected_until_s is not None:
            self.rejected_until_s += gap_s
        return gap_s

    def attempt_begins(self) -> None:
        """Forget the pause and the rejection of the attempt before."""
        self.again_s = self.reasons_until_s = None

    def next_s(self, command_s: float | None) -> float:
        """Return the earliest of them, and of the command's own deadline."""
        times = (self.limit_s, self.reasons_until_s, self.again_s, command_s)
        return min(time for time in times if time is not None)
