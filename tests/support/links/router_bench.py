"""Vehicles and ground stations on real sockets around a router; every wait has a limit."""

from __future__ import annotations

import itertools
import select
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.io.tlog import TlogWriter
from tests.support.processes import patient_s

LIMIT_S = patient_s(10.0)
LOOPBACK = "127.0.0.1"
_marks = itertools.count(0xABCD)


class Party:
    """A vehicle or a ground station: a UDP socket with a codec."""

    def __init__(self, system: int, component: int = 1, port: int | None = None) -> None:
        """Speak to `port`, or to whoever speaks first."""
        self.codec = Codec(system, component)
        self.heard: list[Message] = []
        self.raw: list[bytes] = []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((LOOPBACK, 0))
        self.socket.setblocking(False)
        self.address = None if port is None else (LOOPBACK, port)

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.socket.getsockname()[1])

    def say(self, name: str, **fields: object) -> bytes:
        """Send a message; returns the frame."""
        frame = self.codec.encode(make(name, **fields))
        self.send(frame)
        return frame

    def send(self, data: bytes) -> None:
        """Send bytes."""
        assert self.address is not None
        self.socket.sendto(data, self.address)

    def beat(self) -> None:
        """Say who it is: an autopilot, or a ground station."""
        station = self.codec._source[1] == 190
        self.say(
            "HEARTBEAT",
            type=mavlink.MAV_TYPE_GCS if station else mavlink.MAV_TYPE_QUADROTOR,
            autopilot=mavlink.MAV_AUTOPILOT_INVALID if station else mavlink.MAV_AUTOPILOT_PX4,
        )

    def listen(self) -> None:
        """Take what has come."""
        while True:
            try:
                data, self.address = self.socket.recvfrom(65536)
            except BlockingIOError:
                return
            self.raw.append(data)
            self.heard += self.codec.decode(data)

    def has(self, *frames: bytes) -> bool:
        """Return whether frames have come, byte for byte."""
        self.listen()
        return set(frames) <= set(self.raw)

    def names(self) -> list[str]:
        """Return what it has heard."""
        self.listen()
        return [message.get_type() for message in self.heard]


class Server:
    """A router with a vehicle port and a ground station port, and what its application gets."""

    def __init__(
        self,
        stations: tuple[str, ...] = (),
        recorder: TlogWriter | None = None,
        vehicles: int = 1,
    ) -> None:
        """Open the links; the first station link is a `udpin` on any port."""
        self.vehicles = open_link(f"udpin://{LOOPBACK}:0")
        self.ground = open_link(f"udpin://{LOOPBACK}:0")
        others = [open_link(url) for url in stations]
        self.router = Router(
            [self.vehicles], lambda: Codec(1, 191), [self.ground, *others], recorder, vehicles
        )
        self.received: list[Any] = []
        self.overheard: list[Any] = []

    def turn(self, at_s: float | None = None) -> None:
        """Do what a driver does in a turn, at a time, or as the clock says."""
        self.router.poll(at_s or time.monotonic())
        select.select(self.router.filenos(), [], [], 0.002)
        now = at_s or time.monotonic()
        self.received += self.router.receive(now)
        self.overheard += self.router.overhear(now)

    def send(self, name: str, source: tuple[int, int] = (1, 191), **fields: object) -> None:
        """Send a message of our own."""
        self.router.send(with_source(make(name, **fields), *source))


def opened(
    closing: ExitStack, *stations: str, recorder: TlogWriter | None = None, vehicles: int = 1
) -> Server:
    """A server with these links to ground stations beside its own."""
    server = Server(stations, recorder, vehicles)
    closing.callback(server.router.close)
    return server


def vehicle(closing: ExitStack, server: Server, system: int) -> Party:
    """A vehicle that the server has heard."""
    return _party(closing, server, system, 1, server.vehicles.port)


def station(closing: ExitStack, server: Server, system: int = 255) -> Party:
    """A ground station that the server has heard."""
    return _party(closing, server, system, 190, server.ground.port)


def _party(closing: ExitStack, server: Server, system: int, component: int, port: int) -> Party:
    party = Party(system, component, port)
    closing.enter_context(party.socket)
    party.beat()
    until(server, lambda: any(_is_from(m, system) for m in [*server.received, *server.overheard]))
    return party


def _is_from(message: Message, system: int) -> bool:
    return bool(message.get_srcSystem() == system)


def until(server: Server | tuple[Server, ...], condition: Callable[[], bool]) -> None:
    """Let servers work until something holds."""
    limit_s = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < limit_s, "it did not come about in time"
        for one in server if isinstance(server, tuple) else (server,):
            one.turn()


def settle(server: Server | tuple[Server, ...], *parties: Party) -> None:
    """Let everything that is under way arrive: what each party now sends comes after it."""
    mark = next(_marks)
    for party in parties:
        party.say("SYSTEM_TIME", time_boot_ms=mark)

    def arrived() -> bool:
        servers = server if isinstance(server, tuple) else (server,)
        heard = [m for one in servers for m in [*one.received, *one.overheard]]
        marks = [m for m in heard if m.get_type() == "SYSTEM_TIME" and m.time_boot_ms == mark]
        return {m.get_srcSystem() for m in marks} >= {p.codec._source[0] for p in parties}

    until(server, arrived)


def ring_party(
    closing: ExitStack, both: tuple[Server, Server], system: int, component: int, port: int
) -> Party:
    """A party that both of two servers have heard."""
    party = Party(system, component, port)
    closing.enter_context(party.socket)
    party.beat()
    until(both, lambda: all(_heard(server, system) for server in both))
    return party


def _heard(server: Server, system: int) -> bool:
    return any(_is_from(m, system) for m in [*server.received, *server.overheard])
