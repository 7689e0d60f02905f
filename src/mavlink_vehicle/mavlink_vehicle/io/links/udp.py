"""UDP links: `udpin` listens and answers each sender, `udpout` sends to one address."""

from __future__ import annotations

import socket

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links.link import (
    MAX_BYTES,
    MAX_READS,
    ONLY_PEER,
    READ_SIZE,
    Peer,
    Report,
    UrlLink,
)
from mavlink_vehicle.io.links.url import LinkKind, LinkUrl, resolve

PEER_EXPIRY_S = 30.0
"""A peer of a `udpin` that is silent for longer is forgotten (an autopilot beats at 1 Hz)."""

PEER_QUIET_S = 5.0
"""When there are too many peers, one that is silent for this long gives way to a new one."""

MAX_PEERS = 128
"""Enough for a fleet on one port; of more, those that have been silent longest are forgotten."""

_EXPIRY_CHECK_S = 1.0
_BUFFER_SIZE = 1 << 20


class UdpLink(UrlLink):
    """One UDP socket."""

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Open it.

        Raises:
            LinkError: the port is taken, or the host is not known.
        """
        super().__init__(url, report, warn)
        self._listens = url.kind is LinkKind.UDP_IN
        self._heard_s: dict[Peer, float] = {}
        self._full = False
        self._peers: tuple[Peer, ...] = () if self._listens else ONLY_PEER
        self._now = 0.0
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
    def is_open(self) -> bool:
        """Whether the socket is there; with UDP nobody knows more."""
        return self._socket.fileno() >= 0

    @property
    def port(self) -> int:
        """The local port, of use when 0 was asked for."""
        return int(self._socket.getsockname()[1])

    @property
    def peers(self) -> tuple[Peer, ...]:
        """Those who have spoken to a `udpin` lately; the one of a `udpout`."""
        return self._peers

    def filenos(self) -> tuple[int, ...]:
        """Return the socket's file descriptor, if it is open."""
        number = self._socket.fileno()
        return (number,) if number >= 0 else ()

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return the datagrams that came; learns whom to answer."""
        datagrams: list[tuple[bytes, Peer]] = []
        room = MAX_BYTES
        sender: Peer = None
        for _ in range(MAX_READS):
            try:
                datagram = self._socket.recvfrom(READ_SIZE)
            except BlockingIOError:
                break
            except OSError:  # nobody listens at the other end (yet)
                continue
            if not self._listens:
                datagram = (datagram[0], None)
            elif datagram[1] != sender:
                if not self._learn(datagram[1]):
                    continue
                sender = datagram[1]
            datagrams.append(datagram)
            room -= len(datagram[0])
            if room <= 0:
                break
        return datagrams

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send to a peer, or to all that have spoken lately."""
        sent = False
        for address in self._peers if peer is None else (peer,):
            try:
                if address is None:
                    self._socket.send(data)
                else:
                    self._socket.sendto(data, address)
                sent = True
            except OSError:  # full, or nobody there: as good as lost on the way
                continue
        return sent

    def poll(self, now: float) -> float | None:
        """Forget who is silent. That may be late, so there is no deadline."""
        self._now = now
        if self._listens and now >= self._next_expiry_s:
            self._next_expiry_s = now + _EXPIRY_CHECK_S
            for peer in [p for p, at in self._heard_s.items() if now - at >= PEER_EXPIRY_S]:
                self._forget(peer)
        return None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _learn(self, address: tuple[str, int]) -> bool:
        """Note that a peer has spoken; False if there is no room for one more."""
        if address in self._heard_s:
            self._heard_s[address] = self._now
            return True
        if len(self._heard_s) >= MAX_PEERS and not self._make_room():
            if not self._full:
                self._warn(f"{self._url}: {address[0]}:{address[1]} rejected: too many peers.")
            self._full = True
            return False
        self._full = False
        self._heard_s[address] = self._now
        self._peers = tuple(self._heard_s)
        self._report(f"{self._url}: {address[0]}:{address[1]} speaks.")
        return True

    def _make_room(self) -> bool:
        """Forget the quietest peer, unless it has just spoken: newcomers push nobody out."""
        quietest = min(self._heard_s, key=self._heard_s.__getitem__)
        if self._now - self._heard_s[quietest] < PEER_QUIET_S:
            return False
        self._forget(quietest)
        return True

    def _forget(self, peer: Peer) -> None:
        del self._heard_s[peer]
        self._peers = tuple(self._heard_s)
