"""The common base of all links."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeAlias

from mavlink_vehicle.io.links.url import LinkUrl

MAX_READS = 64
"""Reads per `receive`, so that a flood on one link doesn't keep the driver from its timers."""

MAX_BYTES = 1 << 15
"""The same in bytes: a datagram of 64 kB can hold thousands of messages."""

READ_SIZE = 1 << 16

Peer: TypeAlias = tuple[str, int] | None
"""The remote end of a link: an address, or None where there can be only one."""

Report = Callable[[str], None]
"""Takes a sentence about the link: opened, lost, who connected."""


class Link(Protocol):
    """A way to send and receive bytes. Never blocks; used by one thread.

    A link that breaks (cable out, peer gone) doesn't raise: it reports a sentence, and `poll`
    opens it again.
    """

    @property
    def description(self) -> str:
        """The link's URL, as text."""

    @property
    def note(self) -> str | None:
        """A note on where it listens; None for a link that does not listen."""

    @property
    def peers(self) -> tuple[Peer, ...]:
        """The present peers; a new tuple when they have changed, else the same."""

    @property
    def is_open(self) -> bool:
        """Whether bytes can pass now."""

    def filenos(self) -> tuple[int, ...]:
        """Return the file descriptors that become readable when something came.

        They may change after `poll` and `receive`.
        """

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return what has come, datagrams or pieces of a stream, and from whom."""

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send to one peer, or to all of them; False if none could be sent to.

        A frame that can't be sent now is dropped, as MAVLink repeats what matters.
        """

    def poll(self, now: float) -> float | None:
        """Do what is due (open again, replay); return when to be called again, or None."""

    def close(self) -> None:
        """Close for good."""


ONLY_PEER: tuple[Peer, ...] = (None,)
"""The peers of a link that has one."""


def no_report(_: str) -> None:
    """Drop a link's report."""


class UrlLink:
    """The parts that all links share; of those that don't say otherwise, one peer."""

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Keep the URL and the callbacks that get reports and warnings."""
        self._url = url
        self._report = report
        self._warn = warn

    @property
    def description(self) -> str:
        """The link's URL."""
        return str(self._url)

    @property
    def note(self) -> str | None:
        """A note on where it listens; None for a link that does not listen."""
        return self._url.note

    @property
    def peers(self) -> tuple[Peer, ...]:
        """There is one."""
        return ONLY_PEER
