"""Links as sockets, alone."""

from __future__ import annotations

import selectors
import socket

from mavlink_sitl.links.addresses import LinkAddress
from mavlink_sitl.links.endpoints import TcpEndpoint


def test_a_client_that_left_while_it_was_to_be_read_is_no_error() -> None:
    """Found by ArduPilot's own test ClearMission: a send dropped it, and then its turn came."""
    selector = selectors.DefaultSelector()
    endpoint = TcpEndpoint(LinkAddress("tcpin", "127.0.0.1", 0), lambda *_: None)
    endpoint.register(selector)
    host, port = endpoint.describe().split("//")[1].split(":")
    client = socket.create_connection((host, int(port)))
    ((listener, _),) = selector.select(5.0)
    listener.data()
    client.shutdown(socket.SHUT_RDWR)
    client.close()
    ((readable, _),) = selector.select(5.0)
    for _ in range(100):
        endpoint.send(b"x" * 65536)  # refused by the peer, at the second one or later
    assert len(selector.get_map()) == 1, "the client is dropped"
    readable.data()
    endpoint.close()
    selector.close()
