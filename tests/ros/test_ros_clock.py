"""ROS time that stands still or is set changes stamps only: servers keep their vehicles apart."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
import rclpy
from builtin_interfaces.msg import Time
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from custom_interfaces.msg import TrafficState
from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, new_domain

pytestmark = pytest.mark.xdist_group("ros_fleet")

SIM_TIME = ("--ros-args", "-p", "use_sim_time:=true")


class TwoServers:
    """Servers `/a` and `/b` with a copter each, 12 m apart, both on ROS time."""

    def __init__(self) -> None:
        self.domain = new_domain()
        self._environment = ros_environment(self.domain)
        self._processes: list[Process] = []
        for name, longitude in (("a", 149.165230), ("b", 149.165362)):
            port = free_udp_port()
            self._start(
                "vehicle", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}", "--quiet",
                "--ready-after", "0.5", "--home", f"-35.363261,{longitude},584,0",
            )  # fmt: skip
            server = self._start(
                f"server of {name}", "drone_navigation.navigation_server", "--arming", "auto",
                "--link", f"udpin://127.0.0.1:{port}", *SIM_TIME, "-r", f"__ns:=/{name}",
            )  # fmt: skip
            server.wait_for("Position valid", READY_TIMEOUT_S)

    def _start(self, title: str, module: str, *arguments: str) -> Process:
        process = Process(title, ["python", "-m", module, *arguments], self._environment)
        self._processes.append(process)
        return process

    def fly(self, name: str, east_m: float) -> Process:
        """Send a vehicle somewhere."""
        return self._start(
            f"client of {name}", "drone_navigation.navigation_client", "--json",
            "--vehicle", name, "--goal", f"{east_m:g}", "0", "5",
        )  # fmt: skip

    def close(self) -> None:
        """Stop everything."""
        for process in reversed(self._processes):
            process.stop(2.0)


class RosClock:
    """Publishes ROS time, and counts the reservations that the servers send."""

    def __init__(self, domain: int) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node("clock", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publisher = self._node.create_publisher(Clock, "/clock", 10)
        self.heard: dict[str, int] = {}
        quality = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node.create_subscription(TrafficState, "/traffic_states", self._take, quality)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _take(self, state: TrafficState) -> None:
        self.heard[state.server] = self.heard.get(state.server, 0) + 1

    def _spin(self) -> None:
        while not self._ends.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def set(self, seconds: int) -> None:
        """Set ROS time, which then stands still."""
        self._publisher.publish(Clock(clock=Time(sec=seconds)))

    def wait_for_states(self, *servers: str) -> None:
        """Wait until each server has sent some more reservations."""
        self.heard = dict.fromkeys(servers, 0)
        limit_s = time.monotonic() + 10.0
        while min(self.heard.values()) < 5:
            assert time.monotonic() < limit_s, self.heard
            self._ends.wait(0.05)

    def close(self) -> None:
        self._ends.set()
        self._thread.join()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)


@pytest.fixture
def servers() -> Iterator[TwoServers]:
    two = TwoServers()
    yield two
    two.close()


def test_servers_without_a_ros_clock_keep_apart_also_when_it_is_set_back_and_forth(
    servers: TwoServers,
) -> None:
    servers.fly("a", 0.0).wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
    second = servers.fly("b", -12.0)
    second.wait_for("WAITING_FOR_TRAFFIC", FLIGHT_TIMEOUT_S)
    clock = RosClock(servers.domain)
    try:
        for seconds in (100_000, 100_000 - 3600, 100_000 + 86_400):
            clock.set(seconds)
            clock.wait_for_states("/a/navigation_server", "/b/navigation_server")
    finally:
        clock.close()
    assert not any('"SUCCESS"' in line for line in second.lines)
    servers.fly("a", -30.0).wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
    second.wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
