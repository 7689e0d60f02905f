"""Sockets and the wall clock around a simulation.

One thread: it lets simulated time catch up with the wall clock times the speed-up, hands on
what the vehicle says, and sleeps until the next tick or the next packet.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import time
from collections.abc import Callable
from typing import Protocol

from mavlink_sitl.addresses import LinkAddress
from mavlink_sitl.mavlink.codec import Decoder
from mavlink_sitl.simulation import TICK_US, Simulation

DATAGRAM = 65536
PEER_EXPIRY_S = 10.0
BURST_S = 0.02
"""Longest time spent on the simulation before the sockets are looked at again"""
LAG_S = 0.5
"""Further behind the wall clock than this, the rest is given up"""
SHORTEST_SLEEP_S = 0.001

Receive = Callable[[bytes], None]


class LinkError(OSError):
    """A socket that cannot be opened; the message says which and why."""


class Endpoint(Protocol):
    """One open link."""

    def describe(self) -> str:
        """The address, with the port that was really opened."""
        ...

    def register(self, selector: selectors.BaseSelector) -> None:
        """Have `ready` called when something arrives; the key's data is that function."""
        ...

    def send(self, frame: bytes) -> None:
        """Send a frame to whoever is there."""
        ...

    def close(self) -> None:
        """Close all sockets."""
        ...


class UdpEndpoint:
    """A UDP socket: sends to a fixed peer (udpout) or to those heard lately (udpin).

    Args:
        address: where to.
        receive: called with each datagram.
    """

    def __init__(self, address: LinkAddress, receive: Receive) -> None:
        """See the class."""
        self._address = address
        self._receive = receive
        self._peers: dict[tuple[str, int], float] = {}
        family, place = _resolve(address, socket.SOCK_DGRAM)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            if address.listens:
                self._socket.bind(place)
            else:
                self._socket.connect(place)
        except OSError as error:
            self._socket.close()
            raise LinkError(f"cannot open {address}: {error.strerror}") from error
        self._socket.setblocking(False)

    def describe(self) -> str:
        """The address, with the port that was really opened."""
        if not self._address.listens:
            return str(self._address)
        port = self._socket.getsockname()[1]
        return str(LinkAddress(self._address.kind, self._address.host, port))

    def register(self, selector: selectors.BaseSelector) -> None:
        """See Endpoint."""
        selector.register(self._socket, selectors.EVENT_READ, self._ready)

    def _ready(self) -> None:
        while True:
            try:
                data, peer = self._socket.recvfrom(DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue  # "connection refused": nobody listens there yet
            if self._address.listens:
                self._peers[peer] = time.monotonic()
            self._receive(data)

    def send(self, frame: bytes) -> None:
        """See Endpoint."""
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
        """See Endpoint."""
        self._socket.close()


class TcpEndpoint:
    """TCP: a listener with any number of clients (tcpin), or one connection (tcpout).

    Args:
        address: where to.
        receive: called with each frame.
    """

    def __init__(self, address: LinkAddress, receive: Receive) -> None:
        """See the class."""
        self._address = address
        self._receive = receive
        self._clients: dict[socket.socket, Decoder] = {}
        self._selector: selectors.BaseSelector | None = None
        self._listener: socket.socket | None = None
        family, place = _resolve(address, socket.SOCK_STREAM)
        try:
            if address.listens:
                self._listener = socket.create_server(place, family=family)
                self._listener.setblocking(False)
            else:
                client = socket.create_connection((address.host, address.port), timeout=5.0)
                self._add(client)
        except OSError as error:
            raise LinkError(f"cannot open {address}: {error.strerror or error}") from error

    def describe(self) -> str:
        """See Endpoint."""
        if self._listener is None:
            return str(self._address)
        port = self._listener.getsockname()[1]
        return str(LinkAddress(self._address.kind, self._address.host, port))

    def _add(self, client: socket.socket) -> None:
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = Decoder()
        if self._selector is not None:
            self._register_client(client)

    def register(self, selector: selectors.BaseSelector) -> None:
        """See Endpoint."""
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
        try:
            data = client.recv(DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(client)
            return
        for message in self._clients[client].feed(data):
            self._receive(bytes(message.get_msgbuf()))

    def _drop(self, client: socket.socket) -> None:
        del self._clients[client]
        if self._selector is not None:
            self._selector.unregister(client)
        client.close()

    def send(self, frame: bytes) -> None:
        """See Endpoint; a client that does not read is dropped."""
        for client in list(self._clients):
            try:
                sent = client.send(frame)
            except OSError:
                sent = 0
            if sent != len(frame):
                self._drop(client)

    def close(self) -> None:
        """See Endpoint."""
        for client in list(self._clients):
            client.close()
        self._clients.clear()
        if self._listener is not None:
            self._listener.close()


def _resolve(address: LinkAddress, kind: int) -> tuple[int, tuple[str, int]]:
    try:
        found = socket.getaddrinfo(address.host, address.port, type=kind)[0]
    except socket.gaierror as error:
        raise LinkError(f"cannot open {address}: {error.strerror}") from error
    return found[0], (str(found[4][0]), int(found[4][1]))


def open_endpoint(address: LinkAddress, receive: Receive) -> Endpoint:
    """Open a link.

    Raises:
        LinkError: it cannot be opened.
    """
    if address.kind.startswith("udp"):
        return UdpEndpoint(address, receive)
    return TcpEndpoint(address, receive)


class Runner:
    """Runs a simulation against the wall clock.

    Args:
        simulation: it; its first vehicle speaks on the links.
        addresses: where the vehicle speaks; it says the same on all of them.
        speedup: simulated seconds per second.
        after_each: called after each piece of simulated time, to watch it.

    Raises:
        LinkError: a link cannot be opened.
    """

    def __init__(
        self,
        simulation: Simulation,
        addresses: list[LinkAddress],
        speedup: float,
        after_each: Callable[[], None],
    ) -> None:
        """See the class."""
        self._simulation = simulation
        self._speedup = speedup
        self._after_each = after_each
        self._stop_requested = False
        self._selector = selectors.DefaultSelector()
        self._wake_in, self._wake_out = socket.socketpair()
        self._wake_in.setblocking(False)
        self._wake_out.setblocking(False)
        self._selector.register(self._wake_out, selectors.EVENT_READ, lambda: None)
        self.endpoints: list[Endpoint] = []
        try:
            for address in addresses:
                self.endpoints.append(open_endpoint(address, self._receive))
        except LinkError:
            self.close()
            raise
        for endpoint in self.endpoints:
            endpoint.register(self._selector)
        self._start_s = time.monotonic()

    def stop(self) -> None:
        """End `run` at once; may be called from a signal handler."""
        self._stop_requested = True
        with contextlib.suppress(OSError):  # a full buffer: already awake
            self._wake_in.send(b"x")

    def close(self) -> None:
        """Close all sockets."""
        for endpoint in self.endpoints:
            endpoint.close()
        self._selector.close()
        self._wake_in.close()
        self._wake_out.close()

    def _due_us(self) -> int:
        return int((time.monotonic() - self._start_s) * self._speedup * 1e6)

    def _next_tick_us(self) -> int:
        return (self._simulation.time_us // TICK_US + 1) * TICK_US

    def _receive(self, data: bytes) -> None:
        simulation = self._simulation
        simulation.run_to_us(min(self._due_us(), simulation.time_us + TICK_US))
        simulation.link.write(data)
        self._send()

    def _send(self) -> None:
        for frame in self._simulation.link.read_datagrams():
            for endpoint in self.endpoints:
                endpoint.send(frame)

    def run(self) -> None:
        """Run until `stop` is called."""
        self._start_s = time.monotonic() - self._simulation.time_s / self._speedup
        while not self._stop_requested:
            self._catch_up()
            wait_s = (self._next_tick_us() - self._due_us()) / 1e6 / self._speedup
            if wait_s > 0.0:
                wait_s = max(wait_s, SHORTEST_SLEEP_S)
            for key, _ in self._selector.select(max(wait_s, 0.0)):
                key.data()

    def _catch_up(self) -> None:
        simulation = self._simulation
        begun_s = time.monotonic()
        while self._next_tick_us() <= self._due_us() and not self._stop_requested:
            simulation.run_to_us(min(self._due_us(), simulation.time_us + 10 * TICK_US))
            self._send()
            self._after_each()
            if time.monotonic() - begun_s > BURST_S:
                break
        behind_s = (self._due_us() - simulation.time_us) / 1e6 / self._speedup
        if behind_s > LAG_S:
            self._start_s += behind_s
