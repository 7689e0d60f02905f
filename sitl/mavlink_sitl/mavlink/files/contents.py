"""Contents of an open file."""

from __future__ import annotations

from typing import Protocol


class Contents(Protocol):
    """An open file."""

    @property
    def told_size(self) -> int:
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
    def told_size(self) -> int:
        """Its size."""
        return len(self.data)

    def read(self, offset: int, count: int) -> bytes:
        """See `Contents`."""
        return bytes(self.data[offset : offset + count])
