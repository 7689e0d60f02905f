"""What all links have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

MAX_READS = 64
"""Reads per `receive`, so that a flood on one link doesn't keep the driver from its timers."""

MAX_BYTES = 1 << 15
"""The same in bytes: a datagram of 64 kB can hold thousands of messages."""

READ_SIZE = 1 << 16

Report = Callable[[str], None]
"""Takes a sentence about the link: opened, lost, who connected."""


class Link(Protocol):
    """A way to send and receive bytes. Never blocks; used by one thread.

    A link that breaks (cable out, peer gone) doesn't raise: it reports a sentence, and `poll`
    opens it again.
    """

    @property
    def description(self) -> str:
        """The link's URL, for people."""

    @property
    def note(self) -> str | None:
        """A warning for people, for example that it listens beyond this machine."""

    @property
    def is_open(self) -> bool:
        """Whether bytes can pass now."""

    def fileno(self) -> int:
        """Return a file descriptor that becomes readable when something came; -1 for none."""

    def filenos(self) -> tuple[int, ...]:
        """Return all such file descriptors; they may change after `poll` and `receive`."""

    def receive(self) -> list[bytes]:
        """Return what has come: datagrams, or pieces of a stream."""

    def send(self, data: bytes) -> None:
        """Send; what can't be sent now is dropped, as MAVLink repeats what matters."""

    def poll(self, now: float) -> float | None:
        """Do what is due (open again, replay); return when to be called again, or None."""

    def close(self) -> None:
        """Close for good."""


def no_report(_: str) -> None:
    """Drop a link's report."""
