"""The client's node in ROS, and waiting while it runs, as long as there is a server."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from custom_interfaces.msg import VehicleStatus
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import leave
from drone_navigation.qos import LATCHED_QOS
from navigation_bridge.names import SERVER_NODE_NAME

__all__ = [
    "SILENT_S",
    "SPIN_S",
    "ServerSigns",
    "client_node",
    "end_without_server",
    "on_interrupt",
    "wait_for",
]

SPIN_S = 0.05
"""The longest that one turn of the executor waits."""

SILENT_S = 8.0
"""A server is given up if its status, which comes once a second, is missing for this time"""

# While a server is discovered in part, rmw_fastrtps takes a service for none (`watch`).
_GONE_S = 3.0


@contextmanager
def client_node(argv: list[str], vehicle: str) -> Iterator[Node]:
    """Begin with ROS, and end with it.

    Args:
        argv: ROS arguments.
        vehicle: the namespace.
    """
    with starting_ros():
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        with starting_ros():
            node = Node("navigation_client", namespace=vehicle)
        try:
            yield node
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


def end_without_server(code: int) -> None:
    """End the process without ROS's own end, for a server that may hang.

    Fast DDS locks the shared memory of such a server at its end, and crashed there where the
    server's part had been given up as dead meanwhile (observed, once in twenty ends).
    """
    leave(code)


def on_interrupt(interrupt: Callable[[], None]) -> None:
    """Have SIGINT and SIGTERM call something between two turns of the interpreter."""

    def handle(_number: int, _frame: FrameType | None) -> None:
        interrupt()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)


def wait_for(
    condition: Callable[[], bool],
    timeout_s: float,
    spin_once: Callable[[], None],
    is_interrupted: Callable[[], bool] = lambda: False,
) -> bool:
    """Spin until something holds; return whether it does, in time and uninterrupted."""
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() >= deadline_s or is_interrupted():
            return False
        spin_once()
    return True


class ServerSigns:
    """Signs of life of the server while a client waits for its answer."""

    def __init__(self, node: Node) -> None:
        """Listen to the status of the server of the node's namespace."""
        self._heard_s = self._ready_s = time.monotonic()
        self._id = self._other_id = ""
        topic = f"{SERVER_NODE_NAME}/vehicle_status"
        node.create_subscription(VehicleStatus, topic, self._take, LATCHED_QOS)

    def _take(self, status: VehicleStatus) -> None:
        self._id = self._id or status.server_id
        if status.server_id == self._id:
            self._heard_s = time.monotonic()
        else:
            self._other_id = status.server_id

    def begin(self) -> None:
        """Begin to wait for an answer."""
        self._heard_s = self._ready_s = time.monotonic()
        self._other_id = ""

    def why_gone(self, is_ready: bool) -> str:
        """Return why no answer can be expected any more, a sentence; empty otherwise.

        Args:
            is_ready: whether ROS knows the service or action.
        """
        now_s = time.monotonic()
        if is_ready:
            self._ready_s = now_s
        if now_s - self._ready_s >= _GONE_S:
            return "The server has ended; what became of the request is unknown."
        if self._other_id and now_s - self._heard_s >= _GONE_S:
            return "The server was restarted and does not know the request."
        if now_s - self._heard_s >= SILENT_S:
            return (
                f"Server lost: silent for {SILENT_S:g} s. It has ended, hangs, or the network to "
                "it is down; what became of the request is unknown."
            )
        return ""

    def wait_for_answer(
        self,
        is_done: Callable[[], bool],
        is_ready: Callable[[], bool],
        timeout_s: float,
        spin_once: Callable[[], None],
        is_interrupted: Callable[[], bool] = lambda: False,
    ) -> str:
        """Spin until an answer is there; return why it is not, a sentence, or nothing."""
        why = ""

        def is_over() -> bool:
            nonlocal why
            why = "" if is_done() else self.why_gone(is_ready())
            return is_done() or bool(why)

        self.begin()
        wait_for(is_over, timeout_s, spin_once, is_interrupted)
        return "" if is_done() else why or f"The server did not answer within {timeout_s:g} s."
