"""Cost of a server with 1 to 50 ground stations that listen to one vehicle by it.

A simulated PX4 copter sends its streams; each station speaks, and gets all of them. Processor time
is that of the server's process. A station's share of the datagrams of the one that got most shows
whether all are served.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.limits import LATE_S, READY_S
from tests.bench.rows import NO_GOAL, row

HERE = Path(__file__).resolve().parent
COUNTS, SHORT_COUNTS = (1, 5, 20, 50), (1,)
GOAL_COUNT, GOAL_CORES = 50, 0.5
SHARE_GOAL = 95.0
WINDOW_S, SHORT_WINDOW_S = 10.0, 1.0


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Measure each number of stations."""
    alone: float | None = None
    for count in SHORT_COUNTS if short else COUNTS:
        cores, share = measure(count, SHORT_WINDOW_S if short else WINDOW_S)
        alone = alone or cores
        bound = f"< {GOAL_CORES:g} cores" if count == GOAL_COUNT else NO_GOAL
        name = f"server with {count} ground stations"
        yield row(f"{name}, processor", (cores, "cores"), ("one station", alone), bound)
        received, most = (share, "%"), ("the station that got most", 100.0)
        yield row(f"{name}, received by each", received, most, f">= {SHARE_GOAL:g} %")


def measure(count: int, window_s: float) -> tuple[float, float]:
    """Return the server's cores, and the least share of datagrams that a station got, %."""
    environment = ros_environment(free_domain(os.getpid() + count))
    vehicle_port, port = free_udp_port(), free_udp_port()
    with ExitStack() as stack:

        def start(title: str, *command: str) -> Process:
            process = Process(title, ["python", *command], environment)
            stack.callback(process.stop)
            return process

        server = start(
            "server", "-m", "drone_navigation.navigation_server", "--link",
            f"udpin://127.0.0.1:{vehicle_port}", "--ros-args", "-p",
            f'gcs_links:=["udpin://127.0.0.1:{port}"]',
        )  # fmt: skip
        start(
            "sitl", "-m", "mavlink_sitl", "--autopilot", "px4", "--quiet", "--link",
            f"udpout://127.0.0.1:{vehicle_port}",
        )  # fmt: skip
        server.wait_for("Position valid", READY_S)
        crowd = start("crowd", str(HERE / "station_crowd.py"), str(port), str(count), str(window_s))
        process = psutil.Process(server.pid)
        crowd.wait_for("ready", READY_S)
        before_s = sum(process.cpu_times()[:2])
        received = json.loads(crowd.wait_for("[", window_s + LATE_S))
        used_s = sum(process.cpu_times()[:2]) - before_s
        return used_s / window_s, 100.0 * min(received) / max(received)
