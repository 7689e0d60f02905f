"""Requests and answers of MAVFTP as they are on the wire."""

from __future__ import annotations

import errno
import struct
from dataclasses import dataclass

DATA_BYTES = 239
HEADER = struct.Struct("<HBBBBBxI")
(
    NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE, REMOVE_FILE, MAKE_FOLDER,
    REMOVE_FOLDER, OPEN_TO_WRITE, TRUNCATE, RENAME, CRC, BURST,
) = range(16)  # fmt: skip
"""Operations"""
OPENING = (OPEN, CREATE, OPEN_TO_WRITE)
"""Their answers name the session of the file"""
ACK, NAK = 128, 129
FAIL, FAIL_ERRNO, INVALID_SIZE, INVALID_SESSION, NO_SESSIONS = 1, 2, 3, 4, 5
END, UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = 6, 7, 8, 9, 10
"""Errors"""
_BY_ERRNO = {errno.EEXIST: EXISTS, errno.ENOENT: NOT_FOUND, errno.EROFS: PROTECTED}


class RefusedError(Exception):
    """A request that is answered by a NAK; the arguments are its bytes."""


@dataclass(frozen=True)
class Request:
    """A request as it was received, its header decoded.

    Attributes:
        asker: system and component.
        number: its sequence number.
        session: of the file.
        op: what is wanted.
        size: of the data.
        offset: in the file, or the number of an entry.
        data: as many bytes as there are.
    """

    asker: tuple[int, int]
    number: int
    session: int
    op: int
    size: int
    offset: int
    data: bytes

    @property
    def path(self) -> str:
        """The data as a path; some senders end it with a zero, others do not."""
        return self.data.rstrip(b"\0").decode("ascii", "replace")


@dataclass(frozen=True)
class Burst:
    """An answer in many parts.

    Attributes:
        request: as it was received, with the offset of the next part and the number of the last.
        part_bytes: size of a part.
        left: how many parts may come yet.
    """

    request: Request
    part_bytes: int
    left: int


def packed(request: Request, number: int, kind: int, given: bytes, complete: bool = False) -> bytes:
    """An answer.

    Args:
        request: what it answers.
        number: its own sequence number.
        kind: `ACK` or `NAK`.
        given: its data.
        complete: whether it is the last part of a burst.
    """
    header = (number % 65536, request.session, kind, len(given), request.op, complete)
    return HEADER.pack(*header, request.offset) + given


def of_errno(number: int) -> bytes:
    """The data of a NAK."""
    code = _BY_ERRNO.get(number)
    return bytes((FAIL_ERRNO, number)) if code is None else bytes((code,))
