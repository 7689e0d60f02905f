"""The file of a log that is downloaded: a `.part` file until it is complete."""

from __future__ import annotations

import time
from pathlib import Path
from typing import BinaryIO

from mavlink_vehicle.events import StoredLog

# The last bytes on disk are downloaded again, this many, to see whether it is the same log: numbers
# are given again when logs are erased.
_CHECKED_BYTES = 4096


def log_path(folder: Path, log: StoredLog, system_id: int, suffix: str) -> Path:
    """Return the path for a log: by vehicle, number and time."""
    when = "unknown_time"
    if log.time_utc_s:
        when = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime(log.time_utc_s))
    return folder / f"vehicle{system_id}_log{log.log_id}_{when}{suffix}"


class LogFile:
    """Stores one log; its bytes come in order.

    Attributes:
        path: of the complete file.
        stored_bytes: how much of the log is on disk.
        is_other_log: what came differs from what was on disk; nothing more is written. A file
            that is opened afresh starts from the beginning.
    """

    def __init__(self, path: Path, size_bytes: int, afresh: bool = False) -> None:
        """Open the `.part` file; a shorter or equal one is continued.

        Args:
            path: of the complete file. It is only replaced by a complete one.
            size_bytes: of the log.
            afresh: begin again, whatever is on disk.

        Raises:
            OSError: the folder or the file cannot be written.
        """
        self.path = path
        self.is_other_log = False
        self._size = size_bytes
        self._part = path.with_name(path.name + ".part")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file: BinaryIO = self._part.open("w+b" if afresh else "a+b")
        self._file.close()
        self._file = self._part.open("r+b")
        found = self._part.stat().st_size
        if found > size_bytes:
            self._file.truncate(0)
            found = 0
        self.stored_bytes = found

    @property
    def resume_bytes(self) -> int:
        """The offset to download from: a little before the end of what is on disk."""
        return max(self.stored_bytes - _CHECKED_BYTES, 0)

    def write(self, offset_bytes: int, data: bytes) -> None:
        """Store the next bytes; those that are on disk already are compared.

        Raises:
            OSError: the disk is full, or the like.
            ValueError: bytes are missing before these.
        """
        if offset_bytes > self.stored_bytes:
            raise ValueError(f"bytes {self.stored_bytes} to {offset_bytes} are missing")
        known = min(self.stored_bytes - offset_bytes, len(data))
        self._file.seek(offset_bytes)
        if self.is_other_log or self._file.read(known) != data[:known]:
            self.is_other_log = True
            return
        self._file.seek(offset_bytes + known)
        self._file.write(data[known:])
        self.stored_bytes += len(data) - known

    def finish(self) -> None:
        """Give the complete file its name.

        Raises:
            OSError: it cannot be written or renamed.
        """
        self.close()
        self._part.replace(self.path)

    def close(self) -> None:
        """Keep what came, to resume.

        Raises:
            OSError: it cannot be written.
        """
        self._file.close()
