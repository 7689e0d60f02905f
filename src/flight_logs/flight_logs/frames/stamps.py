"""The timestamps of the packets in a piece of a tlog, and checks of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight_logs.frames.framing import STAMP_SIZE, Packets

# pymavlink's reader, too, takes a time after a damaged place to be wrong if it is that far off.
_CREDIBLE_GAP_S = 3 * 24 * 3600.0
# In microseconds, about 1987 and 2112: the times of today are between the two, and the same
# bytes in the wrong order are far beyond.
_EARLY_US, _LATE_US = 1 << 49, 1 << 52


@dataclass(frozen=True)
class Stamps:
    """The times of some packets.

    Attributes:
        time_s: seconds since 1970, shape (n,).
        lost: packets whose own time is missing or damaged; they have that of the one before.
        steps_back: how often a packet is earlier than the one before.
        mostly_missing: there is no room for a time before most of the packets.
    """

    time_s: NDArray[np.float64]
    lost: int
    steps_back: int
    mostly_missing: bool


def read_stamps(
    packets: Packets,
    previous_stop: NDArray[np.int64],
    last_time_s: float | None,
    ahead: Packets,
) -> Stamps:
    """Check the eight bytes before each packet: microseconds since 1970, big-endian.

    A time that is days off is damaged, unless the clock was set: then the next packet has the new
    time, too.

    Args:
        packets: one or more.
        previous_stop: where the record before each packet ends, shape (n,).
        last_time_s: time of the packet before the first, None when there was none.
        ahead: the next two packets, as far as there are any.
    """
    gap = packets.start - previous_stop
    time_s = packets.stamp_us.astype(np.float64) * 1e-6
    missing, damaged_before = gap < STAMP_SIZE, gap != STAMP_SIZE
    set_to = _agrees_with_next(packets, ahead)
    lost = 0
    before_s = last_time_s
    if before_s is None:
        before_s, lost = _first(time_s, missing, ahead, set_to)
    steps_s = np.abs(np.diff(time_s, prepend=before_s))
    for index in np.flatnonzero(damaged_before | (steps_s > _CREDIBLE_GAP_S)).tolist():
        if index:
            before_s = float(time_s[index - 1])
        if missing[index] or (
            abs(time_s[index] - before_s) > _CREDIBLE_GAP_S
            and (damaged_before[index] or not set_to[index])
        ):
            time_s[index] = before_s
            lost += 1
    earlier = np.diff(time_s, prepend=time_s[0] if last_time_s is None else last_time_s) < 0
    return Stamps(
        time_s,
        lost,
        steps_back=int(earlier.sum()),
        mostly_missing=2 * int(missing.sum()) > len(packets),
    )


def _agrees_with_next(packets: Packets, ahead: Packets) -> NDArray[np.bool_]:
    """Return which times are near that of the packet right after them, also of the one ahead."""
    stamp_us = np.concatenate([packets.stamp_us, ahead.stamp_us])
    start = np.concatenate([packets.start, ahead.start])
    stop = np.concatenate([packets.stop, ahead.stop])
    near = np.abs(np.diff(stamp_us.astype(np.float64))) <= _CREDIBLE_GAP_S * 1e6
    follows = start[1:] == stop[:-1] + STAMP_SIZE
    agrees: NDArray[np.bool_] = np.append(near & follows, np.False_)
    return agrees


def _first(
    time_s: NDArray[np.float64],
    missing: NDArray[np.bool_],
    ahead: Packets,
    set_to: NDArray[np.bool_],
) -> tuple[float, int]:
    """Return the time to begin with, and how many times before it were damaged: none or one."""
    known = np.flatnonzero(~missing)
    following_s = np.append(time_s, ahead.stamp_us.astype(np.float64) * 1e-6)
    others_agree = len(following_s) > 2 and not missing[0] and not set_to[0] and set_to[1:2].all()
    if others_agree and abs(following_s[1] - following_s[0]) > _CREDIBLE_GAP_S:
        time_s[0] = following_s[1]
        return float(time_s[0]), 1
    return float(time_s[known[0]] if len(known) else time_s[0]), 0


def are_swapped(packets: Packets) -> bool:
    """Return whether the times make sense only with their bytes the other way round."""
    stamps_us = packets.stamp_us
    as_written = np.median(stamps_us.astype(np.float64))
    other_way = np.median(stamps_us.byteswap().astype(np.float64))
    return bool(as_written >= _LATE_US and _EARLY_US <= other_way < _LATE_US)
