"""From the start of ``navigation_server`` until it is ready: the CPU time that it costs."""

from __future__ import annotations

import os
from typing import Any

import psutil

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.rows import row

STARTS = 5
GOAL_RATIO = 3.0
_READY_S = 60.0
_BARE = """
import rclpy
rclpy.init()
rclpy.create_node("bare").get_logger().info("ready")
rclpy.spin(rclpy.get_global_executor())
"""


def measures() -> list[dict[str, Any]]:
    """Measure both in turns; the least of some starts is what the machine's load added least to."""
    environment = ros_environment(free_domain(os.getpid()))
    link = f"udpin://127.0.0.1:{free_udp_port()}"
    server = ["python", "-m", "drone_navigation.navigation_server", "--link", link]
    starts = [
        (
            _cpu_s(server, "server ready", environment),
            _cpu_s(["python", "-c", _BARE], "ready", environment),
        )
        for _ in range(STARTS)
    ]
    server_s, bare_s = (min(seconds) for seconds in zip(*starts, strict=True))
    return [
        row(
            "CPU time of navigation_server until ready",
            (server_s, "s"),
            ("a bare rclpy node that logs", bare_s),
            f"< {GOAL_RATIO:g} bare nodes",
            server_s < GOAL_RATIO * bare_s,
        )
    ]


def _cpu_s(command: list[str], said: str, environment: dict[str, str]) -> float:
    process = Process(command[-1], command, environment)
    try:
        process.wait_for(said, _READY_S)
        times = psutil.Process(process.pid).cpu_times()
        return float(times.user + times.system)
    finally:
        process.stop()
