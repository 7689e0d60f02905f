"""Files that a ground station has put onto a vehicle, in memory and within limits."""

from __future__ import annotations

import errno
import posixpath
from typing import Protocol

from mavlink_sitl.mavlink.files.requests import RefusedError, of_errno

BYTES_MAX = 4 << 20
ENTRIES_MAX = 200


class StorageError(RefusedError):
    """A file operation that failed, by its errno."""

    def __init__(self, number: int) -> None:
        super().__init__(*of_errno(number))


class Storage:
    """Files and folders by their paths; it outlives a reboot.

    Attributes:
        files: the contents.
        folders: those that were made.
    """

    def __init__(self) -> None:
        self.files: dict[str, bytearray] = {}
        self.folders: set[str] = set()

    def create(self, path: str) -> bytearray:
        """An empty file, whatever was there.

        Raises:
            StorageError: there is a folder of that name, or no room.
        """
        if path in self.folders:
            raise StorageError(errno.EISDIR)
        if path not in self.files:
            self._make_room()
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
            raise StorageError(errno.EISDIR if path in self.folders else errno.ENOENT)
        del self.files[path]

    def make_folder(self, path: str) -> None:
        """Make a folder.

        Raises:
            StorageError: the name is taken, or there is no room.
        """
        if path in self.folders or path in self.files:
            raise StorageError(errno.EEXIST)
        self._make_room()
        self.folders.add(path)

    def remove_folder(self, path: str) -> None:
        """Remove an empty folder.

        Raises:
            StorageError: there is none, or it is not empty.
        """
        if path not in self.folders:
            raise StorageError(errno.ENOTDIR if path in self.files else errno.ENOENT)
        if any(posixpath.dirname(other) == path for other in (*self.files, *self.folders)):
            raise StorageError(errno.ENOTEMPTY)
        self.folders.discard(path)

    def rename(self, path: str, other: str) -> None:
        """Give a file, or a folder with all in it, another name.

        Raises:
            StorageError: there is none, or the other is a folder.
        """
        if other in self.folders or (path in self.folders and other in self.files):
            raise StorageError(errno.EEXIST)
        if path in self.files:
            self.files[other] = self.files.pop(path)
            return
        if path not in self.folders:
            raise StorageError(errno.ENOENT)
        if other.startswith(f"{path}/"):
            raise StorageError(errno.EINVAL)

        def moved(name: str) -> str:
            inside = name == path or name.startswith(f"{path}/")
            return other + name[len(path) :] if inside else name

        self.files = {moved(name): data for name, data in self.files.items()}
        self.folders = {moved(name) for name in self.folders}

    def _make_room(self) -> None:
        if len(self.files) + len(self.folders) >= ENTRIES_MAX:
            raise StorageError(errno.ENOSPC)


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
