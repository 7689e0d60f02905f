"""Files that a ground station has put onto a vehicle, in memory and within limits."""

from __future__ import annotations

import errno
from typing import Protocol

from mavlink_sitl.mavlink.files.requests import RefusedError, of_errno

BYTES_MAX = 4 << 20
ENTRIES_MAX = 200


class StorageError(RefusedError):
    """A file operation that failed, by its errno."""

    def __init__(self, number: int) -> None:
        super().__init__(*of_errno(number))


class Storage:
    """Files by their paths; it outlives a reboot.

    Attributes:
        files: the contents.
    """

    def __init__(self) -> None:
        self.files: dict[str, bytearray] = {}

    def create(self, path: str) -> bytearray:
        """An empty file, whatever was there.

        Raises:
            StorageError: there is no room.
        """
        if path not in self.files and len(self.files) >= ENTRIES_MAX:
            raise StorageError(errno.ENOSPC)
        self.files[path] = bytearray()
        return self.files[path]

    def write(self, data: bytearray, offset: int, part: bytes) -> None:
        """Put bytes into a file; what is skipped is zeros.

        Raises:
            StorageError: there is no room.
        """
        end = offset + len(part)
        used = sum(map(len, self.files.values()))
        if used + max(end - len(data), 0) > BYTES_MAX:
            raise StorageError(errno.ENOSPC)
        data.extend(bytes(max(offset - len(data), 0)))
        data[offset:end] = part

    def remove(self, path: str) -> None:
        """Remove a file.

        Raises:
            StorageError: there is none.
        """
        if path not in self.files:
            raise StorageError(errno.ENOENT)
        del self.files[path]


class Contents(Protocol):
    """An open file."""

    @property
    def reported_size(self) -> int:
        """The size that is reported when the file is opened, in bytes."""

    def read(self, offset: int, count: int) -> bytes:
        """Bytes of it; none at its end.

        Raises:
            StorageError: it cannot be read so.
        """


class Stored:
    """A file that is there as it is; a log may still grow."""

    def __init__(self, data: bytes | bytearray) -> None:
        self.data = data

    @property
    def reported_size(self) -> int:
        """Its size."""
        return len(self.data)

    def read(self, offset: int, count: int) -> bytes:
        """See `Contents`."""
        return bytes(self.data[offset : offset + count])
