"""The console's client of vehicles: what it rehearses with what a server reports, over real DDS."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node

from custom_interfaces.msg import VehicleStatus
from drone_navigation.console.fleet import Fleet
from drone_navigation.console.messages import PageWaypoint, Rehearse
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.processes import patient_s
from tests.support.ros.ros_flight import new_domain

_ORDER = Rehearse("/", (PageWaypoint((5.0, 0.0, 5.0), 0.0),), 0.0, 1, False, 0.0, 7)
_WAIT_S = 30.0


class Scene:
    """A console's fleet, and a server that does not answer for its parameters."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=new_domain())
        self._server = Node(SERVER_NODE_NAME, context=self._context, start_parameter_services=False)
        self._status = self._server.create_publisher(
            VehicleStatus, f"{SERVER_NODE_NAME}/vehicle_status", LATCHED_QOS
        )
        self._odometry = self._server.create_publisher(
            Odometry, f"{SERVER_NODE_NAME}/odometry", STREAM_QOS
        )
        self.board = ShownValues()
        self._node = Node("navigation_console", context=self._context)
        self.fleet = Fleet(self._node, self.board)
        self.fleet.start()
        self.fleet.watch(True)

    def wait(self, condition: Callable[[], Any]) -> None:
        """Publish until a condition is true."""
        standing = Odometry()
        standing.pose.pose.orientation.w = 1.0
        deadline_s = time.monotonic() + patient_s(_WAIT_S)
        while not condition():
            assert time.monotonic() < deadline_s, "it did not happen"
            self._status.publish(
                VehicleStatus(connected=True, autopilot="ArduCopter", position_valid=True)
            )
            self._odometry.publish(standing)
            time.sleep(0.1)

    def close(self) -> None:
        """End both."""
        self.fleet.stop()
        self._node.destroy_node()
        self._server.destroy_node()
        rclpy.try_shutdown(context=self._context)


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    made.close()


def test_without_the_servers_parameters_no_rejection_is_claimed(scene: Scene) -> None:
    scene.wait(lambda: scene.board.get("/", "alive") and scene.board.get("/", "motion"))
    told: list[dict[str, Any]] = []
    scene.fleet.rehearse(_ORDER, "page 1", told.append)
    scene.wait(lambda: told)
    (answer,) = told
    assert answer["number"] == 7
    assert "rehearsal" not in answer
    assert "has not reported its parameters yet" in answer["error"]
