"""MAVFTP: the protocol.

https://mavlink.io/en/services/ftp.html; the rules are those of GCS_FTP.cpp and mavlink_ftp.cpp: one
file is open at a time; requests wait for a thread of its own; a request that comes again gets the
same answer. TruncateFile is not known.
"""

from __future__ import annotations

import errno
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.files import requests as ftp
from mavlink_sitl.mavlink.files.component_metadata import crc32
from mavlink_sitl.mavlink.files.file_system import (
    ArduPilotFileSystem,
    FileSystem,
    Px4FileSystem,
)
from mavlink_sitl.mavlink.files.requests import (
    ACK,
    DATA_BYTES,
    HEADER,
    NAK,
    Burst,
    RefusedError,
    Request,
    packed,
)
from mavlink_sitl.mavlink.files.storage import Contents, StorageError
from mavlink_sitl.mavlink.messages.streams import NEVER_US

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.mavlink.logs.logbook import Logbook

T = TypeVar("T")

_STEP_US = 2_000
_BURST_PER_STEP = 8


class FtpServer:
    """An ArduPilot's: a few requests wait for a thread of its own; more are dropped."""

    waiting_max = 5
    between = b"\0\0"
    """The bytes that end an entry in the answer to ListDirectory"""
    system: type[FileSystem] = ArduPilotFileSystem
    unknown = ftp.FAIL
    idle_us, closed_us = 3_000_000, 20_000_000
    """Times without a request after which another file may be opened, also in another session, and
    after which an open file is closed"""
    parts_max = 2000

    def __init__(self, card: Logbook, vehicle: Commander, send: Callable[[Message], None]) -> None:
        self._files = self.system(card, vehicle)
        self._send = send
        self._waiting: deque[Request] = deque()
        self._due_us = NEVER_US
        self._open: Contents | None = None
        self._written: bytearray | None = None
        self._session: int | None = None
        self._used_us = 0
        self._burst: Burst | None = None
        self._last: tuple[Request, bytes] | None = None

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        return self._due_us

    def receive(self, message: Message, now_us: int) -> None:
        """Take a request."""
        if len(self._waiting) >= self.waiting_max:
            return
        payload = bytes(message.payload)
        asker = (message.get_srcSystem(), message.get_srcComponent())
        number, session, op, size, _, _, offset = HEADER.unpack_from(payload)
        data = payload[HEADER.size : HEADER.size + min(size, DATA_BYTES)]
        self._waiting.append(Request(asker, number, session, op, size, offset, data))
        self._due_us = min(self._due_us, now_us + _STEP_US)

    def tick(self, now_us: int) -> None:
        """Continue a burst, or answer one request."""
        if self._burst is not None:
            self._used_us = now_us
            for _ in range(_BURST_PER_STEP):
                if self._burst is not None:
                    self._send_part(self._burst)
        elif self._waiting:
            self._answer(self._waiting.popleft(), now_us)
        busy = self._waiting or self._burst is not None
        self._due_us = now_us + _STEP_US if busy else NEVER_US

    # Answers.

    def _answer(self, request: Request, now_us: int) -> None:
        if self._last is not None and replace(request, data=b"") == self._last[0]:
            self._reply(request.asker, self._last[1])
            return
        if now_us - self._used_us > self.closed_us:
            self._close()
        idle = now_us - self._used_us > self.idle_us
        self._used_us = now_us
        try:
            if request.size > DATA_BYTES:
                raise RefusedError(ftp.INVALID_SIZE)
            given = self._do(request, idle)
        except RefusedError as error:
            kind, given = NAK, bytes(error.args)
        else:
            if given is None:
                return
            kind = ACK
        answered = request
        if kind == ACK and request.op in ftp.OPENING:
            answered = replace(request, session=self._session_for(request))
        answer = packed(answered, request.number + 1, kind, given)
        self._last = (replace(request, data=b""), answer)
        self._reply(request.asker, answer)

    def _reply(self, asker: tuple[int, int], answer: bytes) -> None:
        answer = answer.ljust(HEADER.size + DATA_BYTES, b"\0")
        self._send(dialect.MAVLink_file_transfer_protocol_message(0, *asker, answer))

    def _do(self, request: Request, idle: bool) -> bytes | None:
        """Carry out a request; None when the answer comes in parts."""
        self._check_session(request, idle)
        if request.op == ftp.NONE:
            return b""
        if request.op in (ftp.TERMINATE, ftp.RESET):
            return self._end(request)
        if request.op == ftp.BURST:
            self._begin_burst(request)
            return None
        known: dict[int, Callable[[Request], bytes]] = {
            ftp.LIST: self._list,
            ftp.OPEN: self._open_to_read,
            ftp.READ: self._read,
            ftp.CREATE: self._open_to_write,
            ftp.OPEN_TO_WRITE: self._open_to_write,
            ftp.WRITE: self._write,
            ftp.REMOVE_FILE: self._remove,
            ftp.MAKE_FOLDER: self._make_folder,
            ftp.REMOVE_FOLDER: self._remove_folder,
            ftp.RENAME: self._rename,
            ftp.CRC: self._crc,
        }
        if request.op not in known:
            raise RefusedError(self.unknown)
        return known[request.op](request)

    # Sessions.

    def _close(self) -> None:
        self._open = self._written = self._session = self._burst = None

    def _check_session(self, request: Request, idle: bool) -> None:
        """A file that is open belongs to the session that opened it, until it is idle."""
        if self._session is None or request.op in (ftp.TERMINATE, ftp.RESET):
            return
        other = request.session != self._session
        if idle and (other or request.op == ftp.OPEN):
            self._close()
        elif other:
            raise RefusedError(ftp.INVALID_SESSION)

    def _end(self, request: Request) -> bytes:
        """TerminateSession and ResetSessions: of another session nothing happens."""
        if request.session == self._session:
            self._close()
        return b""

    def _may_open(self) -> None:
        if self._session is not None:
            raise RefusedError(ftp.FAIL)

    def _in_session(self, request: Request, file: T | None) -> T:
        """The file that is read or written, if the session has one."""
        if self._session is None:
            raise RefusedError(ftp.NOT_FOUND)
        if file is None:
            raise RefusedError(ftp.FAIL)
        return file

    def _session_for(self, request: Request) -> int:
        return request.session

    # Reading.

    def _list(self, request: Request) -> bytes:
        given = b""
        for entry in self._files.entries(request.path)[request.offset :]:
            if len(given) + len(entry) + len(self.between) > DATA_BYTES:
                break
            given += entry.encode("ascii", "replace") + self.between
        if not given:
            raise RefusedError(ftp.END)
        return given

    def _open_to_read(self, request: Request) -> bytes:
        self._may_open()
        contents = self._files.open(request.path)
        self._open, self._session = contents, self._session_for(request)
        return struct.pack("<I", contents.reported_size)

    def _part(self, request: Request, count: int) -> bytes:
        part = self._in_session(request, self._open).read(request.offset, count)
        if not part:
            raise RefusedError(ftp.END)
        return part

    def _read(self, request: Request) -> bytes:
        return self._part(request, min(request.size, DATA_BYTES))

    def _begin_burst(self, request: Request) -> None:
        self._in_session(request, self._open)
        self._last = None
        size = min(request.size, DATA_BYTES) or DATA_BYTES
        self._burst = Burst(request, size, self.parts_max)

    def _send_part(self, burst: Burst) -> None:
        request, number = burst.request, burst.request.number + 1
        last = burst.left == 1
        try:
            part = self._part(request, burst.part_bytes)
        except RefusedError as error:
            self._burst = None
            self._reply(request.asker, packed(request, number, NAK, bytes(error.args)))
            return
        self._reply(request.asker, packed(request, number, ACK, part, last))
        ahead = replace(request, number=number, offset=request.offset + len(part))
        self._burst = None if last else Burst(ahead, burst.part_bytes, burst.left - 1)

    def _crc(self, request: Request) -> bytes:
        contents = self._files.open(request.path)
        data = bytearray()
        while part := contents.read(len(data), DATA_BYTES):
            data += part
        return struct.pack("<I", crc32(bytes(data)))

    # Writing.

    def _open_to_write(self, request: Request) -> bytes:
        """CreateFile makes an empty file, OpenFileWO takes one that is there."""
        self._may_open()
        path = self._files.writable(request.path, new=True)
        files = self._files.storage.files
        if request.op == ftp.CREATE:
            self._written = self._files.storage.create(path)
        elif path in files:
            self._written = files[path]
        else:
            raise StorageError(errno.ENOENT)
        self._session = self._session_for(request)
        return b""

    def _write(self, request: Request) -> bytes:
        written = self._in_session(request, self._written)
        self._files.storage.write(written, request.offset, request.data)
        return b""

    def _remove(self, request: Request) -> bytes:
        self._files.storage.remove(self._files.writable(request.path))
        return b""

    def _make_folder(self, request: Request) -> bytes:
        path = self._files.clean(request.path)
        if path in self._files.folders() or path in self._files.files():
            raise StorageError(errno.EEXIST)
        self._files.storage.make_folder(self._files.writable(request.path, new=True))
        return b""

    def _remove_folder(self, request: Request) -> bytes:
        self._files.storage.remove_folder(self._files.writable(request.path))
        return b""

    def _rename(self, request: Request) -> bytes:
        """From one path to another, with a zero between them."""
        first, _, second = request.data.partition(b"\0")
        if not first or not second.rstrip(b"\0"):
            raise RefusedError(ftp.INVALID_SIZE)
        paths = [each.rstrip(b"\0").decode("ascii", "replace") for each in (first, second)]
        before = self._files.writable(paths[0])
        self._files.storage.rename(before, self._files.writable(paths[1], new=True))
        return b""


class Px4FtpServer(FtpServer):
    """A PX4's: its one session is number 0, and a part is always full."""

    waiting_max = 100
    between = b"\0"
    system = Px4FileSystem
    unknown = ftp.UNKNOWN
    idle_us = closed_us = 10_000_000
    parts_max = 147
    """35,000 bytes"""

    def _check_session(self, request: Request, idle: bool) -> None:
        """There is one session only."""

    def _session_for(self, request: Request) -> int:
        return 0

    def _end(self, request: Request) -> bytes:
        if request.op == ftp.TERMINATE and request.session != self._session:
            raise RefusedError(ftp.INVALID_SESSION)
        self._close()
        return b""

    def _may_open(self) -> None:
        if self._session is not None:
            raise RefusedError(ftp.NO_SESSIONS)

    def _in_session(self, request: Request, file: T | None) -> T:
        if request.session != self._session or file is None:
            raise RefusedError(ftp.INVALID_SESSION)
        return file

    def _read(self, request: Request) -> bytes:
        return self._part(request, DATA_BYTES)

    def _begin_burst(self, request: Request) -> None:
        super()._begin_burst(replace(request, size=DATA_BYTES))

    def _write(self, request: Request) -> bytes:
        super()._write(request)
        return struct.pack("<I", len(request.data))
