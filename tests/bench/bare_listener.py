"""A loop of pymavlink that listens to a vehicle: a reference of bench_idle.

Listens on the UDP port given, keeps the last message of each kind, and sends a HEARTBEAT a second.
"""

from __future__ import annotations

import sys
import time

from pymavlink import mavutil

_PERIOD_S = 1.0


def main() -> None:
    """Listen until it is ended."""
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{sys.argv[1]}", dialect="all")
    link.wait_heartbeat()
    print("ready", flush=True)
    due_s = time.monotonic()
    while True:
        now_s = time.monotonic()
        if now_s >= due_s:
            link.mav.heartbeat_send(18, 8, 0, 0, 4)
            due_s = now_s + _PERIOD_S
        link.recv_match(blocking=True, timeout=due_s - now_s)


if __name__ == "__main__":
    main()
