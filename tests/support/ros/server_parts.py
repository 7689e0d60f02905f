"""The parts of a server in the test's own process, so that a test can break one or listen to it."""

from __future__ import annotations

import os
import threading

import rclpy
from rclpy.executors import Executor

from drone_navigation.processes import free_udp_port, ros_environment
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from tests.support.processes import Process
from tests.support.ros.ros_flight import new_domain

__all__ = ["ServerParts"]


class ServerParts:
    """Node, bridge and link in a domain of their own; :meth:`start` adds a simulated vehicle.

    A test adds what it is about in between.

    Attributes:
        environment: for other processes in the domain.
        context: of rclpy.
        node: the server's.
        config: settings made of the parameters.
        clock: of the driver.
        bridge: of the vehicle.
        router: with the vehicle's link.
        driver: set by `start`.
        executor: set by `start`.
    """

    driver: Driver
    executor: Executor

    def __init__(self, parameters: dict[str, ParameterValue]) -> None:
        """Make the parts."""
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        domain, port = new_domain(), free_udp_port()
        self.environment = ros_environment(domain)
        self._simulated = f"udpout://127.0.0.1:{port}"
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("navigation_server", context=self.context)
        self.config, self.clock = make_config(parameters), MonotonicClock()
        self.bridge = Bridge(Vehicle(self.config.vehicle), self.config.bridge)
        self.router = Router([open_link(f"udpin://127.0.0.1:{port}")], lambda: Codec(1, 191))

    def start(self, driver: Driver, executor: Executor) -> None:
        """Run the driver, the node's callbacks and a simulated vehicle."""
        self.driver, self.executor = driver, executor
        executor.add_node(self.node)
        self._spinner = threading.Thread(target=executor.spin, daemon=True)
        driver.start()
        self._spinner.start()
        self._simulator = Process(
            "mavlink_sitl",
            ["python", "-m", "mavlink_sitl", "--link", self._simulated, "--ready-after", "0.5"],
            self.environment,
        )

    def close(self) -> None:
        """Stop all."""
        self._simulator.stop()
        self.driver.stop(5.0)
        self.executor.shutdown(timeout_sec=2.0)
        self._spinner.join(5.0)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)
