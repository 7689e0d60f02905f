"""TCP links: `tcpout` connects and reconnects, `tcpin` serves several peers."""

from __future__ import annotations

import errno
import os
import socket

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links.link import MAX_BYTES, MAX_READS, Peer, Report, UrlLink
from mavlink_vehicle.io.links.url import LinkUrl, resolve

MAX_CLIENTS = 64
_CONNECT_TIMEOUT_S = 5.0
_CONNECT_POLL_S = 0.02
_FIRST_BACKOFF_S = 0.5
_MAX_BACKOFF_S = 5.0
_MAX_UNSENT = 1 << 16


class _Stream:
    """A connected socket; keeps the rest of a frame that the socket didn't take whole."""

    def __init__(self, sock: socket.socket, peer: Peer = None) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket = sock
        self.peer = peer
        self._unsent = b""

    def receive(self, into: list[tuple[bytes, Peer]]) -> bool:
        """Append what came; False when the peer is gone."""
        room = MAX_BYTES
        for _ in range(MAX_READS):
            try:
                data = self.socket.recv(MAX_BYTES)
            except BlockingIOError:
                return True
            except OSError:
                return False
            if not data:
                return False
            into.append((data, self.peer))
            room -= len(data)
            if room <= 0:
                break
        return True

    @property
    def has_room(self) -> bool:
        """Whether the next frame will be sent or kept."""
        return len(self._unsent) <= _MAX_UNSENT

    def send(self, data: bytes) -> bool:
        """Send, or keep for later; False when the peer is gone.

        Frames that find no room are dropped whole.
        """
        if not self.has_room:
            data = b""
        unsent = self._unsent + data
        try:
            sent = self.socket.send(unsent) if unsent else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            return False
        self._unsent = unsent[sent:]
        return True


class TcpOutLink(UrlLink):
    """Connects to a listening peer; when it goes, tries again with growing pauses."""

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Prepare; `poll` connects."""
        super().__init__(url, report, warn)
        self._connecting: socket.socket | None = None
        self._stream: _Stream | None = None
        self._next_s: float | None = None
        self._give_up_s = 0.0
        self._backoff_s = _FIRST_BACKOFF_S
        self._complained = False
        self._closed = False

    @property
    def is_open(self) -> bool:
        """Whether it is connected."""
        return self._stream is not None

    def filenos(self) -> tuple[int, ...]:
        """Return the socket's file descriptor while connected."""
        return (self._stream.socket.fileno(),) if self._stream else ()

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Return what came."""
        pieces: list[tuple[bytes, Peer]] = []
        if self._stream is not None and not self._stream.receive(pieces):
            self._lose()
        return pieces

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send; dropped while not connected."""
        if self._stream is None:
            return False
        room = self._stream.has_room
        if self._stream.send(data):
            return room
        self._lose()
        return False

    def poll(self, now: float) -> float | None:
        """Connect, or look whether the connection stands."""
        if self._closed or self._stream is not None:
            return None
        if self._connecting is not None:
            return self._check(now)
        if self._next_s is not None and now < self._next_s:
            return self._next_s
        return self._connect(now)

    def close(self) -> None:
        """Close for good."""
        self._closed = True
        if self._connecting is not None:
            self._connecting.close()
        if self._stream is not None:
            self._stream.socket.close()
        self._connecting = self._stream = None

    def _connect(self, now: float) -> float:
        try:
            family, address = resolve(self._url, socket.SOCK_STREAM)
        except LinkError:
            return self._fail(now, f"the host {self._url.host!r} is not known")
        sock = socket.socket(family, socket.SOCK_STREAM)
        sock.setblocking(False)
        code = sock.connect_ex(address)
        if code not in (0, errno.EINPROGRESS):
            sock.close()
            return self._fail(now, os.strerror(code))
        self._connecting = sock
        self._give_up_s = now + _CONNECT_TIMEOUT_S
        return now + _CONNECT_POLL_S

    def _check(self, now: float) -> float | None:
        sock = self._connecting
        if sock is None:
            return None
        code = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if code == 0:
            try:
                sock.getpeername()
            except OSError:
                if now < self._give_up_s:
                    return now + _CONNECT_POLL_S
                code = errno.ETIMEDOUT
        self._connecting = None
        if code != 0:
            sock.close()
            return self._fail(now, os.strerror(code))
        self._stream = _Stream(sock)
        self._backoff_s = _FIRST_BACKOFF_S
        self._complained = False
        self._report(f"{self._url}: connected.")
        return None

    def _fail(self, now: float, why: str) -> float:
        if not self._complained:
            self._complained = True
            self._warn(f"{self._url}: {why}; retrying.")
        self._next_s = now + self._backoff_s
        self._backoff_s = min(self._backoff_s * 2.0, _MAX_BACKOFF_S)
        return self._next_s

    def _lose(self) -> None:
        if self._stream is not None:
            self._stream.socket.close()
            self._stream = None
            self._next_s = None
            self._warn(f"{self._url}: the connection ended; retrying.")


class TcpInLink(UrlLink):
    """Listens, and serves several peers."""

    def __init__(self, url: LinkUrl, report: Report, warn: Report) -> None:
        """Listen.

        Raises:
            LinkError: the port is taken, or the host is not ours.
        """
        super().__init__(url, report, warn)
        self._clients: dict[Peer, _Stream] = {}
        self._peers: tuple[Peer, ...] = ()
        family, address = resolve(url, socket.SOCK_STREAM)
        try:
            self._listener = socket.create_server(address, family=family, backlog=MAX_CLIENTS)
        except OSError as error:
            raise LinkError(f"Cannot open {url}: {error.strerror or error}.") from error
        self._listener.setblocking(False)

    @property
    def peers(self) -> tuple[Peer, ...]:
        """Those who are connected."""
        return self._peers

    @property
    def is_open(self) -> bool:
        """Whether a peer is connected."""
        return bool(self._clients)

    @property
    def port(self) -> int:
        """The local port, of use when 0 was asked for."""
        return int(self._listener.getsockname()[1])

    def filenos(self) -> tuple[int, ...]:
        """Return the file descriptors of the listener and of all peers."""
        numbers = (self._listener.fileno(), *(c.socket.fileno() for c in self._clients.values()))
        return tuple(number for number in numbers if number >= 0)

    def receive(self) -> list[tuple[bytes, Peer]]:
        """Accept new peers and return what came from all."""
        self._accept()
        pieces: list[tuple[bytes, Peer]] = []
        for client in tuple(self._clients.values()):
            if not client.receive(pieces):
                self._drop(client)
        return pieces

    def send(self, data: bytes, peer: Peer = None) -> bool:
        """Send to a peer, or to all."""
        clients, sent = self._clients, False
        for client in tuple(clients.values()) if peer is None else (clients.get(peer),):
            if client is None:
                continue
            room = client.has_room
            if client.send(data):
                sent = sent or room
            else:
                self._drop(client)
        return sent

    def poll(self, now: float) -> float | None:
        """Nothing is ever due."""
        return None

    def close(self) -> None:
        """Close the listener and all connections."""
        self._listener.close()
        for client in self._clients.values():
            client.socket.close()
        self._clients.clear()
        self._peers = ()

    def _accept(self) -> None:
        for _ in range(MAX_CLIENTS):
            try:
                sock, address = self._listener.accept()
            except OSError:
                return
            if len(self._clients) >= MAX_CLIENTS:
                sock.close()
                self._warn(f"{self._url}: {address[0]}:{address[1]} rejected: too many peers.")
                continue
            self._clients[address] = _Stream(sock, address)
            self._peers = tuple(self._clients)
            self._report(f"{self._url}: {address[0]}:{address[1]} connected.")

    def _drop(self, client: _Stream) -> None:
        client.socket.close()
        self._clients.pop(client.peer, None)
        self._peers = tuple(self._clients)
        self._warn(f"{self._url}: a peer disconnected.")
