"""Rate of each message in a recording. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight_logs.frames.records import Records
from flight_logs.vehicles import Source


@dataclass(frozen=True)
class MessageRate:
    """One message of one sender; times in s.

    Attributes:
        count: how many there are.
        first_s: when the first came.
        last_s: when the last came.
        longest_gap_s: the longest time between two.
    """

    count: int
    first_s: float
    last_s: float
    longest_gap_s: float

    @property
    def rate_hz(self) -> float | None:
        """Rate from the first to the last; None for a single one."""
        passed_s = self.last_s - self.first_s
        return (self.count - 1) / passed_s if passed_s > 0.0 else None


def count_messages(
    rates: dict[tuple[Source, str], MessageRate], name: str, records: Records
) -> None:
    """Count a message's records of the next piece of a recording, in the order of time."""
    keys = (records["system"].astype(np.int64) << 8) + records["component"]
    for key in np.unique(keys).tolist():
        time_s = np.maximum.accumulate(records["time_s"][keys == key])
        source = (key >> 8, key & 0xFF)
        before = rates.get((source, name))
        first_s, last_s = float(time_s[0]), float(time_s[-1])
        gap_s = float(np.diff(time_s).max(initial=0.0))
        count = len(time_s)
        if before is not None:
            gap_s = max(gap_s, before.longest_gap_s, first_s - before.last_s)
            first_s, count = before.first_s, count + before.count
        rates[source, name] = MessageRate(count, first_s, max(first_s, last_s), gap_s)
