"""A simulator and a navigation server as processes, and an action client of the test's own."""

from __future__ import annotations

import itertools
import os
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from custom_interfaces.action import Navigate
from drone_navigation.processes import free_domain, free_udp_port, ros_environment
from drone_navigation.qos import LATCHED_QOS
from drone_navigation.server.actions import ACTIONS
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from tests.support.links.relay import Relay
from tests.support.processes import Process, patient_s

READY_TIMEOUT_S = 90.0
FLIGHT_TIMEOUT_S = 60.0
_LAND_MODE = 9
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_counter = itertools.count()


def new_domain() -> int:
    """Return a ROS domain that no neighbour uses or is about to use."""
    return free_domain(7 * os.getpid() + 13 * next(_counter))


class GoalRecord:
    """One goal that a test sent: what came back, in the order in which it came."""

    def __init__(self) -> None:
        """Start empty."""
        self.accepted: bool | None = None
        self.handle: Any = None
        self.feedback: list[Any] = []
        self.result: Any = None
        self.status: int | None = None
        self.feedback_after_end = 0

    @property
    def statuses(self) -> list[str]:
        """The ``current_status`` values in the order of their first appearance."""
        return list(dict.fromkeys(feedback.current_status for feedback in self.feedback))


class Flight:
    """Server and simulator in a domain of their own, with a relay between them."""

    def __init__(
        self,
        folder: Path,
        *server_arguments: str,
        arming: str = "auto",
        simulator: tuple[str, ...] = (),
    ) -> None:
        """Start both, with further options each, and wait until the server has a position."""
        self._simulator_arguments = simulator
        self.domain = new_domain()
        self.environment = ros_environment(self.domain)
        self.folder = folder
        self.port = free_udp_port()
        self.relay = Relay(self.port)
        self._arguments = (*server_arguments, "--arming", arming)
        self.server: Process | None = None
        self.simulator: Process | None = None
        self._node: Any = None
        try:
            self.server = self.start_server()
            self.simulator = self.start_simulator()
            self.server.wait_for("Position valid", READY_TIMEOUT_S)
            self._start_client()
            self._client(Navigate.Goal())
        except BaseException:
            self.close()
            raise

    def start_server(self) -> Process:
        """Start a navigation server."""
        return Process(
            "navigation_server",
            [
                "python", "-m", "drone_navigation.navigation_server",
                "--link", f"udpin://127.0.0.1:{self.port}",
                "--tlog", str(self.folder / f"flight-{uuid.uuid4().hex[:6]}.tlog"),
                "--ros-args", "-p", f"log_directory:={self.folder / 'stored'}", "--",
                *self._arguments,
            ],
            self.environment,
        )  # fmt: skip

    def start_simulator(self) -> Process:
        """Start a simulated vehicle, a copter by default, that sends to the relay."""
        link = f"udpout://127.0.0.1:{self.relay.vehicle_port}"
        return Process(
            "mavlink_sitl",
            [
                "python", "-m", "mavlink_sitl", "--link", link, "--ready-after", "1",
                *self._simulator_arguments,
            ],
            self.environment,
        )  # fmt: skip

    def renew_client(self) -> None:
        """Start over as a client that has never heard of a server that was killed.

        DDS takes a killed participant for alive until its lease ends, so that the old client
        would continue talking to it.
        """
        self.renew_node()
        self._client(Navigate.Goal())

    def renew_node(self) -> None:
        """The same for a server that offers no actions yet."""
        self._stop_client()
        self._start_client()

    def _stop_client(self) -> None:
        if self._node is None:
            return
        for client in self._clients.values():
            client.destroy()
        self._node.destroy_node()
        self._executor.shutdown()
        rclpy.try_shutdown(context=self._context)
        self._node = None

    def _start_client(self) -> None:
        self._context = rclpy.Context()
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        rclpy.init(context=self._context, domain_id=self.domain)
        self._node = rclpy.create_node("test_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._clients: dict[str, ActionClient] = {}
        self.rejections: list[str] = []
        self._node.create_subscription(
            String,
            f"{SERVER_NODE_NAME}/last_rejection",
            lambda message: self.rejections.append(message.data),
            LATCHED_QOS,
        )

    def _client(self, goal: Any) -> ActionClient:
        """Return the client of the action that a goal belongs to."""
        kind = next(kind for kind in ACTIONS if isinstance(goal, kind.type.Goal))
        if kind.name not in self._clients:
            client = ActionClient(self._node, kind.type, kind.name)
            assert client.wait_for_server(timeout_sec=READY_TIMEOUT_S), "no action server"
            self._clients[kind.name] = client
        return self._clients[kind.name]

    @property
    def node(self) -> Any:
        """The client's node."""
        return self._node

    def subscribe(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any) -> None:
        """Hear a topic from now on."""
        self._node.create_subscription(kind, topic, callback, qos)

    def advertise(self, kind: Any, topic: str, qos: Any) -> Any:
        """Return a publisher of the test's own."""
        return self._node.create_publisher(kind, topic, qos)

    def call(self, name: str) -> Trigger.Response:
        """Call one of the server's own services."""
        service = self._node.create_client(Trigger, f"{SERVER_NODE_NAME}/{name}")
        assert service.wait_for_service(timeout_sec=READY_TIMEOUT_S)
        future = service.call_async(Trigger.Request())
        self.wait(future.done, 20.0, f"an answer to {name}")
        self._node.destroy_client(service)
        return future.result()

    def wait(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Spin until ``condition`` holds; fail after ``timeout_s``."""
        deadline = time.monotonic() + patient_s(timeout_s)
        while not condition():
            if time.monotonic() > deadline:
                text = self.server.text[-3000:] if self.server is not None else ""
                raise AssertionError(f"{what} did not happen in {timeout_s:g} s. Server:\n{text}")
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, seconds: float) -> None:
        """Let messages come in for a while."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=0.05)

    def send(self, goal: Any) -> GoalRecord:
        """Send a goal of any action and wait until it is accepted or rejected."""
        record = GoalRecord()

        def on_feedback(message: Any) -> None:
            record.feedback.append(message.feedback)
            if record.result is not None:
                record.feedback_after_end += 1

        future = self._client(goal).send_goal_async(goal, feedback_callback=on_feedback)
        self.wait(future.done, 10.0, "an answer to the goal")
        record.handle = future.result()
        record.accepted = record.handle.accepted
        if record.accepted:
            record.handle.get_result_async().add_done_callback(
                lambda done: self._on_result(record, done)
            )
        return record

    @staticmethod
    def _on_result(record: GoalRecord, done: Future) -> None:
        record.status = done.result().status
        record.result = done.result().result

    @property
    def is_armed(self) -> bool:
        """Whether the copter's newest HEARTBEAT reports it armed."""
        return bool(self.relay.from_vehicle("HEARTBEAT")[-1].base_mode & _ARMED)

    def ground(self) -> None:
        """Land the copter if it flies, as a pilot would, and wait until it is disarmed."""
        if self.is_armed:
            self.relay.set_mode(_LAND_MODE)
            self.wait(lambda: not self.is_armed, FLIGHT_TIMEOUT_S, "landing and disarming")

    def cancel(self, record: GoalRecord) -> Any:
        """Ask for a cancel and return the service's answer."""
        future = record.handle.cancel_goal_async()
        self.wait(future.done, 10.0, "an answer to the cancel")
        return future.result()

    def cancel_all(self) -> CancelGoal.Response:
        """Ask for a cancel of every goal, as the action's own service allows."""
        service = self._node.create_client(CancelGoal, f"{ACTION_NAME}/_action/cancel_goal")
        assert service.wait_for_service(timeout_sec=READY_TIMEOUT_S)
        future = service.call_async(CancelGoal.Request())  # all zeros: every goal
        self.wait(future.done, 10.0, "an answer to cancel all")
        self._node.destroy_client(service)
        return future.result()

    def wait_for_status(self, record: GoalRecord, status: str) -> None:
        """Wait until a goal's feedback says ``status``; fail at once if it was rejected."""
        assert record.accepted, f"the goal was rejected: {self.rejections[-1:]}"
        self.wait(
            lambda: bool(record.feedback) and record.feedback[-1].current_status == status,
            FLIGHT_TIMEOUT_S,
            f"status {status}",
        )

    def wait_for_result(self, record: GoalRecord, timeout_s: float = FLIGHT_TIMEOUT_S) -> Any:
        """Wait for the end of a goal, and a little longer for feedback that must not come."""
        assert record.accepted, f"the goal was rejected: {self.rejections[-1:]}"
        self.wait(lambda: record.result is not None, timeout_s, "the end of the goal")
        self.spin_for(0.3)
        assert record.feedback_after_end == 0
        assert record.result is not None
        return record.result

    def close(self) -> None:
        """Stop everything."""
        self._stop_client()
        for process in (self.simulator, self.server):
            if process is not None:
                process.stop()
        self.relay.close()


def navigate_goal(x: float, y: float, z: float, speed: float = 0.0) -> Navigate.Goal:
    """Return a goal in the map frame that looks east."""
    goal = Navigate.Goal()
    goal.target_pose.header.frame_id = "map"
    position = goal.target_pose.pose.position
    position.x, position.y, position.z = x, y, z
    goal.target_pose.pose.orientation.w = 1.0
    goal.max_speed = speed
    return goal
