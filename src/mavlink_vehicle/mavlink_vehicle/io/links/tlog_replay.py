"""A recording as a link: received messages are received again, at their recorded pace."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from mavlink_vehicle.io.links.link import MAX_READS, Peer, Report, UrlLink
from mavlink_vehicle.io.links.url import LinkUrl
from mavlink_vehicle.io.tlog import TlogReader

LONGEST_SILENCE_S = 120.0
"""Longer silences of a recording are shortened to this; by then nothing changes any more"""


def _paced(records: Iterable[tuple[float, bytes]]) -> Iterator[tuple[float, bytes]]:
    """Yield packets with seconds since the first, which never go back: a clock may be set."""
    now_s, before_s = 0.0, None
    for unix_s, packet in records:
        step_s = 0.0 if before_s is None else unix_s - before_s
        before_s = unix_s
        now_s += min(max(step_s, 0.0), LONGEST_SILENCE_S)
        yield now_s, packet


class TlogLink(UrlLink):
    """Replays a tlog by the driver's clock; messages sent to it are dropped.

    Both directions of the recording come out. A vehicle's state isn't disturbed by it: what
    other systems and components said is not taken in.
    """

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Read the recording.

        Raises:
            LinkError: it can't be read.
        """
        super().__init__(url, report, warn)
        self._records = list(_paced(TlogReader(url.path)))
        self._next = 0
        self._start_s: float | None = None
        self._due = 0

    @property
    def is_open(self) -> bool:
        """Whether something is left to replay."""
        return self._next < len(self._records)

    def filenos(self) -> tuple[int, ...]:
        """There is no file descriptor to wait for; `poll` says when to look."""
        return ()

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return what is due by the last `poll`."""
        stop = min(self._due, self._next + MAX_READS)
        due = self._records[self._next : stop]
        self._next = max(self._next, stop)
        return [(packet, None) for _, packet in due]

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send nothing: a recording has no other end."""
        return False

    def poll(self, now: float) -> float | None:
        """See what is due; return when the next packet is."""
        if not self._records:
            return None
        if self._start_s is None:
            self._start_s = now
        while self._due < len(self._records) and self._records[self._due][0] <= now - self._start_s:
            self._due += 1
        if self._next < self._due:
            return now
        if self._due == len(self._records):
            return None
        return self._start_s + self._records[self._due][0]

    def close(self) -> None:
        """Stop the replay."""
        self._next = self._due = len(self._records)
