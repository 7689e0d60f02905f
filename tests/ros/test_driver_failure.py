"""A driver thread that is late or no longer there: no goal is taken, and open ones end."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor

from custom_interfaces.action import Navigate
from custom_interfaces.msg import GoalEvent
from drone_navigation.qos import STREAM_QOS
from drone_navigation.server.actions import GoalServers
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.publishing.topics import Topics
from drone_navigation.server.service_servers import ServiceServers
from drone_navigation.server.vehicle_outputs import VehicleOutputs
from mavlink_vehicle.io.driver import Driver
from navigation_bridge.names import ACTION_NAME
from navigation_core.outcomes import OutcomeCode
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import navigate_goal
from tests.support.ros.server_parts import ServerParts

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_demo")]


class _Server(ServerParts):
    """The navigation server's parts that take goals."""

    def __init__(self) -> None:
        super().__init__({"arming": "auto"})
        driver = Driver(self.bridge, self.router, self.clock)
        topics = Topics(self.node, self.bridge, lambda: self.router.statistics.of_system(0))
        access = BridgeAccess(self.node, self.bridge, driver, self.clock, self.config, topics)
        self.server = GoalServers(access)
        services = ServiceServers(access)
        VehicleOutputs(self.bridge).attach(self.node, self.server, services, topics)
        self.client = ActionClient(self.node, Navigate, ACTION_NAME)
        self.start(driver, MultiThreadedExecutor(num_threads=6, context=self.context))


@pytest.fixture
def server() -> Iterator[_Server]:
    server = _Server()
    yield server
    server.close()


def _wait(condition: Callable[[], bool], what: str, timeout_s: float = 20.0) -> None:
    deadline = time.monotonic() + patient_s(timeout_s)
    while not condition():
        assert time.monotonic() < deadline, f"{what} did not happen in {timeout_s:g} s"
        time.sleep(0.02)


def _send(server: _Server) -> Any:
    future = server.client.send_goal_async(navigate_goal(5.0, 0.0, 2.0))
    _wait(future.done, "an answer to the goal")
    return future.result()


def test_open_goals_end_and_new_ones_are_rejected(server: _Server) -> None:
    _wait(lambda: server.bridge.pose is not None, "a position")
    assert server.client.wait_for_server(timeout_sec=10.0)
    handle = _send(server)
    assert handle.accepted
    result = handle.get_result_async()
    _wait(lambda: server.bridge.goals.active_id is not None, "the start of the goal")

    server.driver.stop(5.0)
    assert not _send(server).accepted
    assert not result.done()
    server.server.abandon(OutcomeCode.INTERNAL_ERROR, "The driver is gone.")
    _wait(result.done, "the end of the goal")
    assert result.result().status == GoalStatus.STATUS_ABORTED
    assert result.result().result.message == "INTERNAL_ERROR: The driver is gone."
    _wait(server.server.is_idle, "the session's end")


def test_a_goal_that_the_driver_is_too_late_to_check_is_rejected_with_the_reason(
    server: _Server,
) -> None:
    _wait(lambda: server.bridge.pose is not None, "a position")
    assert server.client.wait_for_server(timeout_sec=10.0)
    heard: list[GoalEvent] = []
    topic = f"{server.node.get_name()}/goal_events"
    server.node.create_subscription(GoalEvent, topic, heard.append, STREAM_QOS)
    resumes = threading.Event()
    server.driver.post(resumes.wait)
    assert not _send(server).accepted
    assert not heard
    resumes.set()
    _wait(lambda: bool(heard), "the reason")
    assert (heard[0].event, heard[0].what) == ("REJECTED", "SERVER_LATE")
    assert "did not answer" in heard[0].message


def test_the_client_waits_for_the_reason_of_a_late_server(server: _Server) -> None:
    _wait(lambda: server.bridge.pose is not None, "a position")
    resumes = threading.Event()
    server.driver.post(resumes.wait)
    client = Process(
        "client",
        ["python", "-m", "drone_navigation.navigation_client", "--json", "--goal", "5", "0", "2"],
        server.environment,
    )
    try:
        _wait(lambda: any(map(_is_given_up, list(server.driver.works))), "the rejection")
        time.sleep(2.0)  # so long after the rejection the reason comes
        resumes.set()
        line = client.wait_for('"rejected"', patient_s(10.0))
    finally:
        resumes.set()
        client.stop()
    assert json.loads(line)["code"] == "SERVER_LATE"


def _is_given_up(work: tuple[Callable[[], object], Future[Any] | None]) -> bool:
    return work[1] is not None and work[1].cancelled()
