"""Two servers of one action name in a domain: no goal flies two vehicles."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

import pytest

from drone_navigation.processes import free_udp_port
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_client")]

WHY = "Another server offers /navigate_to_waypoint in this ROS domain"
# A program of somebody else that offers the same action, as on the course page.
FOREIGN = """
import rclpy
from rclpy.action import ActionServer
from rclpy.node import Node
from custom_interfaces.action import Navigate

rclpy.init()
node = Node("navigation_action_server")

def execute(handle):
    print("flies", flush=True)
    handle.succeed()
    return Navigate.Result()

server = ActionServer(node, Navigate, "navigate_to_waypoint", execute)
print("offers", flush=True)
rclpy.spin(node)
"""


def client(flight: Flight) -> Process:
    words = ["python", "-m", "drone_navigation.navigation_client", "--goal", "3", "0", "3"]
    return Process("client", words, flight.environment)


def test_a_second_server_ends_says_why_and_the_first_flies_on(flight: Flight) -> None:
    words = ["python", "-m", "drone_navigation.navigation_server", "--link"]
    second = Process("second", [*words, f"udpin://127.0.0.1:{free_udp_port()}"], flight.environment)
    try:
        assert second.wait(READY_TIMEOUT_S) == 2, second.text
        assert WHY in second.text
        assert "__ns:=" in second.text
    finally:
        second.stop()
    flown = client(flight)
    assert flown.wait(FLIGHT_TIMEOUT_S) == 0, flown.text


def test_neither_client_nor_server_takes_a_goal_beside_somebody_elses_server(
    flight: Flight, tmp_path: Path
) -> None:
    script = tmp_path / "foreign.py"
    script.write_text(textwrap.dedent(FOREIGN))
    assert flight.server is not None
    heard = len(flight.server.lines)
    foreign = Process("foreign", [sys.executable, str(script)], flight.environment)
    try:
        # The client asks the server, which has had time to find the other one.
        flight.server.wait_for(f"No goals are accepted. {WHY}", READY_TIMEOUT_S, after=heard)
        refused = client(flight)
        assert refused.wait(FLIGHT_TIMEOUT_S) == 3, refused.text
        assert f"No goal was sent. {WHY}" in refused.text
        assert "flies" not in foreign.text
        sender = Process(
            "sender",
            [sys.executable, "-c", SEND],
            {**flight.environment, "PYTHONUNBUFFERED": "1"},
        )
        flight.server.wait_for(f"Goal rejected: DUPLICATE_SERVER: {WHY}", FLIGHT_TIMEOUT_S)
        sender.stop()
    finally:
        foreign.stop()


# Does as `ros2 action send_goal`: it looks for nothing but a server. It sends for some seconds,
# as it finds one server before the other.
SEND = """
import time
import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node
from custom_interfaces.action import Navigate

rclpy.init()
node = Node("sender")
client = ActionClient(node, Navigate, "navigate_to_waypoint")
client.wait_for_server(10.0)
for _ in range(20):
    answer = client.send_goal_async(Navigate.Goal())
    rclpy.spin_until_future_complete(node, answer, timeout_sec=1.0)
    time.sleep(0.25)
"""


def test_a_goal_is_taken_again_when_the_other_has_gone(flight: Flight) -> None:
    flown = client(flight)
    assert flown.wait(FLIGHT_TIMEOUT_S) == 0, flown.text
