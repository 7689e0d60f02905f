"""Recordings: for each packet 8 bytes of microseconds since 1970, big-endian, then the packet.

This is the format of MAVProxy, Mission Planner and QGroundControl ("tlog").
"""

from __future__ import annotations

import re
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from mavlink_vehicle.errors import LinkError

_STAMP = struct.Struct(">Q")
STAMP_BYTES = _STAMP.size
_MAGIC_1, _MAGIC_2 = 0xFE, 0xFD
_MAGIC = re.compile(b"[\xfd\xfe]")
_SIGNED = 0x01
# A recording that was cut at its beginning starts within one packet.
_DAMAGE_MAX = 4096


def record(packet: bytes, unix_time_s: float | None = None) -> bytes:
    """Return a packet as it stands in a recording, by default of the present time."""
    stamp = time.time() if unix_time_s is None else unix_time_s
    return _STAMP.pack(int(stamp * 1e6)) + packet


class TlogWriter:
    """Writes packets of both directions to a file.

    `flush` hands everything to the operating system, so that only what came since then is
    lost when the process is killed; the driver calls it once a turn. When the disk is full,
    recording ends and flying continues: nothing is raised, and `failure` says so.

    Attributes:
        path: the file.
    """

    def __init__(self, path: Path | str, resumed: bool = False) -> None:
        """Create the file, or begin it again.

        Args:
            path: the file.
            resumed: append to it instead.

        Raises:
            LinkError: it can't be written, or its folder does not exist. A folder is never made:
                a mistyped path would fill a place where nobody looks for it.
        """
        self.path = Path(path)
        self._failure: LinkError | None = None
        self._dirty = False
        self._resumed = resumed
        try:
            self._file = self._open()
        except FileNotFoundError as error:
            folder = self.path.parent
            raise LinkError(
                f"Cannot record to {path}: the folder {folder} does not exist; create it first."
            ) from error
        except OSError as error:
            raise LinkError(f"Cannot record to {path}: {error.strerror or error}.") from error

    def _open(self) -> BinaryIO:
        return self.path.open("ab" if self._resumed else "wb")

    @property
    def failure(self) -> LinkError | None:
        """Why recording has ended, None while all is well."""
        return self._failure

    def write(self, packet: bytes, unix_time_s: float | None = None) -> None:
        """Add one packet, by default at the present time."""
        if self._failure is None:
            taken = record(packet, unix_time_s)
            self._dirty = True
            self._try(lambda: self._file.write(taken))

    def flush(self) -> None:
        """Hand what was written to the operating system."""
        if self._dirty and self._failure is None:
            self._dirty = False
            self._try(self._file.flush)

    def close(self) -> None:
        """Close the file; closing twice is harmless."""
        self._try(self._file.close)

    def _try(self, work: Callable[[], object]) -> None:
        try:
            work()
        except OSError as error:
            self._failure = LinkError(
                f"Recording to {self.path} has ended: {error.strerror or error}."
            )


class TlogReader:
    """Reads the packets of a recording: iterate for (unix time in seconds, packet).

    A last record that is cut short, as after a kill, ends the recording. Damaged places are
    skipped up to the next packet.

    Attributes:
        path: the file.
        position: how many bytes of it the last iteration has taken.
        size: bytes in all.
    """

    def __init__(self, path: Path | str) -> None:
        """Read the file.

        Raises:
            LinkError: it can't be read, or isn't a tlog.
        """
        self.path = Path(path)
        try:
            self._data = self.path.read_bytes()
        except OSError as error:
            raise LinkError(f"Cannot read {path}: {error.strerror or error}.") from error
        self.position, self.size = 0, len(self._data)
        if len(self._data) > _STAMP.size and not _begins(self._data):
            raise LinkError(f"{path} is not a tlog: no MAVLink packet follows the first timestamp.")

    def __iter__(self) -> Iterator[tuple[float, bytes]]:
        """Yield (unix time in seconds, packet)."""
        data = self._data
        position, end = 0, len(data)
        while position + _STAMP.size + 3 <= end:
            start = position + _STAMP.size
            size = _packet_size(data, start)
            if size == 0:
                found = _MAGIC.search(data, start + 1)
                if found is None:
                    return
                position = found.start() - _STAMP.size
                continue
            if start + size > end:
                return
            self.position = start + size
            yield _STAMP.unpack_from(data, position)[0] * 1e-6, data[start : start + size]
            position = start + size


def _begins(data: bytes) -> bool:
    """Return whether there is a packet at the beginning, or soon after some damage."""
    if data[_STAMP.size] in (_MAGIC_1, _MAGIC_2):
        return True
    for found in _MAGIC.finditer(data, _STAMP.size, _DAMAGE_MAX):
        start = found.start()
        if start + 3 > len(data):
            break
        following = start + _packet_size(data, start) + _STAMP.size
        if following < len(data) and data[following] in (_MAGIC_1, _MAGIC_2):
            return True
    return False


def _packet_size(data: bytes, start: int) -> int:
    magic, length, flags = data[start], data[start + 1], data[start + 2]
    if magic == _MAGIC_2:
        return length + 12 + (13 if flags & _SIGNED else 0)
    return length + 8 if magic == _MAGIC_1 else 0
