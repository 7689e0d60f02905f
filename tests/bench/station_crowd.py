"""Ground stations that listen to a server: ``station_crowd.py PORT COUNT SECONDS``.

Each has a socket of its own, sends a HEARTBEAT a second and reads all that comes. Prints "ready"
when each has heard the vehicle, and at the end, as JSON, how many datagrams each has got.
"""

from __future__ import annotations

import json
import selectors
import socket
import sys
import time

from pymavlink.dialects.v20 import all as mavlink

_PERIOD_S = 1.0


def main() -> None:
    """Listen."""
    port, count, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    selector = selectors.DefaultSelector()
    received = [0] * count
    stations = []
    for number in range(count):
        station = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        station.setblocking(False)
        station.connect(("127.0.0.1", port))
        selector.register(station, selectors.EVENT_READ, number)
        sender = mavlink.MAVLink(None, srcSystem=200 - number, srcComponent=190)
        stations.append((station, sender))
    due_s, end_s = 0.0, None
    while end_s is None or time.monotonic() < end_s:
        if time.monotonic() >= due_s:
            due_s = time.monotonic() + _PERIOD_S
            for station, sender in stations:
                heartbeat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
                station.send(heartbeat.pack(sender))
        for key, _ in selector.select(0.1):
            while True:
                try:
                    key.fileobj.recv(65535)  # type: ignore[union-attr]
                except BlockingIOError:
                    break
                received[key.data] += 1
        if end_s is None and all(received):
            print("ready", flush=True)
            received = [0] * count
            end_s = time.monotonic() + seconds
    print(json.dumps(received), flush=True)


if __name__ == "__main__":
    main()
