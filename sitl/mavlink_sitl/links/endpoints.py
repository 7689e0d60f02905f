"""Sockets that carry MAVLink: UDP and TCP, listening and connecting; loopback by default."""

from __future__ import annotations

import os
import selectors
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

from mavlink_sitl.links.addresses import LinkAddress
from mavlink_sitl.mavlink.codec import Decoder

DATAGRAM = 65536
PEER_EXPIRY_S = 10.0
MOST_PEERS = 32
"""The first senders are answered; a flood of others must not fill the memory"""
Receive = Callable[[bytes, str], None]
"""Takes a datagram, or a frame of a stream, and the address that it came from"""


class LinkError(OSError):
    """A socket that cannot be opened; the message says which and why."""


class OpenLink(ABC):
    """One open link.

    Args:
        address: where to.
        receive: called with each datagram, or with each frame of a stream.

    Raises:
        LinkError: it cannot be opened.
    """

    kind: ClassVar[socket.SocketKind]
    _listener: socket.socket | None = None

    def __init__(self, address: LinkAddress, receive: Receive) -> None:
        self._address = address
        self._receive = receive
        family, place = _resolve(address, self.kind)
        try:
            self._open(family, place)
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno else str(error)
            raise LinkError(f"cannot open {address}: {reason}") from error

    @abstractmethod
    def _open(self, family: int, place: tuple[str, int]) -> None:
        """Open it; where others come to, it is the listener."""

    def describe(self) -> str:
        """The address, with the port that was really opened."""
        if self._listener is None:
            return str(self._address)
        port = self._listener.getsockname()[1]
        return str(LinkAddress(self._address.kind, self._address.host, port))

    @abstractmethod
    def register(self, selector: selectors.BaseSelector) -> None:
        """Have `ready` called when something arrives; the key's data is that function."""

    @abstractmethod
    def send(self, frame: bytes) -> None:
        """Send a frame to whoever is there."""

    @abstractmethod
    def close(self) -> None:
        """Close all sockets."""


class UdpEndpoint(OpenLink):
    """A UDP socket: sends to a fixed peer (udpout) or to those heard lately (udpin)."""

    kind = socket.SOCK_DGRAM

    def _open(self, family: int, place: tuple[str, int]) -> None:
        self._peers: dict[tuple[str, int], float] = {}
        self._socket = socket.socket(family, self.kind)
        self._socket.setblocking(False)
        try:
            if self._address.listens:
                self._socket.bind(place)
                self._listener = self._socket
            else:
                self._socket.connect(place)
        except OSError:
            self._socket.close()
            raise

    def register(self, selector: selectors.BaseSelector) -> None:
        """See OpenLink."""
        selector.register(self._socket, selectors.EVENT_READ, self._ready)

    def _ready(self) -> None:
        while True:
            try:
                data, peer = self._socket.recvfrom(DATAGRAM)
            except ConnectionRefusedError:
                continue  # the echo of an earlier datagram: nobody listens there yet
            except OSError:
                return  # nothing more to read
            if self._address.listens and not self._remember(peer):
                continue
            self._receive(data, _shown(peer))

    def _remember(self, peer: tuple[str, int]) -> bool:
        now_s = time.monotonic()
        if peer not in self._peers and len(self._peers) >= MOST_PEERS:
            self._peers = {p: t for p, t in self._peers.items() if now_s - t <= PEER_EXPIRY_S}
            if len(self._peers) >= MOST_PEERS:
                return False
        self._peers[peer] = now_s
        return True

    def send(self, frame: bytes) -> None:
        """See OpenLink."""
        try:
            if not self._address.listens:
                self._socket.send(frame)
                return
            for peer, heard_s in list(self._peers.items()):
                if time.monotonic() - heard_s > PEER_EXPIRY_S:
                    del self._peers[peer]
                else:
                    self._socket.sendto(frame, peer)
        except OSError:
            return  # nobody there, or a full buffer: datagrams may be lost

    def close(self) -> None:
        """See OpenLink."""
        self._socket.close()


class TcpEndpoint(OpenLink):
    """TCP: a listener with any number of clients (tcpin), or one connection (tcpout)."""

    kind = socket.SOCK_STREAM
    _selector: selectors.BaseSelector | None = None

    def _open(self, family: int, place: tuple[str, int]) -> None:
        self._clients: dict[socket.socket, Decoder] = {}
        if self._address.listens:
            self._listener = socket.create_server(place, family=family)
            self._listener.setblocking(False)
        else:
            self._add(socket.create_connection((self._address.host, self._address.port), 5.0))

    def _add(self, client: socket.socket) -> None:
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = Decoder()
        if self._selector is not None:
            self._register_client(client)

    def register(self, selector: selectors.BaseSelector) -> None:
        """See OpenLink."""
        self._selector = selector
        if self._listener is not None:
            selector.register(self._listener, selectors.EVENT_READ, self._accept)
        for client in self._clients:
            self._register_client(client)

    def _register_client(self, client: socket.socket) -> None:
        assert self._selector is not None
        self._selector.register(client, selectors.EVENT_READ, lambda: self._ready(client))

    def _accept(self) -> None:
        assert self._listener is not None
        try:
            client, _ = self._listener.accept()
        except OSError:
            return  # gone before we came to the door
        self._add(client)

    def _ready(self, client: socket.socket) -> None:
        if client not in self._clients:
            return  # dropped by what was sent since it was found to be readable
        try:
            data = client.recv(DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        try:
            peer = _shown(client.getpeername())
        except OSError:
            peer = "a client that has gone"
        for message in self._clients[client].feed(data):
            self._receive(bytes(message.get_msgbuf()), peer)

    def _drop(self, client: socket.socket) -> None:
        del self._clients[client]
        if self._selector is not None:
            self._selector.unregister(client)
        client.close()

    def send(self, frame: bytes) -> None:
        """See OpenLink; a client that does not read is dropped."""
        for client in list(self._clients):
            try:
                sent = client.send(frame)
            except OSError:
                sent = 0
            if sent != len(frame):
                self._drop(client)

    def close(self) -> None:
        """See OpenLink."""
        for client in list(self._clients):
            client.close()
        self._clients.clear()
        if self._listener is not None:
            self._listener.close()


def _shown(peer: tuple[str, int]) -> str:
    return f"{peer[0]}:{peer[1]}"


def _resolve(address: LinkAddress, kind: int) -> tuple[int, tuple[str, int]]:
    try:
        found = socket.getaddrinfo(address.host, address.port, type=kind)[0]
    except socket.gaierror as error:
        raise LinkError(f"cannot open {address}: {error.strerror}") from error
    return found[0], (str(found[4][0]), int(found[4][1]))


def open_endpoint(address: LinkAddress, receive: Receive) -> OpenLink:
    """Open a link.

    Raises:
        LinkError: it cannot be opened.
    """
    if address.kind.startswith("udp"):
        return UdpEndpoint(address, receive)
    return TcpEndpoint(address, receive)
