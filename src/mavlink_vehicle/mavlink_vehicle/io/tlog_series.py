"""Recordings in numbered files: a bounded number of them, each of a bounded size.

`flight.tlog` becomes `flight-000001.tlog`, `flight-000002.tlog` and so on. The numbers, and not
times, say which is older: the clock of a computer without a battery begins anywhere. A list beside
them, `flight.tlog.list`, has the name of each file that a server has written and the time stamp
that it begins with. What is not in the list, or begins otherwise, is never deleted.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import BinaryIO

from mavlink_vehicle.io.tlog import STAMP_BYTES
from mavlink_vehicle.io.tlog_thread import ThreadedTlogWriter

__all__ = ["FILES_MIN", "SeriesTlogWriter", "TlogSeries"]

FILES_MIN = 3
"""The one being written, the newest closed one, which stays, and one that can be deleted."""
_DIGITS = 6


@dataclass(frozen=True)
class _Written:
    """A closed file that a server has written: its name, number and size."""

    name: str
    number: int
    size_bytes: int


class TlogSeries:
    """The files of one series, and the list of those that servers have written.

    Servers may share a series: a file is locked while it is written, and the list while it is
    changed.
    """

    def __init__(self, path: Path | str, file_bytes: int, files: int) -> None:
        """Prepare; nothing is read or written yet.

        Args:
            path: name of the series, whose folder must exist.
            file_bytes: most that one file takes.
            files: most files, at least `FILES_MIN`.
        """
        path = Path(path)
        self.file_bytes = file_bytes
        self._files = files
        self._folder = path.parent
        self._path = path
        self._list = path.with_name(path.name + ".list")
        self._pattern = re.compile(
            rf"{re.escape(path.stem)}-(\d{{{_DIGITS},}}){re.escape(path.suffix)}"
        )

    def begin(self) -> tuple[Path, BinaryIO]:
        """Make the next file, locked, and delete the oldest ones that are too many.

        Raises:
            OSError: it can't be made, or an old one can't be deleted.
        """
        with self._changing() as listed:
            numbers = (self._number(each.name) for each in self._folder.iterdir())
            number = 1 + max(numbers, default=0)
            path = self._path.with_name(f"{self._path.stem}-{number:0{_DIGITS}}{self._path.suffix}")
            file = path.open("xb")
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                self._delete_surplus(listed)
            except OSError:
                file.close()
                path.unlink()
                raise
        return path, file

    def enter(self, path: Path, stamp: bytes) -> None:
        """Put a file that a server writes into the list.

        Args:
            path: the file.
            stamp: the time stamp that it begins with.

        Raises:
            OSError: the list can't be written.
        """
        with self._changing() as listed:
            listed[path.name] = stamp.hex()

    def _number(self, name: str) -> int:
        found = self._pattern.fullmatch(name)
        return 0 if found is None else int(found[1])

    def _delete_surplus(self, listed: dict[str, str]) -> None:
        """Delete the oldest closed files that leave no room for one more."""
        closed = sorted(self._closed(listed), key=lambda each: each.number)
        room_bytes = (self._files - 1) * self.file_bytes
        taken_bytes = sum(each.size_bytes for each in closed)
        # In flight the time before the present file stays on record.
        while len(closed) > 1 and (len(closed) >= self._files or taken_bytes > room_bytes):
            oldest = closed.pop(0)
            (self._folder / oldest.name).unlink(missing_ok=True)
            taken_bytes -= oldest.size_bytes
            del listed[oldest.name]

    def _closed(self, listed: dict[str, str]) -> Iterator[_Written]:
        """Yield the files of the list that nobody writes; forget those that are others by now."""
        for name, stamp in list(listed.items()):
            path, number = self._folder / name, self._number(name)
            try:
                with open(path, "rb", opener=_open_no_link) as file:
                    is_ours = number > 0 and file.read(STAMP_BYTES).hex() == stamp
                    if is_ours and _is_unlocked(file):
                        yield _Written(name, number, os.fstat(file.fileno()).st_size)
            except OSError:
                is_ours = False
            if not is_ours:
                del listed[name]

    @contextmanager
    def _changing(self) -> Iterator[dict[str, str]]:
        """Give the list, stamp by name, and write it when it was changed."""
        with open(self._list, "r+", encoding="utf-8", errors="replace", opener=_open_new) as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            lines = [line.rsplit(maxsplit=1) for line in file]
            listed = {words[0]: words[1] for words in lines if len(words) == 2}
            before = dict(listed)
            try:
                yield listed
            finally:
                if listed != before:
                    # In this order a full disk leaves the list as it was.
                    file.seek(0)
                    file.write("".join(f"{name} {stamp}\n" for name, stamp in listed.items()))
                    file.flush()
                    file.truncate()


def _open_new(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_CREAT, 0o666)


def _open_no_link(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)


def _is_unlocked(file: BinaryIO) -> bool:
    """Return whether nobody writes a file."""
    with suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        return True
    return False


class SeriesTlogWriter(ThreadedTlogWriter):
    """Writes packets into the files of a series, by a thread.

    The thread also begins the next file, and deletes old ones, so that a turn waits for neither.
    When that fails, recording ends and `failure` says so.
    """

    def __init__(self, series: TlogSeries, path: Path | str) -> None:
        """Make the first file, and start the thread.

        Args:
            series: the files.
            path: name of the series, for messages.

        Raises:
            LinkError: it can't be made, or its folder does not exist.
        """
        self._series = series
        self._size_bytes = 0
        super().__init__(path)

    def _open(self) -> BinaryIO:
        self.path, file = self._series.begin()
        return file

    def _put(self, taken: bytes) -> None:
        if self._size_bytes and self._size_bytes + len(taken) > self._series.file_bytes:
            self._file.close()
            self._file, self._size_bytes = self._open(), 0
        if not self._size_bytes:
            self._series.enter(self.path, taken[:STAMP_BYTES])
        super()._put(taken)
        self._size_bytes += len(taken)

    def _finish(self) -> None:
        super()._finish()
        if not self._size_bytes:
            self._try(partial(self.path.unlink, missing_ok=True))
