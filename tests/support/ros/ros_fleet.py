"""A server with several simulated vehicles as processes, and a client with a goal for each."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
import yaml
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future

from custom_interfaces.action import Navigate
from drone_navigation.processes import free_udp_port, ros_environment
from navigation_bridge.names import ACTION_NAME
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import READY_TIMEOUT_S, GoalRecord, new_domain


@dataclass(frozen=True)
class FleetVehicle:
    """One simulated vehicle: its name, what the simulator is told, and which port it sends to."""

    name: str
    system_id: int
    options: tuple[str, ...]
    port: int


class FleetFlight:
    """Simulators and a server in a domain of their own, and a client."""

    def __init__(self, folder: Path, vehicles: tuple[FleetVehicle, ...]) -> None:
        """Start them all and wait until every vehicle has a position."""
        self.vehicles = {vehicle.name: vehicle for vehicle in vehicles}
        self.environment = ros_environment(new_domain())
        self.config = folder / "fleet.yaml"
        self._folder = folder
        self.config.write_text(yaml.safe_dump(set_up(vehicles)), encoding="utf-8")
        self._processes: list[Process] = []
        self._context: rclpy.Context | None = None
        self.simulators: dict[str, Process] = {}
        try:
            for name in self.vehicles:
                self.start_simulator(name)
            self._start_client()
            self.start_server()
        except BaseException:
            self.close()
            raise

    def start_server(self) -> None:
        """Start a server with a recording of its own; wait until every vehicle has a position."""
        self.tlog = self._folder / f"fleet-{len(self._processes)}.tlog"
        self.accepted = Counter[str]()
        self.server = self._start(
            "navigation_server", "drone_navigation.navigation_server",
            "--config", str(self.config), "--tlog", str(self.tlog),
        )  # fmt: skip
        for name in self.vehicles:
            self.wait_for_line(f"[{name}.navigation_server]: Position valid", READY_TIMEOUT_S)

    def _start(self, title: str, *module: str) -> Process:
        process = Process(title, ["python", "-m", *module], self.environment)
        self._processes.append(process)
        return process

    def start_simulator(self, name: str) -> None:
        """Start a vehicle's simulator; one that runs is killed, as by a loss of power."""
        vehicle = self.vehicles[name]
        running = self.simulators.get(name)
        if running is not None:
            running.stop(0.0)
        longitude = 149.165230 + 0.0002 * (vehicle.system_id - 1)  # 18 m apart
        self.simulators[name] = self._start(
            name, "mavlink_sitl", "--link", f"udpout://127.0.0.1:{vehicle.port}", "--system-id",
            str(vehicle.system_id), "--home", f"-35.363261,{longitude:.6f},584,353",
            "--ready-after", "1", "--quiet", *vehicle.options,
        )  # fmt: skip

    def run(self, *module: str) -> Process:
        """Start another program of the project, in the same domain."""
        return self._start(module[0], *module)

    def _start_client(self) -> None:
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=int(self.environment["ROS_DOMAIN_ID"]))
        self.node = rclpy.create_node("test_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._clients = {
            name: ActionClient(self.node, Navigate, f"/{name}/{ACTION_NAME}")
            for name in self.vehicles
        }

    def wait_for_line(self, text: str, timeout_s: float) -> None:
        """Wait until the server has printed something."""
        self.server.wait_for(text, timeout_s)

    def wait(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Spin until ``condition`` holds; fail after ``timeout_s``."""
        deadline = time.monotonic() + patient_s(timeout_s)
        while not condition():
            if time.monotonic() > deadline:
                raise AssertionError(f"{what} did not happen. Server:\n{self.server.text[-3000:]}")
            self._executor.spin_once(timeout_sec=0.05)

    def fly(self, name: str, goal: Navigate.Goal) -> GoalRecord:
        """Send a vehicle a goal, and wait until it is accepted or rejected."""
        record = GoalRecord()
        client = self._clients[name]
        assert client.wait_for_server(timeout_sec=READY_TIMEOUT_S), f"no action server of {name}"
        future = client.send_goal_async(
            goal, feedback_callback=lambda message: record.feedback.append(message.feedback)
        )
        self.wait(future.done, 10.0, f"an answer to the goal of {name}")
        record.handle = future.result()
        record.accepted = record.handle.accepted
        if record.accepted:
            self.accepted[name] += 1
            record.handle.get_result_async().add_done_callback(partial(_on_result, record))
        return record

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """Call a service."""
        client = self.node.create_client(kind, service)
        assert client.wait_for_service(timeout_sec=READY_TIMEOUT_S), service
        future = client.call_async(request)
        self.wait(future.done, 10.0, f"an answer to {service}")
        self.node.destroy_client(client)
        return future.result()

    def close(self) -> None:
        """Stop everything."""
        if self._context is not None:
            for client in self._clients.values():
                client.destroy()
            self.node.destroy_node()
            self._executor.shutdown()
            rclpy.try_shutdown(context=self._context)
        for process in reversed(self._processes):
            process.stop()


def _on_result(record: GoalRecord, done: Future) -> None:
    record.status = done.result().status
    record.result = done.result().result


def set_up(vehicles: tuple[FleetVehicle, ...]) -> dict[str, Any]:
    """Return a parameter file."""
    server = {"vehicles": [vehicle.name for vehicle in vehicles], "arming": "auto"}
    nodes: dict[str, Any] = {"navigation_server": {"ros__parameters": server}}
    for vehicle in vehicles:
        own = {
            "target_system": vehicle.system_id,
            "link_url": f"udpin://127.0.0.1:{vehicle.port}",
        }
        nodes[f"/{vehicle.name}/navigation_server"] = {"ros__parameters": own}
    return nodes


class Flood:
    """Sends datagrams to a port, as many as it can, until it is left."""

    def __init__(self, port: int, datagrams: list[bytes]) -> None:
        """Prepare to send these again and again."""
        self._port = port
        self._datagrams = datagrams
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._send, daemon=True)
        self.sent = 0

    def __enter__(self) -> Flood:
        """Begin."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._stop.set()
        self._thread.join(5.0)

    def _send(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not self._stop.is_set():
                for datagram in self._datagrams:
                    sender.sendto(datagram, ("127.0.0.1", self._port))
                    self.sent += 1
                # Some 3000 a second: thirty times what a vehicle sends. A slow machine that is
                # shared by several tests can still read them all; else no HEARTBEAT arrives.
                self._stop.wait(len(self._datagrams) / 3000.0)


def two_ports() -> tuple[int, int]:
    """Return two ports that are free."""
    first = free_udp_port()
    while (second := free_udp_port()) == first:
        pass
    return first, second
