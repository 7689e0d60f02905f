"""ROS time and wall clocks that are set change stamps only: servers keep their vehicles apart."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator, Sequence

import pytest
import rclpy
from builtin_interfaces.msg import Time
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from custom_interfaces.msg import TrafficState
from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import Process, patient_s
from tests.support.ros import stepped_clock
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, new_domain

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_fleet")]

SIM_TIME = ("-p", "use_sim_time:=true")


class TwoServers:
    """Servers `/a` and `/b` with a copter each, 12 m apart.

    Attributes:
        servers: their processes, by name.
    """

    def __init__(self) -> None:
        self.servers: dict[str, Process] = {}
        self.domain = new_domain()
        self._environment = ros_environment(self.domain)
        self._processes: list[Process] = []

    def start(self, ros_arguments: Sequence[str] = (), launcher: str = "-m") -> None:
        """Start all.

        Args:
            ros_arguments: of both servers.
            launcher: what of Python runs their module.
        """
        for name, longitude in (("a", 149.165230), ("b", 149.165362)):
            port = free_udp_port()
            self._start(
                "vehicle", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}", "--quiet",
                "--ready-after", "0.5", "--home", f"-35.363261,{longitude},584,0",
            )  # fmt: skip
            self.servers[name] = self._start(
                f"server of {name}", launcher, "drone_navigation.navigation_server", "--arming",
                "auto", "--link", f"udpin://127.0.0.1:{port}", "--ros-args", "-r",
                f"__ns:=/{name}", *ros_arguments,
            )  # fmt: skip
            self.servers[name].wait_for("Position valid", READY_TIMEOUT_S)

    def _start(self, title: str, *arguments: str) -> Process:
        process = Process(title, ["python", *arguments], self._environment)
        self._processes.append(process)
        return process

    def fly(self, name: str, east_m: float) -> Process:
        """Send a vehicle somewhere."""
        return self._start(
            f"client of {name}", "-m", "drone_navigation.navigation_client", "--json",
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
        self.stamps_s: dict[str, int] = {}
        quality = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._node.create_subscription(TrafficState, "/traffic_states", self._take, quality)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _take(self, state: TrafficState) -> None:
        self.heard[state.server] = self.heard.get(state.server, 0) + 1
        self.stamps_s[state.server] = state.stamp.sec

    def _spin(self) -> None:
        while not self._ends.is_set():
            self._executor.spin_once(timeout_sec=0.1)

    def set(self, seconds: int) -> None:
        """Set ROS time, which then stands still."""
        self._publisher.publish(Clock(clock=Time(sec=seconds)))

    def wait_for_states(self, *servers: str) -> None:
        """Wait until each server has sent some more reservations."""
        self.heard = dict.fromkeys(servers, 0)
        limit_s = time.monotonic() + patient_s(10.0)
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


@pytest.mark.night
def test_servers_without_a_ros_clock_keep_apart_also_when_it_is_set_back_and_forth(
    servers: TwoServers,
) -> None:
    servers.start(SIM_TIME)
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


@pytest.mark.night
def test_servers_whose_wall_clock_is_set_in_flight_keep_apart(
    servers: TwoServers,
) -> None:
    servers.start(launcher=stepped_clock.__file__)
    names = {name: f"/{name}/navigation_server" for name in servers.servers}
    servers.fly("a", 0.0).wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
    second = servers.fly("b", -12.0)
    second.wait_for("WAITING_FOR_TRAFFIC", FLIGHT_TIMEOUT_S)
    clock = RosClock(servers.domain)

    def step(name: str, offset_s: int) -> None:
        server = servers.servers[name]
        lines = len(server.lines)
        server.signal(signal.SIGUSR1)
        server.wait_for(f"{offset_s:+d} s off", READY_TIMEOUT_S, after=lines)
        clock.wait_for_states(*names.values())
        # It was set: the stamps show it.
        assert abs(clock.stamps_s[names[name]] - time.time() - offset_s) < 600.0

    back_s, ahead_s, right_s = stepped_clock.OFFSETS_S
    try:
        for name in ("a", "b"):
            step(name, back_s)
            step(name, ahead_s)
        assert not any('"SUCCESS"' in line for line in second.lines)
        away = servers.fly("a", -30.0)
        away.wait_for("NAVIGATING", FLIGHT_TIMEOUT_S)
        for name in ("a", "b"):
            step(name, right_s)
            step(name, back_s)
        away.wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
        second.wait_for('"SUCCESS"', FLIGHT_TIMEOUT_S)
    finally:
        clock.close()
    for name, server in servers.servers.items():
        assert server.stop() == 0, f"{name}: {server.text}"
