"""Common parts of lists and downloads of logs, for both protocols."""

from __future__ import annotations

from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.outbox import Outbox

__all__ = ["LogDownloader", "LogLister"]


class LogLister(Outbox):
    """Lists the autopilot's logs.

    Attributes:
        logs: the complete list by `StoredLog.log_id`; None before.
        problem: a sentence if it was given up; empty otherwise.
    """

    def __init__(self) -> None:
        """Begin without a list."""
        super().__init__()
        self.logs: dict[int, StoredLog] | None = None
        self.problem = ""


class LogDownloader(Outbox):
    """Downloads one log, or the remainder of one, and gives its bytes out in order.

    Attributes:
        problem: a sentence if it was given up; empty otherwise.
        done: whether all bytes were given out.
    """

    def __init__(self, log: StoredLog, offset_bytes: int) -> None:
        """Begin without any bytes.

        Args:
            log: as it was listed.
            offset_bytes: where to begin, 0 to the log's size.
        """
        super().__init__()
        self.problem = ""
        self.done = False
        self._log = log
        self._base = offset_bytes
        self._chunks: list[tuple[int, bytes]] = []
        self._round_trip_s = 0.0

    def next_chunk(self) -> tuple[int, bytes] | None:
        """Return and remove the next bytes with their offset; they follow one another."""
        return self._chunks.pop(0) if self._chunks else None

    def _give_out(self, data: bytes) -> None:
        """Give out the bytes that follow what was given out before."""
        if data:
            self._chunks.append((self._base, data))
            self._base += len(data)

    def _note_round_trip(self, took_s: float) -> None:
        """Learn from how long an answer took: slower at once, faster by and by."""
        self._round_trip_s = max(took_s, 0.8 * self._round_trip_s + 0.2 * took_s)

    def _stopped_sending(self, name: str, requests: int) -> str:
        """The problem when this many requests for a log of this name were not answered."""
        return (
            f"The autopilot stopped sending {name} at byte {self._base} of "
            f"{self._log.size_bytes}; {requests} requests were not answered."
        )
