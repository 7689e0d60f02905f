"""A server sends its reservations while somebody listens, and none to itself."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data

from custom_interfaces.msg import TrafficState
from drone_navigation.processes import free_udp_port, ros_environment
from drone_navigation.server.traffic.traffic_topic import TRAFFIC_TOPIC, TrafficTopic
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.fleet import FleetApplication, Member
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import new_domain

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_demo")]

_PERIODS_S = 1.0
"""Five periods of sending"""


class _Topic(TrafficTopic):
    """Counts what it hears of itself."""

    heard = 0

    def _take_state(self, message: TrafficState) -> None:
        self.heard += 1
        super()._take_state(message)


class _Server:
    """The parts of a server that share traffic, with a simulated vehicle."""

    def __init__(self) -> None:
        domain, port = new_domain(), free_udp_port()
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("navigation_server", context=self.context)
        config, clock = make_config({}), MonotonicClock()
        self.bridge = Bridge(Vehicle(config.vehicle), config.bridge)
        member = Member("", 0, self.bridge)
        fleet = FleetApplication([member], clock)
        link = open_link(f"udpin://127.0.0.1:{port}")
        self.driver = Driver(fleet, Router([link], lambda: Codec(1, 191)), clock)
        fleet.attach(self.driver)
        self.topic = _Topic(self.node, config, clock)
        self.topic.join(self.bridge)
        self.topic.serve(member)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.spinner = threading.Thread(target=self.executor.spin, daemon=True)
        self.driver.start()
        self.spinner.start()
        self.simulator = Process(
            "mavlink_sitl",
            ["python", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}",
             "--ready-after", "0.5"],
            ros_environment(domain),
        )  # fmt: skip

    def close(self) -> None:
        self.simulator.stop()
        self.driver.stop(5.0)
        self.executor.shutdown(timeout_sec=2.0)
        self.spinner.join(5.0)
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture
def server() -> Iterator[_Server]:
    server = _Server()
    yield server
    server.close()


def test_it_sends_while_another_one_listens(server: _Server) -> None:
    limit_s = time.monotonic() + patient_s(20.0)
    while server.bridge.pose is None:
        assert time.monotonic() < limit_s, "no position"
        time.sleep(0.02)
    time.sleep(_PERIODS_S)
    assert server.topic.heard == 0
    others: list[TrafficState] = []
    listener = rclpy.create_node("listener", context=server.context)
    listener.create_subscription(
        TrafficState, TRAFFIC_TOPIC, others.append, qos_profile_sensor_data
    )
    server.executor.add_node(listener)
    while not others:
        assert time.monotonic() < limit_s, "nothing was sent"
        time.sleep(0.02)
    assert others[0].server == server.node.get_fully_qualified_name()
    server.executor.remove_node(listener)
    listener.destroy_node()
