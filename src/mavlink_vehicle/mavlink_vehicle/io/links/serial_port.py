"""A serial port, by pyserial; reopened after it was unplugged."""

from __future__ import annotations

import contextlib
import os
from typing import Any

import serial

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links.link import Peer, Report, UrlLink
from mavlink_vehicle.io.links.url import LinkUrl

_REOPEN_S = 1.0
_READ_SIZE = 4096
_READS = 16
_MAX_UNSENT = 4096


class SerialLink(UrlLink):
    """One serial device, opened for us alone."""

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Prepare; `poll` opens the device.

        Raises:
            LinkError: the baud rate is impossible.
        """
        super().__init__(url, report, warn)
        self._next_s: float | None = None
        self._complained = False
        self._closed = False
        self._open = False
        self._unsent = b""
        try:
            # Without a port it isn't opened yet. No timeouts: never wait.
            self._port: Any = serial.Serial(
                baudrate=url.baud, timeout=0, write_timeout=0, exclusive=True
            )
        except ValueError as error:
            raise LinkError(f"Cannot open {url}: {error}.") from error
        self._port.port = url.path

    @property
    def is_open(self) -> bool:
        """Whether the device is open."""
        return self._open

    def filenos(self) -> tuple[int, ...]:
        """Return the device's file descriptor while it is open."""
        return (int(self._port.fileno()),) if self._open else ()

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return what came."""
        pieces: list[tuple[bytes, Peer]] = []
        if not self._open:
            return pieces
        try:
            for _ in range(_READS):
                data = self._port.read(_READ_SIZE)
                if not data:
                    break
                pieces.append((data, None))
        except (OSError, serial.SerialException) as error:
            self._lose(error)
        return pieces

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send; dropped while the device is closed or its buffer is full."""
        if not self._open:
            return False
        room = len(self._unsent) <= _MAX_UNSENT
        if not room:
            data = b""  # it is stuck; drop whole frames
        self._unsent += data
        try:
            # Not by pyserial, which waits for room even when its timeout is 0.
            sent = os.write(self._port.fileno(), self._unsent) if self._unsent else 0
        except BlockingIOError:
            return room
        except OSError as error:
            self._lose(error)
            return False
        self._unsent = self._unsent[sent:]
        return room

    def poll(self, now: float) -> float | None:
        """Open the device if it isn't."""
        if self._open or self._closed:
            return None
        if self._next_s is not None and now < self._next_s:
            return self._next_s
        try:
            self._port.open()
        except (OSError, ValueError, serial.SerialException) as error:
            if not self._complained:
                self._complained = True
                self._warn(f"{self._url}: {_why(error)}; retrying.")
            self._next_s = now + _REOPEN_S
            return self._next_s
        self._open = True
        self._unsent = b""
        self._complained = False
        self._report(f"{self._url}: open.")
        return None

    def close(self) -> None:
        """Close for good."""
        self._closed = True
        self._open = False
        self._port.close()

    def _lose(self, error: Exception) -> None:
        self._open = False
        self._next_s = None
        with contextlib.suppress(OSError, serial.SerialException):  # it's gone anyway
            self._port.close()
        self._warn(f"{self._url}: {_why(error)}; retrying.")


def _why(error: Exception) -> str:
    """Return what pyserial's exceptions mean."""
    text = str(error)
    if "Permission denied" in text or "Errno 13" in text:
        return "no permission (is the user in the group dialout?)"
    if "No such file" in text or "Errno 2]" in text:
        return "no such device"
    if "lock" in text:
        return "another program uses it"
    if "returned no data" in text or "Input/output error" in text or "Errno 5]" in text:
        return "the device is gone (cable, power)"
    return text
