"""Forward datagrams from a vehicle to a server and note when each position was sent on.

A process of its own, so that it takes no time from the process under measurement. Prints
its port, and at the end of its standard input one line of JSON: {time_boot_ms: seconds of
the monotonic clock just before the datagram went out}.
"""

from __future__ import annotations

import json
import selectors
import socket
import struct
import sys
import time

_GLOBAL_POSITION_INT = 33


def main() -> None:
    """Relay between the caller's server port and whoever speaks first."""
    server = ("127.0.0.1", int(sys.argv[1]))
    front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    front.bind(("127.0.0.1", 0))
    back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    back.bind(("127.0.0.1", 0))
    print(front.getsockname()[1], flush=True)
    vehicle: tuple[str, int] | None = None
    sent_s: dict[int, float] = {}
    selector = selectors.DefaultSelector()
    for source in (front, back, sys.stdin):
        selector.register(source, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select(1.0):
            if key.fileobj is sys.stdin:
                print(json.dumps(sent_s), flush=True)
                return
            if key.fileobj is front:
                data, vehicle = front.recvfrom(65535)
                # MAVLink 2: the length is in byte 1, the message id in bytes 7 to 9; the payload
                # begins at 10 and ends before its trailing zeros.
                if data[0] == 0xFD and data[7] == _GLOBAL_POSITION_INT and not data[8]:
                    start = data[10 : 10 + min(data[1], 4)].ljust(4, b"\0")
                    sent_s[struct.unpack("<I", start)[0]] = time.monotonic()
                back.sendto(data, server)
            elif vehicle is not None:
                front.sendto(back.recv(65535), vehicle)


if __name__ == "__main__":
    main()
