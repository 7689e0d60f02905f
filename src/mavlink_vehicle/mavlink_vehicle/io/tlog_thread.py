"""A recording that is written by a thread of its own.

A disk that is busy or worn holds a write up for seconds, as observed on a machine that unpacked
packages meanwhile. A server must not stop for that: its vehicle would.
"""

from __future__ import annotations

import threading
from collections import deque
from functools import partial
from pathlib import Path

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.tlog import TlogWriter, record

__all__ = ["ThreadedTlogWriter"]

# As much is lost when the process is killed.
_PERIOD_S = 0.1
# At 50 kB/s these are twenty minutes.
_WAITING_MAX_BYTES = 64_000_000
# Written at once, at most.
_PIECE_BYTES = 1_000_000
# A server stops within 5 s.
_CLOSED_WITHIN_S = 2.0


class ThreadedTlogWriter(TlogWriter):
    """Writes packets to a file as :class:`TlogWriter` does, a tenth of a second later.

    Neither :meth:`write` nor :meth:`flush` waits for the disk. When it is full, or has taken
    nothing for so long that the memory for it is used up, recording ends and `failure` says so.
    The thread writes the file and the attributes with its results, the caller the others.
    """

    def __init__(self, path: Path | str, resumed: bool = False) -> None:
        """Create the file, or begin it again, and start the thread.

        Args:
            path: the file.
            resumed: append to it instead.

        Raises:
            LinkError: it can't be written, or its folder does not exist.
        """
        super().__init__(path, resumed)
        self._waiting: deque[bytes] = deque()
        self._added_bytes = 0  # by the caller
        self._held_up: LinkError | None = None  # by the caller: the thread may never come back
        self._taken_bytes = 0  # by the thread
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> LinkError | None:
        """Why recording has ended, None while all is well."""
        return self._held_up or self._failure

    def write(self, packet: bytes, unix_time_s: float | None = None) -> None:
        """Add one packet, by default at the present time."""
        if self.failure is not None:
            return
        if self._added_bytes - self._taken_bytes > _WAITING_MAX_BYTES:
            self._held_up = LinkError(
                f"Recording to {self.path} has ended: the disk has taken nothing for too long."
            )
            return
        taken = record(packet, unix_time_s)
        self._added_bytes += len(taken)
        self._waiting.append(taken)

    def flush(self) -> None:
        """Do nothing: the thread hands over what waits, ten times a second."""

    def close(self) -> None:
        """Write what waits and close the file, if the disk takes it in time."""
        self._closing.set()
        self._thread.join(_CLOSED_WITHIN_S)

    def _run(self) -> None:
        closing = False
        while not closing:
            closing = self._closing.wait(_PERIOD_S)
            while self._waiting:
                taken = self._take()
                if self.failure is None:
                    self._try(partial(self._put, taken))
                self._taken_bytes += len(taken)
        self._finish()

    def _take(self) -> bytes:
        """Return whole records that wait, of at most `_PIECE_BYTES`."""
        taken = [self._waiting.popleft()]
        size = len(taken[0])
        while self._waiting and size + len(self._waiting[0]) <= _PIECE_BYTES:
            taken.append(self._waiting.popleft())
            size += len(taken[-1])
        return b"".join(taken)

    def _put(self, taken: bytes) -> None:
        self._file.write(taken)
        self._file.flush()

    def _finish(self) -> None:
        super().close()
