"""Flies a goal with each of several vehicles and counts their feedback: ``fleet_client.py N S``.

Prints "flying M" when all N vehicles are on their way, or a time is over and M are, and S seconds
later as JSON when in that time each of them gave feedback, in seconds of the monotonic clock.
"""

from __future__ import annotations

import json
import sys
import time
from functools import partial
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.experimental import EventsExecutor

from custom_interfaces.action import Navigate
from navigation_bridge.names import ACTION_NAME

# On a machine that cannot keep up with so many, those that fly by then are measured.
_ONE_S, _EACH_MORE_S = 60.0, 2.0
# Far enough that nobody arrives, whatever the machine needs.
NORTH_M, HEIGHT_M = 400.0, 5.0


def name(number: int) -> str:
    """Return the name of the vehicle with a number from 0 on."""
    return f"v{number + 1}"


def start_limit_s(count: int) -> float:
    """Return the time in which a number of servers must be found, and again for the take-offs."""
    return _ONE_S + _EACH_MORE_S * count


def flying_limit_s(count: int) -> float:
    """Return the time after which "flying" has been printed, or something hangs."""
    return 3.0 * start_limit_s(count)


class Flights:
    """A goal for each vehicle, and what has come of it."""

    def __init__(self, count: int) -> None:
        """Make the clients."""
        self.node = rclpy.create_node("fleet_client")
        # The others ask about all entities for each message, which starves this client at 50
        # vehicles, whatever the server does.
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        self.clients = [
            ActionClient(self.node, Navigate, f"/{name(number)}/{ACTION_NAME}")
            for number in range(count)
        ]
        self.navigating = [False] * count
        self.feedbacks_s: list[list[float]] = [[] for _ in range(count)]

    def send(self, number: int) -> None:
        """Send a goal, and another one whenever it is rejected or ends."""
        goal = Navigate.Goal()
        goal.target_pose.header.frame_id = "map"
        position = goal.target_pose.pose.position
        position.y, position.z = NORTH_M, HEIGHT_M
        goal.target_pose.pose.orientation.w = 1.0
        future = self.clients[number].send_goal_async(goal, partial(self._feedback, number))
        future.add_done_callback(partial(self._answer, number))

    def _answer(self, number: int, future: Any) -> None:
        handle = future.result()
        if handle.accepted:
            # One that ends, as by a link that a busy machine has lost for a while, is sent again.
            handle.get_result_async().add_done_callback(lambda _: self.send(number))
        else:
            time.sleep(0.05)
            self.send(number)

    def _feedback(self, number: int, message: Any) -> None:
        self.feedbacks_s[number].append(time.monotonic())
        self.navigating[number] |= message.feedback.current_status == "NAVIGATING"

    def spin_until(self, deadline_s: float) -> None:
        """Take what comes until a time, or until all are on their way."""
        while time.monotonic() < deadline_s:
            self.executor.spin_once(timeout_sec=0.1)


def main() -> None:
    """Fly."""
    count, window_s = int(sys.argv[1]), float(sys.argv[2])
    rclpy.init()
    flights = Flights(count)
    for client in flights.clients:
        if not client.wait_for_server(timeout_sec=start_limit_s(count)):
            sys.exit("A vehicle's action server is missing.")
    print("ready", flush=True)
    for number in range(count):
        flights.send(number)
    limit_s = time.monotonic() + start_limit_s(count)
    while not all(flights.navigating) and time.monotonic() < limit_s:
        flights.executor.spin_once(timeout_sec=0.1)
    print("flying", sum(flights.navigating), flush=True)
    for times_s in flights.feedbacks_s:
        times_s.clear()
    flights.spin_until(time.monotonic() + window_s)
    print(json.dumps(flights.feedbacks_s), flush=True)


if __name__ == "__main__":
    main()
