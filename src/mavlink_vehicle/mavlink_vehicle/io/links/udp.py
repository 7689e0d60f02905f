"""UDP: `udpin` listens and answers whoever speaks, `udpout` speaks to one address."""

from __future__ import annotations

import socket
import time

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links.link import MAX_BYTES, MAX_READS, READ_SIZE, Report, no_report
from mavlink_vehicle.io.links.url import LinkKind, LinkUrl, resolve

PEER_EXPIRY_S = 30.0
"""A peer of a `udpin` that is silent for longer is forgotten (an autopilot beats at 1 Hz)."""

MAX_PEERS = 32
_EXPIRY_CHECK_S = 1.0
_BUFFER_SIZE = 1 << 20


class UdpLink:
    """One UDP socket."""

    def __init__(self, url: LinkUrl, report: Report = no_report) -> None:
        """Open it.

        Raises:
            LinkError: the port is taken, or the host is not known.
        """
        self._url = url
        self._report = report
        self._listens = url.kind is LinkKind.UDP_IN
        self._peers: dict[tuple[str, int], float] = {}
        self._next_expiry_s = 0.0
        family, address = resolve(url, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_SIZE)
            if self._listens:
                self._socket.bind(address)
            else:
                self._socket.connect(address)
        except OSError as error:
            self._socket.close()
            raise LinkError(f"Cannot open {url}: {error.strerror or error}.") from error

    @property
    def description(self) -> str:
        """The link's URL."""
        return str(self._url)

    @property
    def note(self) -> str | None:
        """A warning when it listens beyond this machine."""
        return self._url.note

    @property
    def is_open(self) -> bool:
        """Whether the socket is there; with UDP nobody knows more."""
        return self._socket.fileno() >= 0

    @property
    def port(self) -> int:
        """The local port, of use when 0 was asked for."""
        return int(self._socket.getsockname()[1])

    @property
    def peers(self) -> tuple[tuple[str, int], ...]:
        """Those whom a `udpin` answers."""
        return tuple(self._peers)

    def fileno(self) -> int:
        """Return the socket's file descriptor."""
        return self._socket.fileno()

    def filenos(self) -> tuple[int, ...]:
        """Return the socket's file descriptor, if it is open."""
        number = self._socket.fileno()
        return (number,) if number >= 0 else ()

    def receive(self) -> list[bytes]:
        """Return the datagrams that came; learns whom to answer."""
        datagrams: list[bytes] = []
        room = MAX_BYTES
        sender: tuple[str, int] | None = None
        for _ in range(MAX_READS):
            try:
                data, address = self._socket.recvfrom(READ_SIZE)
            except BlockingIOError:
                break
            except OSError:  # nobody listens at the other end (yet)
                continue
            datagrams.append(data)
            if address != sender and self._listens:
                sender = address
                self._learn(address)
            room -= len(data)
            if room <= 0:
                break
        return datagrams

    def send(self, data: bytes) -> None:
        """Send to the peer, or to all that have spoken lately."""
        if not self._listens:
            self._send_to(data, None)
            return
        now = time.monotonic()
        if now >= self._next_expiry_s:
            self._next_expiry_s = now + _EXPIRY_CHECK_S
            self._expire(now)
        for address in self._peers:
            self._send_to(data, address)

    def poll(self, now: float) -> float | None:
        """Nothing is ever due."""
        return None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _send_to(self, data: bytes, address: tuple[str, int] | None) -> None:
        try:
            if address is None:
                self._socket.send(data)
            else:
                self._socket.sendto(data, address)
        except OSError:  # full, or nobody there: as good as lost on the way
            return

    def _learn(self, address: tuple[str, int]) -> None:
        now = time.monotonic()
        known = address in self._peers
        self._peers[address] = now
        if known:
            return
        self._expire(now)
        if len(self._peers) > MAX_PEERS:
            quietest = min(self._peers, key=self._peers.__getitem__)
            del self._peers[quietest]
        self._report(f"{self._url}: {address[0]}:{address[1]} speaks.")

    def _expire(self, now: float) -> None:
        self._peers = {a: at for a, at in self._peers.items() if now - at < PEER_EXPIRY_S}
