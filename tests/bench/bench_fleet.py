"""Cost of a server with 1 to 100 simulated vehicles that fly goals with 10 Hz of feedback.

The processor time is what the server took. Where there is less feedback than was asked for, it did
less: so the rate of feedback has a goal beside each goal of cores.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.fleet_client import flying_limit_s, name
from tests.bench.limits import LATE_S
from tests.bench.rows import NO_GOAL, row

HERE = Path(__file__).resolve().parent
COUNTS, SHORT_COUNTS = (1, 5, 20, 50, 100), (1,)
GOALS = {
    20: {
        "processor": "< 0.25 cores",
        "memory": "< 280 MB",
        "feedback": "> 9 Hz",
        "gap": "< 150 ms",
    },
    50: {
        "processor": "< 0.7 cores",
        "memory": "< 450 MB",
        "feedback": "> 9 Hz",
        "gap": "< 200 ms",
    },
}
"""None for 100, more than a server takes by default: how it fails is to be seen"""
FEEDBACK_HZ = 10.0
WINDOW_S, SHORT_WINDOW_S = 5.0, 1.0
_TICKS_S = float(os.sysconf("SC_CLK_TCK"))
_PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 1e6


@dataclass(frozen=True)
class Cost:
    """Consumption of a server process while its vehicles flew.

    Attributes:
        cores: processor time by wall time.
        memory_mb: resident memory.
        feedback_hz: on average.
        gap_ms: time between two feedbacks of a vehicle, 99th percentile of all.
    """

    cores: float
    memory_mb: float
    feedback_hz: float
    gap_ms: float


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Measure each number of vehicles."""
    one: Cost | None = None
    for count in SHORT_COUNTS if short else COUNTS:
        cost = measure(count, SHORT_WINDOW_S if short else WINDOW_S)
        one = one or cost
        alone = "one vehicle"
        for what, value, reference in (
            ("processor", (cost.cores, "cores"), (alone, one.cores)),
            ("memory", (cost.memory_mb, "MB"), (alone, one.memory_mb)),
            ("feedback", (cost.feedback_hz, "Hz"), ("asked", FEEDBACK_HZ)),
            ("gap", (cost.gap_ms, "ms"), (alone, one.gap_ms)),
        ):
            bound = GOALS.get(count, {}).get(what, NO_GOAL)
            yield row(f"server with {count} vehicles in flight, {what}", value, reference, bound)


def set_up(count: int, port: int) -> str:
    """Return a parameter file for a number of vehicles on one port."""
    names = [name(number) for number in range(count)]
    lines = [
        "navigation_server:",
        "  ros__parameters:",
        f"    vehicles: [{', '.join(names)}]",
        f"    vehicles_max: {count}",
        f'    link_url: "udpin://127.0.0.1:{port}"',
        "    arming: auto",
        "    takeoff_height_m: 1.5",
    ]
    for number, vehicle in enumerate(names):
        lines += [
            f"/{vehicle}/navigation_server:",
            f"  ros__parameters: {{target_system: {number + 1}}}",
        ]
    return "\n".join(lines) + "\n"


def measure(count: int, window_s: float) -> Cost:
    """Fly a number of vehicles and return what their server needs, in a window of that length."""
    port = free_udp_port()
    environment = ros_environment(free_domain(os.getpid() + count))
    processes: list[Process] = []
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "fleet.yaml"
        config.write_text(set_up(count, port), encoding="utf-8")
        try:
            server = Process(
                "server",
                ["python", "-m", "drone_navigation.navigation_server", "--config", str(config)],
                environment,
            )
            processes.append(server)
            processes.append(
                Process(
                    "mavlink_sitl",
                    ["python", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}",
                     "--count", str(count), "--ready-after", "1", "--quiet"],
                    environment,
                )
            )  # fmt: skip
            client = Process(
                "client",
                ["python", str(HERE / "fleet_client.py"), str(count), str(window_s)],
                environment,
            )
            processes.append(client)
            flying = int(client.wait_for("flying", flying_limit_s(count)).split()[-1])
            if flying < count:
                print(f"Only {flying} of {count} vehicles were in flight when it began.")
            used_s = _processor_s(server.pid)
            counts = client.wait_for("[", window_s + LATE_S)
            needed_s = _processor_s(server.pid) - used_s
            memory_mb = _memory_mb(server.pid)
            times_s = json.loads(counts)
            feedback_hz = sum(map(len, times_s)) / count / window_s
            if feedback_hz == 0.0 and count <= max(GOALS):
                raise RuntimeError(f"None of {count} vehicles gave feedback.")
        finally:
            for process in reversed(processes):
                process.stop(0.1)  # nobody waits for these vehicles to stop
    return Cost(needed_s / window_s, memory_mb, feedback_hz, _gap_ms(times_s))


def _gap_ms(times_s: list[list[float]]) -> float:
    gaps_s = [later - time for of_one in times_s for time, later in pairwise(of_one)]
    return 1e3 * float(np.percentile(gaps_s, 99.0)) if gaps_s else math.inf


def _processor_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS_S


def _memory_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text("ascii").split()[1]) * _PAGE_MB
