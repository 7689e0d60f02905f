"""Finds the intact records of a DataFlash file, and how much of the file is damaged."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from dataclasses import dataclass
from mmap import mmap

MAGIC = b"\xa3\x95"
_HEAD_SIZE = 3
_FMT, _FMT_SIZE = 128, 89
# Type, length, name, format and columns of a FMT, behind its head.
_FORMAT = struct.Struct("<BB4s16s64s")
_SIZES = {
    letter: size
    for letters, size in (
        ("bBM", 1), ("hHcCg", 2), ("iIfneEL", 4), ("dqQ", 8), ("N", 16), ("aZ", 64),
    )
    for letter in letters
}  # fmt: skip
"""Bytes of each letter of a format, as pymavlink's DFReader reads them."""
_TAIL_BYTES = 528
"""Bytes that may follow the last record: half a record, or the rest of a page of a flash chip."""
_TIME_US = struct.Struct("<Q")
_PULSE_US = 500_000
_CREDIBLE_STEP_US = 60_000_000


@dataclass(frozen=True)
class IntactRecords:
    """The intact records of a file.

    Attributes:
        spans: (begin, end) of the bytes that hold them, in order.
        damaged_bytes: bytes that belong to no record.
        times_us: TimeUS of records, one about every half second in which there are any; none in
            logs older than TimeUS.
    """

    spans: tuple[tuple[int, int], ...]
    damaged_bytes: int
    times_us: array[int]


def find_records(data: mmap, progress: Callable[[float], object]) -> IntactRecords:
    """Follow the records of a file from one to the next.

    A record counts if a FMT before it describes its type, and another record or the end of the
    file follows it. Records that a FMT describes wrongly cannot be read, and are left out without
    being damage.

    Args:
        data: the file.
        progress: called now and then with the share that was followed, 0 to 1.
    """
    return _Walk(data).follow(progress)


class _Walk:
    """Follows the records of a file."""

    def __init__(self, data: mmap) -> None:
        self._data = data
        self._sizes = {_FMT: _FMT_SIZE}
        self._timed: set[int] = set()
        self._unreadable: set[int] = set()
        self._spans: list[tuple[int, int]] = []
        self._begin = 0
        self._damaged_bytes = 0
        self._times_us = array("Q")
        self._latest_us: int | None = None

    def follow(self, progress: Callable[[float], object]) -> IntactRecords:
        """Follow the records to the end of the file."""
        data, end, offset, count = self._data, len(self._data), 0, 0
        while offset + _HEAD_SIZE <= end:
            count += 1
            if count % 100_000 == 0:
                progress(offset / end)
            stop = self._stop(offset, end)
            if stop is not None:
                self._take(data[offset + 2], offset, stop)
                offset = stop
                continue
            if end - offset < _TAIL_BYTES:
                break
            found = data.find(MAGIC, offset + 1)
            stop = end if found < 0 else found
            self._leave_out(offset, stop)
            self._damaged_bytes += stop - offset
            # A time before damage is not confirmed by one behind it.
            self._latest_us = None
            offset = stop
        self._leave_out(offset, end)
        if self._latest_us is not None:
            self._pulse(self._latest_us)
        return IntactRecords(tuple(self._spans), self._damaged_bytes, self._times_us)

    def _stop(self, offset: int, end: int) -> int | None:
        """Return where the record at an offset ends; None if there is no intact one."""
        data = self._data
        if data[offset : offset + 2] != MAGIC:
            return None
        size = self._sizes.get(data[offset + 2])
        if size is None or offset + size > end:
            return None
        stop = offset + size
        followed = data[stop : stop + 2] == MAGIC or end - stop < _TAIL_BYTES
        return stop if followed else None

    def _take(self, kind: int, offset: int, stop: int) -> None:
        if kind == _FMT:
            kind = self._take_format(offset)
        elif kind in self._timed:
            (time_us,) = _TIME_US.unpack_from(self._data, offset + _HEAD_SIZE)
            latest_us, self._latest_us = self._latest_us, time_us
            # A time is right if the next one agrees with it.
            if latest_us is not None and abs(time_us - latest_us) < _CREDIBLE_STEP_US:
                self._pulse(latest_us)
        if kind in self._unreadable:
            self._leave_out(offset, stop)

    def _take_format(self, offset: int) -> int:
        """Learn a type of records from its FMT, and return it."""
        kind, size, _, form, columns = _FORMAT.unpack_from(self._data, offset + _HEAD_SIZE)
        letters = form.rstrip(b"\0").decode("latin-1")
        known = all(letter in _SIZES for letter in letters)
        body = sum(_SIZES.get(letter, 0) for letter in letters)
        if size >= _HEAD_SIZE and kind != _FMT:
            self._sizes[kind] = size
        if not known or body + _HEAD_SIZE != size:
            self._unreadable.add(kind)
        elif letters.startswith("Q") and columns.startswith(b"TimeUS"):
            self._timed.add(kind)
        return int(kind)

    def _leave_out(self, offset: int, stop: int) -> None:
        if self._begin < offset:
            self._spans.append((self._begin, offset))
        self._begin = stop

    def _pulse(self, time_us: int) -> None:
        times_us = self._times_us
        if not times_us or time_us >= times_us[-1] + _PULSE_US:
            times_us.append(time_us)
