"""CPU time of the starts of server and client.

The server's, until it is ready. The client's, with a help text, and with a goal, which a server
without a vehicle rejects.
"""

from __future__ import annotations

import os
import subprocess
from typing import Any

import psutil

from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from tests.bench.limits import READY_S
from tests.bench.rows import row

STARTS, SHORT_STARTS = 5, 1
GOAL_RATIO = 4.0
HELP_S, GOAL_SENT_S = 0.2, 0.5
_BARE = """
import rclpy
rclpy.init()
rclpy.create_node("bare").get_logger().info("ready")
rclpy.spin(rclpy.get_global_executor())
"""


def measures(short: bool = False) -> list[dict[str, Any]]:
    """Measure both in turns; the least of some starts is what the machine's load added least to."""
    environment = ros_environment(free_domain(os.getpid()))
    link = f"udpin://127.0.0.1:{free_udp_port()}"
    server = ["python", "-m", "drone_navigation.navigation_server", "--link", link]
    client = ["python", "-m", "drone_navigation.navigation_client"]
    starts = [
        (
            *_cpu_s(server, "server ready", environment, [*client, "--goal", "5", "0", "5"]),
            *_cpu_s(["python", "-c", _BARE], "ready", environment, [*client, "--help"]),
        )
        for _ in range(SHORT_STARTS if short else STARTS)
    ]
    server_s, goal_s, bare_s, help_s = (min(seconds) for seconds in zip(*starts, strict=True))
    bare = ("a bare rclpy node that logs", bare_s)
    return [
        row(
            "CPU time of navigation_server until ready",
            (server_s, "s"),
            bare,
            f"< {GOAL_RATIO:g} bare nodes",
        ),
        *(
            row(f"CPU time of navigation_client, {what}", (s, "s"), bare, f"< {most:g} s")
            for what, s, most in (
                ("goal sent and answered", goal_s, GOAL_SENT_S),
                ("help text", help_s, HELP_S),
            )
        ),
    ]


def _cpu_s(
    command: list[str], said: str, environment: dict[str, str], beside: list[str]
) -> tuple[float, float]:
    """Return what a process has cost when it has said that, and what another one costs then."""
    process = Process(command[-1], command, environment)
    try:
        process.wait_for(said, READY_S)
        times = psutil.Process(process.pid).cpu_times()
        before = os.times()
        subprocess.run(
            beside, env=environment, stdout=subprocess.DEVNULL, timeout=READY_S, check=False
        )
        after = os.times()
        other_s = after[2] + after[3] - before[2] - before[3]
        return float(times.user + times.system), other_s
    finally:
        process.stop()
