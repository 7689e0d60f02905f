"""Forward datagrams between a vehicle and a server; note positions one way, setpoints the other.

A process of its own, so that it takes no time from the process under measurement. Prints
its port, and at the end of its standard input one line of JSON, times being seconds of the
monotonic clock: {"positions": {time_boot_ms: just before the datagram went out}, "setpoints":
[just after the datagram came in]}. `Relay` is the parent's side of it.
"""

from __future__ import annotations

import json
import selectors
import socket
import struct
import subprocess
import sys
import time
from typing import Any

_GLOBAL_POSITION_INT, _SET_POSITION_TARGET_LOCAL_NED = 33, 84


class Relay:
    """The relay as a child process."""

    def __init__(self, server_port: int) -> None:
        """Start it before a server that listens on a port of this machine."""
        self._child = subprocess.Popen(
            [sys.executable, __file__, str(server_port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._child.stdout is not None
        self.port = int(self._child.stdout.readline())

    def finish(self) -> dict[str, Any]:
        """End it and return what it has recorded."""
        output, _ = self._child.communicate("\n", timeout=10.0)
        stamps: dict[str, Any] = json.loads(output)
        return stamps

    def kill(self) -> None:
        """End it, however it goes."""
        self._child.kill()
        self._child.wait(5.0)


def main() -> None:
    """Relay between the caller's server port and whoever speaks first."""
    server = ("127.0.0.1", int(sys.argv[1]))
    front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    front.bind(("127.0.0.1", 0))
    back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    back.bind(("127.0.0.1", 0))
    print(front.getsockname()[1], flush=True)
    vehicle: tuple[str, int] | None = None
    positions_s: dict[int, float] = {}
    setpoints_s: list[float] = []
    selector = selectors.DefaultSelector()
    for source in (front, back, sys.stdin):
        selector.register(source, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select(1.0):
            if key.fileobj is sys.stdin:
                stamps = {"positions": positions_s, "setpoints": setpoints_s}
                print(json.dumps(stamps), flush=True)
                return
            if key.fileobj is front:
                data, vehicle = front.recvfrom(65535)
                # MAVLink 2: the length is in byte 1; the payload begins at 10 and ends before
                # its trailing zeros.
                if _message_id(data) == _GLOBAL_POSITION_INT:
                    start = data[10 : 10 + min(data[1], 4)].ljust(4, b"\0")
                    positions_s[struct.unpack("<I", start)[0]] = time.monotonic()
                back.sendto(data, server)
            elif vehicle is not None:
                data = back.recv(65535)
                if _message_id(data) == _SET_POSITION_TARGET_LOCAL_NED:
                    setpoints_s.append(time.monotonic())
                front.sendto(data, vehicle)


def _message_id(data: bytes) -> int:
    """Return the id of a datagram's first message, -1 if that is not MAVLink 2."""
    return int.from_bytes(data[7:10], "little") if data[:1] == b"\xfd" else -1


if __name__ == "__main__":
    main()
