"""Processor and memory of a server with one idle vehicle, beside `mavsdk_server` and pymavlink.

Each listens to a simulated PX4 copter of its own, which sends its streams unasked, all at the same
time: the load of the machine is the same for each. `mavsdk_server` has no client, so it does
nothing with what it gets. The pymavlink loop keeps the last message of each kind. Ours requests its
rates, watches the vehicle and publishes all its topics. Memory is what is resident.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.limits import READY_S
from tests.bench.references import mavsdk_server
from tests.bench.rows import NO_GOAL, row

HERE = Path(__file__).resolve().parent
WINDOW_S, SHORT_WINDOW_S = 20.0, 1.0
SETTLES_S = 5.0
"""The server requests rates and reads parameters, and freezes what it has"""
CPU_GOAL, MEMORY_GOAL_MB = 3.0, 120.0
OURS, MAVSDK, LOOP = "navigation_server", "mavsdk_server", "a pymavlink loop"


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Measure all at the same time."""
    used = measure(SHORT_WINDOW_S if short else WINDOW_S)
    name = "server with one idle vehicle"
    cores, memory_mb = used[OURS]
    for other, (other_cores, other_mb) in used.items():
        if other == OURS:
            continue
        judged = other == MAVSDK
        bound = f"<= {CPU_GOAL:g} x" if judged else NO_GOAL
        what = f"{name}, processor, beside {other}"
        yield row(what, (cores, "cores"), (other, other_cores), bound)
        bound = f"< {MEMORY_GOAL_MB:g} MB" if judged else NO_GOAL
        yield row(f"{name}, memory, beside {other}", (memory_mb, "MB"), (other, other_mb), bound)


def measure(window_s: float) -> dict[str, tuple[float, float]]:
    """Return cores and MB of each program."""
    environment = ros_environment(free_domain(os.getpid()))
    with ExitStack() as stack:

        def start(title: str, *command: str) -> Process:
            process = Process(title, list(command), environment)
            stack.callback(process.stop)
            return process

        def vehicle() -> int:
            port = free_udp_port()
            link = f"udpout://127.0.0.1:{port}"
            start("sitl", "python", "-m", "mavlink_sitl", "--autopilot", "px4", "--link", link)
            return port

        link = f"udpin://127.0.0.1:{vehicle()}"
        ours = start(OURS, "python", "-m", "drone_navigation.navigation_server", "--link", link)
        loop = start(LOOP, "python", str(HERE / "bare_listener.py"), str(vehicle()))
        measured = {OURS: ours, LOOP: loop}
        program = mavsdk_server()
        if program is not None:
            link = f"udpin://127.0.0.1:{vehicle()}"
            measured[MAVSDK] = start(MAVSDK, str(program), "-p", "0", link)
            measured[MAVSDK].wait_for("System discovered", READY_S)
        ours.wait_for("Position valid", READY_S)
        loop.wait_for("ready", READY_S)
        time.sleep(SETTLES_S)
        processes = {title: psutil.Process(process.pid) for title, process in measured.items()}
        before_s = {title: _used_s(process) for title, process in processes.items()}
        begun_s = time.monotonic()
        time.sleep(window_s)
        used_s = {title: _used_s(processes[title]) - before_s[title] for title in processes}
        spent_s = time.monotonic() - begun_s
        return {
            title: (used_s[title] / spent_s, process.memory_info().rss / 1e6)
            for title, process in processes.items()
        }


def _used_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)
