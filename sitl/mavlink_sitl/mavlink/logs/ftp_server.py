"""MAVFTP, to read only: the folder of the logs, as the firmware names it.

https://mavlink.io/en/services/ftp.html; the rules are those of GCS_FTP.cpp and mavlink_ftp.cpp.
BurstReadFile and everything that writes are refused as unknown.
"""

from __future__ import annotations

import posixpath
import struct
from collections import deque
from collections.abc import Callable, Iterable
from datetime import datetime, timezone

from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.logs.logbook import Logbook
from mavlink_sitl.mavlink.messages.streams import NEVER_US

_STEP_US = 2_000
_DATA_BYTES = 239
_HEADER = struct.Struct("<HBBBBBxI")
_TERMINATE, _RESET, _LIST, _OPEN, _READ = 1, 2, 3, 4, 5
_ACK, _NAK = 128, 129
_FAIL, _INVALID_SESSION, _NO_SESSIONS, _END, _UNKNOWN, _NOT_FOUND = 1, 4, 5, 6, 7, 10


class FtpServer:
    """An ArduPilot's: a few requests wait for a thread of its own; more are dropped."""

    waiting_max = 5
    between = b"\0\0"
    """What ends an entry of a folder"""
    opened_twice = _FAIL
    closed = _NOT_FOUND
    reopened_us, idle_us = 3_000_000, 20_000_000
    """After so long without a request a file may be opened anew, and is closed"""

    def __init__(self, logbook: Logbook, send: Callable[[Message], None]) -> None:
        self._logbook = logbook
        self._send = send
        self._waiting: deque[tuple[bytes, tuple[int, int]]] = deque()
        self._due_us = NEVER_US
        self._open: bytearray | None = None
        self._used_us = 0
        self._last: tuple[tuple[int, int], int, bytes] | None = None

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        return self._due_us

    def receive(self, message: Message, now_us: int) -> None:
        """Take a request."""
        if len(self._waiting) < self.waiting_max:
            asker = (message.get_srcSystem(), message.get_srcComponent())
            self._waiting.append((bytes(message.payload), asker))
            self._due_us = min(self._due_us, now_us + _STEP_US)

    def tick(self, now_us: int) -> None:
        """Answer one request."""
        request, asker = self._waiting.popleft()
        self._due_us = now_us + _STEP_US if self._waiting else NEVER_US
        idle_us = self.reopened_us if request[3] == _OPEN else self.idle_us
        if now_us - self._used_us > idle_us:
            self._open = None
        self._used_us = now_us
        number = _HEADER.unpack_from(request)[0]
        if self._last is None or self._last[:2] != (asker, number):
            self._last = (asker, number, self._answer(request))
        reply = self._last[2].ljust(_HEADER.size + _DATA_BYTES, b"\0")
        self._send(dialect.MAVLink_file_transfer_protocol_message(0, *asker, reply))

    def _answer(self, request: bytes) -> bytes:
        number, session, op, size, _, _, offset = _HEADER.unpack_from(request)
        data = request[_HEADER.size : _HEADER.size + min(size, _DATA_BYTES)]
        given = self._do(op, data.rstrip(b"\0").decode("ascii", "replace"), offset, size)
        kind = _ACK if isinstance(given, bytes) else _NAK
        given = given if isinstance(given, bytes) else bytes([given])
        numbers = ((number + 1) % 65536, session, kind, len(given), op, 0, offset)
        return _HEADER.pack(*numbers) + given

    def _do(self, op: int, path: str, offset: int, size: int) -> bytes | int:
        """Return the data of the answer, or the number of an error."""
        if op == _LIST:
            return self._list(path, offset)
        if op == _OPEN:
            return self._begin(path)
        if op == _READ:
            return self._read(offset, size)
        if op in (_TERMINATE, _RESET):
            self._open = None
            return b""
        return _UNKNOWN

    def _files(self) -> dict[str, bytearray]:
        """The logs by path."""
        logs = enumerate(self._logbook.logs, 1)
        return {f"/APM/LOGS/{number:08}.BIN": log.data for number, log in logs}

    def _list(self, path: str, skipped: int) -> bytes | int:
        files, folders = self._files(), _with_those_above(self._folders())
        path = path or "/"  # the root has both names (AP_Filesystem::opendir)
        if path not in folders:
            return _NOT_FOUND
        entries = ["D.", "D.."]
        entries += [f"D{posixpath.basename(one)}" for one in sorted(folders) if _is_in(one, path)]
        for name, data in sorted(files.items()):
            if _is_in(name, path):
                entries.append(f"F{posixpath.basename(name)}\t{len(data)}")
        given = b""
        for entry in entries[skipped:]:
            if len(given) + len(entry) + len(self.between) > _DATA_BYTES:
                break
            given += entry.encode("ascii") + self.between
        return given or _END

    def _folders(self) -> list[str]:
        return ["/APM/LOGS"]

    def _begin(self, path: str) -> bytes | int:
        if self._open is not None:
            return self.opened_twice
        data = self._files().get(path)
        if data is None:
            return _NOT_FOUND
        self._open = data
        return struct.pack("<I", len(data))

    def _read(self, offset: int, size: int) -> bytes | int:
        if self._open is None:
            return self.closed
        return bytes(self._open[offset : offset + min(size, _DATA_BYTES)]) or _END


class Px4FtpServer(FtpServer):
    """A PX4's: one file is open at a time, and a part is always full."""

    waiting_max = 100
    between = b"\0"
    opened_twice = _NO_SESSIONS
    closed = _INVALID_SESSION
    reopened_us = idle_us = 10_000_000

    def _files(self) -> dict[str, bytearray]:
        found = {}
        for number, log in enumerate(self._logbook.logs):
            name = f"sess{number:03}/log100.ulg"
            if log.begun_unix_s:
                begun = datetime.fromtimestamp(log.begun_unix_s, timezone.utc)
                name = begun.strftime("%Y-%m-%d/%H_%M_%S.ulg")
            found[f"/fs/microsd/log/{name}"] = log.data
        return found

    def _folders(self) -> list[str]:
        return ["/fs/microsd/log", *{posixpath.dirname(path) for path in self._files()}]

    def _read(self, offset: int, size: int) -> bytes | int:
        return super()._read(offset, _DATA_BYTES)


def _with_those_above(folders: Iterable[str]) -> set[str]:
    found = set(folders)
    for folder in folders:
        above = folder
        while above != "/":
            above = posixpath.dirname(above)
            found.add(above)
    return found


def _is_in(path: str, folder: str) -> bool:
    return path != "/" and posixpath.dirname(path) == folder
