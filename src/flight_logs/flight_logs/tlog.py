"""Telemetry logs as arrays: `read_tlog` for all of one, `iterate_tlog` piece by piece.

`for_each_log` works on many of them in processes.
"""

from __future__ import annotations

import multiprocessing
import os
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from flight_logs.dialect import MessageTable, message_names
from flight_logs.errors import LogError
from flight_logs.frames.pieces import DEFAULT_CHUNK_BYTES, LogPiece, pieces
from flight_logs.frames.records import Records, empty_records, headers_of, records_by_name

__all__ = ["DEFAULT_CHUNK_BYTES", "Counts", "Tlog", "for_each_log", "iterate_tlog", "read_tlog"]

Result = TypeVar("Result")
Progress = Callable[[int, int], None]
"""Called with the bytes read so far and the size of the file."""


@dataclass(frozen=True)
class Counts:
    """Counters of a log; those of several pieces can be added.

    Attributes:
        bytes: how many were read.
        packets: packets with a right checksum, of messages that the dialect has.
        signed: those of them that carry a signature (it is not checked; nobody knows the key).
        bad_checksums: records in their place whose checksum is wrong.
        unknown_messages: records of messages unknown to the dialect, by message number.
        bytes_outside: bytes that belong to none of these.
        stamps_lost: packets whose time is missing or damaged; they got the one before.
        steps_back: how often the clock went backwards from one packet to the next.
    """

    bytes: int = 0
    packets: int = 0
    signed: int = 0
    bad_checksums: int = 0
    unknown_messages: Mapping[int, int] = field(default_factory=dict)
    bytes_outside: int = 0
    stamps_lost: int = 0
    steps_back: int = 0

    def __add__(self, other: Counts) -> Counts:
        """Return the counts of both together."""
        sums = {
            item.name: getattr(self, item.name) + getattr(other, item.name)
            for item in fields(self)
            if item.name != "unknown_messages"
        }
        unknown = Counter(self.unknown_messages) + Counter(other.unknown_messages)
        return Counts(**sums, unknown_messages=dict(unknown))


class Tlog(Mapping[str, Records]):
    """The messages of a log, or of a piece of it: records by the name of the message.

    A record has `time_s` (float64, seconds since 1970), `system`, `component`,
    `sequence_number` (each uint8), then the message's fields in the order of the wire, in the
    units of the dialect; text as bytes without the zeros at its end.

    Attributes:
        path: the file.
        counts: what was met, beside the messages.
        unknown: time, sender and sequence number of records of messages unknown to the dialect;
            such a record may be damaged.
    """

    def __init__(
        self, path: Path, records: Mapping[str, Records], counts: Counts, unknown: Records
    ) -> None:
        """Put together what was read."""
        self.unknown = unknown
        self.path = path
        self.counts = counts
        self._records = dict(sorted(records.items()))

    def __getitem__(self, name: str) -> Records:
        """Return the records of a message that is in the log."""
        return self._records[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the messages."""
        return iter(self._records)

    def __len__(self) -> int:
        """Return how many different messages there are."""
        return len(self._records)

    def records(self, name: str) -> Records:
        """Return the records of a message, none of them when it isn't in the log.

        Raises:
            LogError: the dialect has no such message.
        """
        return self._records[name] if name in self else empty_records(_table(name))

    def units(self, name: str) -> Mapping[str, str]:
        """Return the units of a message's fields, of those that have one ("degE7", "cm/s").

        Raises:
            LogError: the dialect has no such message.
        """
        return MappingProxyType(dict(_table(name).units))

    def enums(self, name: str) -> Mapping[str, str]:
        """Return the names of the enums of a message's fields, of those that have one.

        Raises:
            LogError: the dialect has no such message.
        """
        return MappingProxyType(dict(_table(name).enums))


def read_tlog(
    path: Path | str,
    *,
    messages: Collection[str] | None = None,
    progress: Progress | None = None,
) -> Tlog:
    """Read a log whole; memory in proportion to the file.

    Args:
        path: the file.
        messages: names of the messages to decode, None for all; counts are of all.
        progress: called now and then.

    Raises:
        LogError: the file can't be read or isn't a tlog (see `errors`), or the dialect
            doesn't have a message that is asked for.
    """
    collected: dict[str, list[Records]] = {}
    unknown: list[Records] = []
    counts = Counts()
    for part in iterate_tlog(path, messages=messages, progress=progress):
        counts += part.counts
        unknown.append(part.unknown)
        for name, records in part.items():
            collected.setdefault(name, []).append(records)
    joined = {}
    for name in list(collected):  # one by one, so that not all are there twice
        parts = collected.pop(name)
        joined[name] = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return Tlog(Path(path), joined, counts, np.concatenate(unknown))


def iterate_tlog(
    path: Path | str,
    chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    *,
    messages: Collection[str] | None = None,
    progress: Progress | None = None,
) -> Iterator[Tlog]:
    """Read a log piece by piece; memory in proportion to `chunk_bytes`.

    Args:
        path: the file.
        chunk_bytes: how much of it to hold at a time.
        messages: names of the messages to decode, None for all; counts are of all.
        progress: called after each piece.

    Yields:
        The messages of each piece, in the order of the file.

    Raises:
        LogError: as for `read_tlog`.
    """
    wanted = None if messages is None else {_table(name).name for name in messages}
    for piece in pieces(Path(path), chunk_bytes):
        records: Mapping[str, Records] = {}
        if piece.stamps is not None:
            records = records_by_name(piece.data, piece.packets, piece.stamps.time_s, wanted)
        unknown = headers_of(piece.data, piece.loose.start[~piece.loose.known])
        yield Tlog(Path(path), records, _counts(piece), unknown)
        if progress is not None:
            progress(piece.position, piece.file_size)


def for_each_log(
    function: Callable[[Path], Result], paths: Sequence[Path], processes: int | None = None
) -> Iterator[Result]:
    """Yield what a function returns for each log, in their order.

    Args:
        function: of a module, so that another process can import it. Its result is copied
            from there: better figures than all records.
        paths: the logs.
        processes: how many at a time, as many as there are cores if not given.

    Raises:
        Exception: what the function raised for a log, in its place.
    """
    count = min(processes or os.cpu_count() or 1, len(paths))
    if count < 2:
        yield from map(function, paths)
        return
    # A fork would copy locks that other threads hold.
    with ProcessPoolExecutor(count, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(function, paths)


def _counts(piece: LogPiece) -> Counts:
    known = piece.loose.known
    unknown = Counter(piece.loose.number[~known].tolist())
    return Counts(
        bytes=piece.bytes,
        packets=len(piece.packets),
        signed=int(piece.packets.signed.sum()),
        bad_checksums=int(known.sum()),
        unknown_messages=dict(unknown),
        bytes_outside=piece.bytes_outside,
        stamps_lost=piece.stamps.lost if piece.stamps else 0,
        steps_back=piece.stamps.steps_back if piece.stamps else 0,
    )


def _table(name: str) -> MessageTable:
    try:
        return message_names()[name]
    except KeyError:
        raise LogError(
            f"There is no MAVLink message {name!r}; use a name such as 'HEARTBEAT'."
        ) from None
