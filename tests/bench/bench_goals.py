"""A thousand goals in a row for one vehicle in flight: memory of the server, rejections, answers.

Each goal replaces the one before. The server keeps what has ended for a minute, so its memory is
compared at the end and when it has been full for a while. The reference of the answers is the first
quarter of the same goals.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import psutil
import rclpy
from rclpy.action import ActionClient

from custom_interfaces.action import Navigate
from drone_navigation.processes import Process, free_domain, free_udp_port, ros_environment
from navigation_bridge.names import ACTION_NAME
from tests.bench.limits import LATE_S, READY_S
from tests.bench.rows import NO_GOAL, row

GOALS, SHORT_GOALS = 1000, 8
PERIOD_S, SHORT_PERIOD_S = 0.2, 0.0
"""A thousand take more than three times as long as an ended goal is kept"""
GROWTH_GOAL_MB = 3.0
_PLACES_M = ((20.0, 0.0, 5.0), (-20.0, 0.0, 5.0))


def measures(short: bool = False) -> Iterator[dict[str, Any]]:
    """Send them all."""
    count, period_s = (SHORT_GOALS, SHORT_PERIOD_S) if short else (GOALS, PERIOD_S)
    memories_mb, answers_ms, rejected = send(count, period_s)
    name = "1,000 goals in a row"
    half, quarter = count // 2, count // 4
    grown_mb = memories_mb[-1] - memories_mb[half]
    yield row(
        f"{name}: growth of memory in the second half",
        (grown_mb, "MB"),
        ("resident at half", memories_mb[half]),
        f"< {GROWTH_GOAL_MB:g} MB",
    )
    first_ms, last_ms = (
        float(np.percentile(part, 50.0)) for part in (answers_ms[:quarter], answers_ms[-quarter:])
    )
    yield row(
        f"{name}: answer to a goal in the last quarter, median",
        (last_ms, "ms"),
        ("the first quarter", first_ms),
        NO_GOAL,
    )
    yield row(f"{name}: rejected", (rejected, "1"), ("goals", count), "none", rejected == 0)


def send(count: int, period_s: float) -> tuple[list[float], list[float], int]:
    """Return the server's memory at each goal (MB), the time of each answer, and rejections."""
    domain, port = free_domain(os.getpid()), free_udp_port()
    environment = ros_environment(domain)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = environment["ROS_AUTOMATIC_DISCOVERY_RANGE"]
    with ExitStack() as stack:

        def start(title: str, *command: str) -> Process:
            process = Process(title, ["python", "-m", *command], environment)
            stack.callback(process.stop)
            return process

        link = f"127.0.0.1:{port}"
        server = start(
            "server", "drone_navigation.navigation_server", "--link", f"udpin://{link}",
            "--arming", "auto", "--ros-args", "-p", "battery_policy:=ignore",
        )  # fmt: skip
        start("sitl", "mavlink_sitl", "--link", f"udpout://{link}", "--ready-after", "1", "--quiet")
        server.wait_for("Position valid", READY_S)
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        stack.callback(rclpy.try_shutdown, context=context)
        node = rclpy.create_node("bench_goals", context=context)
        stack.callback(node.destroy_node)
        client = ActionClient(node, Navigate, ACTION_NAME)
        stack.callback(client.destroy)
        if not client.wait_for_server(timeout_sec=READY_S):
            raise RuntimeError("The action server is missing.")
        executor = rclpy.executors.SingleThreadedExecutor(context=context)
        executor.add_node(node)
        process = psutil.Process(server.pid)
        memories_mb, answers_ms, rejected = [], [], 0
        for number in range(count):
            begun_s = time.monotonic()
            sent = client.send_goal_async(_goal(number))
            executor.spin_until_future_complete(sent, timeout_sec=LATE_S)
            answer = sent.result()
            if answer is None:
                raise RuntimeError(f"Goal {number} was not answered within {LATE_S:g} s.")
            answers_ms.append(1e3 * (time.monotonic() - begun_s))
            rejected += not answer.accepted
            memories_mb.append(process.memory_info().rss / 1e6)
            while time.monotonic() < begun_s + period_s:
                executor.spin_once(timeout_sec=0.01)
        print(*(line for line in server.lines if "Goal rejected" in line), sep="\n", end="")
        return memories_mb, answers_ms, rejected


def _goal(number: int) -> Navigate.Goal:
    goal = Navigate.Goal()
    goal.target_pose.header.frame_id = "map"
    position = goal.target_pose.pose.position
    position.x, position.y, position.z = _PLACES_M[number % 2]
    goal.target_pose.pose.orientation.w = 1.0
    return goal
