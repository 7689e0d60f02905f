"""Reads a log's bytes piece by piece, with packet positions and timestamps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flight_logs.errors import (
    EmptyLogError,
    LogError,
    NotATlogError,
    RawStreamError,
    SwappedStampsError,
)
from flight_logs.frames.framing import (
    FRONT,
    PACKET_SIZE_LIMIT,
    PADDING,
    STAMP_SIZE,
    Loose,
    Packets,
    find_packets,
)
from flight_logs.frames.stamps import Stamps, are_swapped, read_stamps

DEFAULT_CHUNK_BYTES = 4 << 20
_LEAST_CHUNK_BYTES = 4 << 10
# Whether a packet begins at some byte depends on the next two packets, but not on the third.
_MARGIN = 3 * (PACKET_SIZE_LIMIT + STAMP_SIZE)
_AHEAD = 2
_SEARCHED_BYTES = 16 << 20
"""How far a first packet is searched for."""


@dataclass(frozen=True)
class LogPiece:
    """A piece of a log.

    Attributes:
        data: the bytes that `packets` point into; they change when the next piece is read.
        packets: the packets of the piece.
        loose: what looks like a packet and isn't known or is damaged (`framing.find_packets`).
        stamps: when each of the packets was recorded; None when there is no packet.
        bytes: size of the piece.
        bytes_outside: how many of them belong to neither `packets` nor `loose`.
        position: where the piece ends in the file.
        file_size: of the file, in bytes.
    """

    data: NDArray[np.uint8]
    packets: Packets
    loose: Loose
    stamps: Stamps | None
    bytes: int
    bytes_outside: int
    position: int
    file_size: int


def pieces(path: Path, chunk_bytes: int) -> Iterator[LogPiece]:
    """Yield the pieces of a log; the same packets whatever `chunk_bytes` is.

    Raises:
        LogError: the file can't be read, or isn't a tlog.
    """
    if chunk_bytes < 1:
        raise LogError(f"A piece of a log has at least one byte, not {chunk_bytes}.")
    try:
        with path.open("rb", buffering=0) as file:
            yield from _checked(path, _Scanner(file, max(chunk_bytes, _LEAST_CHUNK_BYTES)))
    except OSError as error:
        raise LogError(f"Cannot read {path}: {error.strerror or error}.") from error


def _checked(path: Path, scanner: _Scanner) -> Iterator[LogPiece]:
    """Pass pieces on, and reject what isn't a tlog as soon as that is clear."""
    is_tlog = False
    position = 0
    for piece in scanner.pieces():
        position = piece.position
        if not is_tlog and piece.stamps is not None:
            _refuse_other_formats(path, piece, piece.stamps)
            is_tlog = True
        # Nothing but messages of another dialect can be a tlog, too.
        is_tlog = is_tlog or 2 * piece.bytes_outside < piece.bytes
        if not is_tlog and position >= _SEARCHED_BYTES:
            break
        yield piece
    if position == 0:
        raise EmptyLogError(f"{path} is empty: nothing was recorded.")
    if not is_tlog:
        raise NotATlogError(
            f"{path} is not a tlog: there is no MAVLink packet in its "
            + (f"first {_SEARCHED_BYTES >> 20} MiB." if position >= _SEARCHED_BYTES else "bytes.")
        )


def _refuse_other_formats(path: Path, piece: LogPiece, stamps: Stamps) -> None:
    if stamps.mostly_missing:
        raise RawStreamError(
            f"{path} is a raw telemetry stream: its packets have no timestamps. Give the tlog "
            "recorded with it."
        )
    if are_swapped(piece.packets):
        raise SwappedStampsError(
            f"The timestamps in {path} are little-endian; a tlog has eight bytes of microseconds "
            "since 1970, big-endian, before each packet. Convert the file by reversing these "
            "bytes."
        )


class _Scanner:
    """Goes through a file with a buffer; places are counted from the buffer's beginning."""

    def __init__(self, file: FileIO, chunk_bytes: int) -> None:
        self._file = file
        self._memory = bytearray(FRONT + chunk_bytes + PADDING)
        self._data: NDArray[np.uint8] = np.frombuffer(self._memory, dtype=np.uint8)
        self._held = FRONT  # bytes in the buffer
        self._first = FRONT  # where a packet may begin
        self._last_stop = FRONT  # where the last record ended; less when that is gone
        self._last_time_s: float | None = None
        self._position = 0  # in the file

    def pieces(self) -> Iterator[LogPiece]:
        """Yield the pieces, one of them or more."""
        file_size = self._file.seek(0, 2) if self._file.seekable() else 0
        if file_size:
            self._file.seek(0)
        ended = False
        while not ended:
            ended = self._fill()
            limit = self._held if ended else self._held - _MARGIN
            piece = self._piece(limit, ended, file_size)
            yield piece
            self._drop(piece.bytes, limit)

    def _drop(self, done: int, limit: int) -> None:
        """Make room: `done` bytes are done, no packet begins before `limit` any more."""
        kept = self._data[done : self._held].copy()
        self._data[: len(kept)] = kept
        self._held = len(kept)
        self._first = max(limit - done, FRONT)
        self._last_stop -= done

    def _fill(self) -> bool:
        """Read until the buffer is full; return whether the file has ended."""
        capacity = len(self._memory) - PADDING
        space = memoryview(self._memory)[:capacity]
        while self._held < capacity:
            count = self._file.readinto(space[self._held :])
            if not count:
                break
            self._held += count
        self._data[self._held : self._held + PADDING] = 0
        return self._held < capacity

    def _piece(self, limit: int, ended: bool, file_size: int) -> LogPiece:
        found, loose = find_packets(self._data, self._first, self._held)
        count = int(np.searchsorted(found.start, limit))
        packets, ahead = found.at(slice(count)), found.at(slice(count, count + _AHEAD))
        loose = loose.at(slice(*np.searchsorted(loose.start, [FRONT + STAMP_SIZE, limit]).tolist()))
        stops = np.concatenate([[self._last_stop], packets.stop])
        following = np.searchsorted(packets.start, loose.stop)
        np.maximum.at(stops, following, loose.stop)
        previous_stop = stops[:-1]
        self._last_stop = int(stops[-1])
        end = self._held if ended else max(self._last_stop, limit - STAMP_SIZE)
        done = end - FRONT
        stamps = None
        if len(packets):
            stamps = read_stamps(packets, previous_stop, self._last_time_s, ahead)
            self._last_time_s = float(stamps.time_s[-1])
        inside = packets.stop - np.maximum(packets.start - STAMP_SIZE, previous_stop)
        inside_loose = loose.stop - loose.start + STAMP_SIZE
        self._position += done
        return LogPiece(
            data=self._data,
            packets=packets,
            loose=loose,
            stamps=stamps,
            bytes=done,
            bytes_outside=done - int(inside.sum()) - int(inside_loose.sum()),
            position=self._position,
            file_size=file_size,
        )
