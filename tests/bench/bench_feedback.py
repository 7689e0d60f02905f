"""From a GLOBAL_POSITION_INT datagram arriving to the feedback message leaving.

Somebody subscribes to the feedback, of the server and of the bare loop: what nobody subscribes to
costs DDS nothing.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.limits import READY_S
from tests.bench.rows import row
from tests.bench.stamping_relay import Relay

HERE = Path(__file__).resolve().parent
GOAL_MS, GOAL_RATIO = 3.0, 2.5
"""The bare loop judges nothing, steers nothing and publishes to nobody."""
RATE_HZ = 50.0
FLIGHT_S, SHORT_FLIGHT_S = 25.0, 5.0
DELAYS_PER_S, SHORT_DELAYS_PER_S = 8.0, 0.2
"""Positions that must be followed by feedback; fewer on a machine that others keep busy"""


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure one vehicle at 50 Hz, and the bare loop beside it."""
    flight_s = SHORT_FLIGHT_S if short else FLIGHT_S
    least = flight_s * (SHORT_DELAYS_PER_S if short else DELAYS_PER_S)
    ours_ms = _percentile_ms(_flown(flight_s), least)
    bare_ms = _percentile_ms(_bare(flight_s), least)
    name = "position datagram to feedback, 99th percentile"
    value, reference = (ours_ms, "ms"), ("recv + pymavlink + rclpy publish", bare_ms)
    return [
        row(name, value, reference, f"< {GOAL_MS:g} ms"),
        row(f"{name}, beside a bare loop", value, reference, f"<= {GOAL_RATIO:g} x"),
    ]


def _percentile_ms(pair: tuple[dict[str, float], dict[str, float]], least: float) -> float:
    arrived_s, left_s = pair
    delays_ms = [1e3 * (left_s[key] - arrived_s[key]) for key in left_s if key in arrived_s]
    if len(delays_ms) < least:
        raise RuntimeError(f"Only {len(delays_ms)} positions were followed by feedback.")
    return float(np.percentile(delays_ms, 99.0))


def _simulator(port: int, environment: dict[str, str]) -> Process:
    link = f"udpout://127.0.0.1:{port}"
    return Process("mavlink_sitl", ["python", "-m", "mavlink_sitl", "--link", link], environment)


def _flown(flight_s: float) -> tuple[dict[str, float], dict[str, float]]:
    port = free_udp_port()
    relay = Relay(port)
    environment = ros_environment(free_domain(os.getpid()))
    processes: list[Process] = []
    with tempfile.TemporaryDirectory() as folder:
        stamps = Path(folder) / "feedback.json"
        environment["BENCH_FEEDBACK_FILE"] = str(stamps)
        rates = ["-p", f"feedback_rate_hz:={RATE_HZ}", "-p", f"position_rate_hz:={RATE_HZ}"]
        try:
            server = Process(
                "server",
                ["python", str(HERE / "instrumented_server.py"), "--link",
                 f"udpin://127.0.0.1:{port}", "--arming", "auto", "--ros-args", *rates],
                environment,
            )  # fmt: skip
            processes.append(server)
            processes.append(_simulator(relay.port, environment))
            server.wait_for("Position valid", READY_S)
            client = Process(
                "client",
                ["python", "-m", "drone_navigation.navigation_client", "--plain",
                 "--goal", "100", "0", "5", "--cancel-after", str(flight_s)],
                environment,
            )  # fmt: skip
            processes.append(client)
            client.wait(flight_s + READY_S)
            arrived_s = relay.finish()["positions"]
        finally:
            relay.kill()
            for process in reversed(processes):
                process.stop(15.0)
        return arrived_s, json.loads(stamps.read_text(encoding="utf-8"))


def _bare(flight_s: float) -> tuple[dict[str, float], dict[str, float]]:
    port = free_udp_port()
    relay = Relay(port)
    environment = ros_environment(free_domain(os.getpid() + 50))
    environment["PYTHONPATH"] = f"{HERE.parents[1]}:{environment.get('PYTHONPATH', '')}"
    processes: list[Process] = []
    try:
        bare = Process(
            "bare", ["python", str(HERE / "bare_feedback.py"), str(port), str(flight_s)],
            environment,
        )  # fmt: skip
        processes.append(bare)
        command = ["python", str(HERE / "bare_subscriber.py"), "1"]
        processes.append(Process("subscriber", command, environment))
        processes[-1].wait_for("ready", READY_S)
        bare.wait_for("ready", READY_S)
        processes.append(_simulator(relay.port, environment))
        bare.wait(flight_s + READY_S)
        time.sleep(0.1)
        return relay.finish()["positions"], json.loads(bare.lines[-1])
    finally:
        relay.kill()
        for process in reversed(processes):
            process.stop()
