"""Other links are found on which MAVLink comes, when nothing is heard on the configured one."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from drone_navigation.check.other_links import links_with_mavlink, serial_devices
from drone_navigation.processes import free_udp_port
from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.io.links import parse_url

SILENT = parse_url("udpin://127.0.0.1:0")
HEARTBEAT = Codec(1, 1).encode(make("HEARTBEAT", type=2, autopilot=3))


@pytest.fixture
def sent() -> Iterator[int]:
    """A port to which a vehicle sends."""
    port, ended = free_udp_port(), threading.Event()
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send() -> None:
        while not ended.wait(0.1):
            out.sendto(HEARTBEAT, ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    yield port
    ended.set()
    thread.join()
    out.close()


def test_mavlink_on_another_udp_port_is_found(sent: int) -> None:
    found = links_with_mavlink(SILENT, (sent, free_udp_port()), ())
    assert found == [f"udpin://127.0.0.1:{sent}"]


def test_a_tcp_port_that_speaks_mavlink_is_found_and_told_nothing() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        heard: list[bytes] = []

        def serve() -> None:
            peer, _ = server.accept()
            with peer:
                peer.sendall(HEARTBEAT)
                heard.append(peer.recv(100))

        thread = threading.Thread(target=serve)
        thread.start()
        assert links_with_mavlink(SILENT, (), (port,)) == [f"tcp://127.0.0.1:{port}"]
        thread.join()
        assert heard == [b""]


def test_what_is_silent_in_use_or_no_mavlink_is_not_found() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        ports = (taken.getsockname()[1], free_udp_port())
        assert links_with_mavlink(SILENT, ports, (1,)) == []


def test_serial_devices_are_listed_with_what_they_are() -> None:
    assert all(device.startswith(("/dev/", "COM")) for device in serial_devices())
