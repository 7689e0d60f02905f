"""A server sends its reservations while somebody listens, and none to itself."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data

from custom_interfaces.msg import TrafficState
from drone_navigation.server.traffic.traffic_topic import TRAFFIC_TOPIC, TrafficTopic
from mavlink_vehicle.io.driver import Driver
from navigation_bridge.fleet import FleetApplication, Member
from tests.support.processes import patient_s
from tests.support.ros.server_parts import ServerParts

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_demo")]

_PERIODS_S = 1.0
"""Five periods of sending"""


class _Topic(TrafficTopic):
    """Counts what it hears of itself."""

    heard = 0

    def _take_state(self, message: TrafficState) -> None:
        self.heard += 1
        super()._take_state(message)


class _Server(ServerParts):
    """The parts of a server that share traffic."""

    def __init__(self) -> None:
        super().__init__({})
        member = Member("", 0, self.bridge)
        fleet = FleetApplication([member], self.clock)
        driver = Driver(fleet, self.router, self.clock)
        fleet.attach(driver)
        self.topic = _Topic(self.node, self.config, self.clock)
        self.topic.join(self.bridge)
        self.topic.serve(member)
        self.start(driver, SingleThreadedExecutor(context=self.context))

    def close(self) -> None:
        """Stop all."""
        self.topic.close()
        super().close()


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
