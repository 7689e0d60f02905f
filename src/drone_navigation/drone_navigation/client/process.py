"""The client's node in ROS, and waiting while it runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

__all__ = ["SPIN_S", "client_node", "wait_for"]

SPIN_S = 0.05
"""The longest that one turn of the executor waits."""


@contextmanager
def client_node(argv: list[str], vehicle: str) -> Iterator[Node]:
    """Begin with ROS, and end with it.

    Args:
        argv: ROS arguments.
        vehicle: the namespace.
    """
    rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("navigation_client", namespace=vehicle)
        try:
            yield node
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


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
