"""CPU for receiving telemetry and reducing it to the vehicle's state, per message.

Four receivers take the same datagrams from a real UDP socket: the driver with its link, codec
and vehicle, whole and in its own thread; the same with the bridge that watches the vehicle, as in
the server, which then publishes; a bare loop of `socket.recv` and pymavlink's `parse_buffer`,
which keeps nothing; and pymavlink's `mavutil.recv_match`, which keeps the last message of each
kind. They take turns, and the least of several rounds counts, because whatever disturbs a round
only adds to it. The time is the receiving thread's own CPU time. All find each batch waiting in
their socket: nobody sends while they receive.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Application, Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.fleet import FleetApplication, Member
from tests.bench.limits import LATE_S
from tests.bench.rows import row
from tests.bench.telemetry_sender import telemetry

HERE = Path(__file__).resolve().parent
ROUNDS, PACED_ROUNDS = 7, 2
BATCH = 200
FLOOD_S = 40
PACED_S, SHORT_PACED_S = 8, 1
RECEIVED_GOAL, PACED_GOAL_MS = 1.0, 20.0
_SILENCE_S = 30


class _Alone(Vehicle):
    """A vehicle that gives up its events as a bridge does."""

    def receive(self, message: Message, now: float) -> None:
        super().receive(message, now)
        while self.next_event() is not None:
            pass


class _Watching(Bridge):
    """A bridge that gives up its outputs as the server's application does."""

    def __init__(self) -> None:
        config = make_config({})
        super().__init__(Vehicle(config.vehicle), config.bridge)

    def receive(self, message: Message, now: float) -> None:
        super().receive(message, now)
        while self.next_output() is not None:
            pass

    def fail(self, error: Exception, now: float = 0.0) -> None:
        raise error

    give_up = fail


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure at volume, and at the pace of one vehicle."""
    frames = [frame for _, frame in telemetry(FLOOD_S)]
    paced_s = SHORT_PACED_S if short else PACED_S
    ours_us, watched_us, bare_us, mavutil_us = _least(
        lambda: _vehicle_us(frames),
        lambda: _bridge_us(frames),
        lambda: _bare_us(frames),
        lambda: _mavutil_us(frames),
        rounds=1 if short else ROUNDS,
    )
    paced_ms, paced_bare_ms = _least(
        lambda: _driver_paced_ms(paced_s),
        lambda: _bare_paced_ms(paced_s),
        rounds=1 if short else PACED_ROUNDS,
    )
    name = "CPU per telemetry message, received and reduced"
    return [
        *(
            row(what, (us, "us"), reference, f"<= {RECEIVED_GOAL:g} x")
            for what, us in ((name, ours_us), (f"{name}, in a fleet and watched", watched_us))
            for reference in (
                ("recv + parse_buffer", bare_us),
                ("mavutil.recv_match", mavutil_us),
            )
        ),
        row(
            "CPU of the driver with one vehicle's telemetry, per second",
            (paced_ms, "ms"),
            ("recv + parse_buffer", paced_bare_ms),
            f"< {PACED_GOAL_MS:g} ms",
        ),
    ]


def _least(*contenders: Callable[[], float], rounds: int) -> list[float]:
    results = [[contender() for contender in contenders] for _ in range(rounds)]
    return [min(column) for column in zip(*results, strict=True)]


def _vehicle_us(frames: list[bytes]) -> float:
    return _driver_us(frames, _Alone())


def _bridge_us(frames: list[bytes]) -> float:
    fleet = FleetApplication([Member("", 0, _Watching())], MonotonicClock())
    return _driver_us(frames, fleet)


def _driver_us(frames: list[bytes], application: Application) -> float:
    link = open_link("udpin://127.0.0.1:0")
    codec = Codec(1, 191)  # there is one sender
    driver = Driver(application, Router([link], lambda: codec), MonotonicClock(), _raise)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.connect(("127.0.0.1", link.port))

    def send(batch: list[bytes]) -> float:
        begin_s = time.thread_time()
        for frame in batch:
            sender.send(frame)
        return time.thread_time() - begin_s

    driver.start()
    try:
        begin_s, sending_s = driver.call(time.thread_time), 0.0
        for start in range(0, len(frames), BATCH):
            batch = frames[start : start + BATCH]
            # On the driver's own thread, which receives nothing meanwhile.
            sending_s += driver.call(partial(send, batch))
            limit_s = time.monotonic() + _SILENCE_S
            while codec.statistics.frames < start + len(batch):
                time.sleep(0.0005)
                if time.monotonic() > limit_s:
                    raise RuntimeError("Datagrams were lost on the loopback; nothing measured.")
        spent_s = driver.call(time.thread_time) - begin_s - sending_s
        return 1e6 * spent_s / len(frames)
    finally:
        driver.stop()
        sender.close()


def _raise(error: Exception) -> None:
    raise error


def _bare_us(frames: list[bytes]) -> float:
    receiver = _receiver()
    parser = mavlink.MAVLink(None)
    received = 0

    def drain(count: int) -> None:
        nonlocal received
        for _ in range(count):
            received += len(parser.parse_buffer(receiver.recv(65536)) or ())

    try:
        return _batches_us(frames, receiver.getsockname(), drain)
    finally:
        receiver.close()
        assert received == len(frames)


def _mavutil_us(frames: list[bytes]) -> float:
    port = _free_port()
    connection = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="all")

    def drain(count: int) -> None:
        while count:
            if connection.recv_match() is not None:
                count -= 1

    try:
        return _batches_us(frames, ("127.0.0.1", port), drain)
    finally:
        connection.close()


def _batches_us(
    frames: list[bytes], address: tuple[str, int], drain: Callable[[int], None]
) -> float:
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    total_s = 0.0
    with sender:
        for start in range(0, len(frames), BATCH):
            batch = frames[start : start + BATCH]
            for frame in batch:
                sender.sendto(frame, address)
            begin_s = time.thread_time()
            drain(len(batch))
            total_s += time.thread_time() - begin_s
    return 1e6 * total_s / len(frames)


def _driver_paced_ms(paced_s: int) -> float:
    link = open_link("udpin://127.0.0.1:0")
    router = Router([link], lambda: Codec(1, 191))
    driver = Driver(_Alone(), router, MonotonicClock(), _raise)
    driver.start()
    try:
        begin_s = driver.call(time.thread_time)
        _send_paced(link.port, paced_s)
        return 1e3 * (driver.call(time.thread_time) - begin_s) / paced_s
    finally:
        driver.stop()


def _bare_paced_ms(paced_s: int) -> float:
    receiver = _receiver()
    parser = mavlink.MAVLink(None)
    command = _paced_command(receiver.getsockname()[1], paced_s)
    with receiver, subprocess.Popen(command):
        begin_s = time.thread_time()
        for _ in telemetry(paced_s):
            parser.parse_buffer(receiver.recv(65536))
        return 1e3 * (time.thread_time() - begin_s) / paced_s


def _send_paced(port: int, paced_s: int) -> None:
    subprocess.run(_paced_command(port, paced_s), check=True, timeout=paced_s + LATE_S)


def _paced_command(port: int, paced_s: int) -> list[str]:
    return [sys.executable, str(HERE / "telemetry_sender.py"), str(port), str(paced_s)]


def _receiver() -> socket.socket:
    """Return a blocking socket: with a timeout of Python's, it polls before each recv.

    The system's own limit costs nothing: where a datagram was lost, recv raises BlockingIOError.
    """
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", _SILENCE_S, 0))
    receiver.bind(("127.0.0.1", 0))
    return receiver


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
