"""Quality of a recorded link: lost packets, rates, silences. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight_logs.frames.records import Records
from flight_reports.contents.log_reader import Floats

# A sequence number that is this little behind the newest is a packet that came late; one that
# is farther behind is that many packets lost, as the numbers start again after 255.
_LATE_MAX = 16
# A restart shows in the time since boot, which comes about this long before or after.
_RESTART_S = 3.0
_INTERVALS_MAX = 240
# A source whose numbers make no sense (several links in one recording) loses "most" packets.
_NONSENSE = 0.6


@dataclass(frozen=True)
class LinkQuality:
    """Link quality between one sender and the recorder.

    Attributes:
        received: how many packets are in the recording, repeated ones not counted.
        lost: how many are missing by their sequence numbers.
        repeated: how many came twice.
        numbers_follow: False if the sequence numbers don't follow one another; then `lost` says
            nothing.
        intervals_s: shape (n + 1,), the bounds of the intervals that the rates are of.
        rate_hz: shape (n,), packets a second.
        loss: shape (n,), share of packets that are missing, 0 to 1; NaN where there are none.
        gaps: (from, to) in s, silences longer than asked for.
    """

    received: int
    lost: int
    repeated: int
    numbers_follow: bool
    intervals_s: Floats
    rate_hz: Floats
    loss: Floats
    gaps: tuple[tuple[float, float], ...]

    @property
    def loss_share(self) -> float:
        """Share of packets that are missing, 0 to 1."""
        return self.lost / max(self.received + self.lost, 1)


def missing_before(sequence_number: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return for each packet how many are missing before it; -1 for one that came late after all.

    The sum is the number of lost packets. Packets must not be repeated. Without an order of their
    own, the numbers do not show a loss of 240 packets or more in a row.

    Args:
        sequence_number: shape (n,), in the order in which they came.
    """
    number = sequence_number.astype(np.int64)
    step: NDArray[np.int64] = np.mod(np.diff(number, prepend=number[0] - 1), 256)
    step[step >= 256 - _LATE_MAX] -= 256
    newest = np.maximum.accumulate(np.cumsum(step))
    missing: NDArray[np.int64] = np.diff(newest, prepend=0) - 1
    return missing


def link_quality(
    packets: Records, duration_s: float, gap_s: float, restarts_s: Sequence[float] = ()
) -> LinkQuality:
    """Analyse one sender's packets, one or more.

    Args:
        packets: with `time_s` and `sequence_number`, by time.
        duration_s: of the recording.
        gap_s: silence that is longer than this is a gap.
        restarts_s: when the sender was seen to have restarted: it counts from 0 again then.
    """
    again = np.diff(packets["sequence_number"].astype(np.int64), prepend=-1) == 0
    fresh = packets[~again]
    time_s: Floats = fresh["time_s"]
    missing = missing_before(fresh["sequence_number"])
    for restart_s in restarts_s:
        recent = slice(*np.searchsorted(time_s, [restart_s - _RESTART_S, restart_s + _RESTART_S]))
        if len(missing[recent]):
            missing[recent.start + int(np.argmax(missing[recent]))] = 0
    lost = int(missing.sum())
    count = int(np.clip(duration_s, 1.0, _INTERVALS_MAX))
    bounds: Floats = np.linspace(0.0, max(duration_s, 1e-3), count + 1)
    received = np.histogram(time_s, bounds)[0]
    lost_then = np.histogram(time_s, bounds, weights=missing)[0]
    there = received + lost_then
    with np.errstate(divide="ignore", invalid="ignore"):
        loss = np.where(received > 0, np.clip(lost_then / there, 0.0, 1.0), np.nan)
    ends: Floats = np.append(time_s, duration_s)
    places = np.flatnonzero(np.diff(ends) > gap_s)
    return LinkQuality(
        received=len(fresh),
        lost=max(lost, 0),
        repeated=int(again.sum()),
        numbers_follow=lost <= _NONSENSE * (len(fresh) + lost),
        intervals_s=bounds,
        rate_hz=received / np.diff(bounds),
        loss=loss,
        gaps=tuple((float(ends[i]), float(ends[i + 1])) for i in places),
    )
