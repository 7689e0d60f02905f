"""The node that Nav2's clients talk to."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from drone_navigation.nav2.behaviours import Behaviours, ObjectFollower
from drone_navigation.nav2.flights import Flights
from drone_navigation.nav2.navigators import Navigators, Preferences
from drone_navigation.nav2.other_servers import ACTION, OtherServers
from drone_navigation.nav2.planners import Planners
from drone_navigation.nav2.server_state import ServerState
from drone_navigation.nav2.services import LifeCycle, offer_clearing, reject_the_rest
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import StopSignals

# Once it is cancelled the server stops the vehicle, whether or not a client waits for that.
_STOP_TIMEOUT_S = 3.5
_SPIN_S = 0.2
_DISCOVERY_S = 2.0
_HEAR_TIMEOUT_S = 3.0
# One that was killed stays in the graph for the lease of its DDS participant, 20 s.
_ALONE_TIMEOUT_S = 25.0
_NEW_S = 60.0
_SEVERAL = (
    f"Another node offers {ACTION} in this ROS domain and namespace: stop Nav2, or the other "
    "navigation_nav2."
)


class StartError(RuntimeError):
    """The node cannot serve clients; the text is the reason."""


def run(signals: StopSignals, defaults: Mapping[str, float | bool]) -> None:
    """Serve clients until a request to stop; goals under way are then cancelled.

    Args:
        signals: of the process.
        defaults: of the parameters.

    Raises:
        StartError: a parameter is invalid, or others serve Nav2's clients.
    """
    with starting_ros():
        node = Node("navigation_nav2")
    preferences = _preferences(node, defaults)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    others = OtherServers(node)
    vehicle = ServerState(node)
    # Others are discovered meanwhile.
    _spin_until(executor, lambda: signals.is_requested, _DISCOVERY_S)
    # A client that does not ask whether it is active sends its goal at once.
    _spin_until(executor, lambda: signals.is_requested or not vehicle.why_not(), _HEAR_TIMEOUT_S)
    _wait_until_alone(node, others, executor, signals)
    flights = Flights(node, vehicle)
    navigators = Navigators(node, vehicle, flights, preferences)
    ObjectFollower(node, flights, navigators, preferences)
    Behaviours(node, vehicle, flights, navigators, preferences)
    Planners(node, vehicle, navigators)
    LifeCycle(node, vehicle, flights)
    offer_clearing(node)
    reject_the_rest(node)
    node.get_logger().info("Ready for clients of Nav2")
    try:
        _serve(others, executor, signals)
    finally:
        flights.stop()
        _spin_until(executor, lambda: flights.is_idle, _STOP_TIMEOUT_S)
        executor.shutdown(timeout_sec=1.0)
        node.destroy_node()


def _serve(others: OtherServers, executor: SingleThreadedExecutor, signals: StopSignals) -> None:
    """Serve until a moment.

    A loaded machine discovers others late. Of ours the one that started last ends. Nav2's own
    server does not, so while this node is still new it does.

    Raises:
        StartError: another one was found, and it does not end.
    """
    new_until_s, alone_s = time.monotonic() + _NEW_S, time.monotonic()
    while not signals.is_requested:
        executor.spin_once(timeout_sec=_SPIN_S)
        now_s = time.monotonic()
        if not (others.earlier or (others.foreign and alone_s < new_until_s)):
            alone_s = now_s
        elif now_s - alone_s > _ALONE_TIMEOUT_S:
            raise StartError(_SEVERAL)


def _wait_until_alone(
    node: Node, others: OtherServers, executor: SingleThreadedExecutor, signals: StopSignals
) -> None:
    """Wait for the end of another server of the same names: both would execute each goal.

    Raises:
        StartError: it is still there.
    """

    def is_alone() -> bool:
        return signals.is_requested or not others.servers

    if not is_alone():
        node.get_logger().warning(f"Another node offers {ACTION}; waiting until it ends")
        _spin_until(executor, is_alone, _ALONE_TIMEOUT_S)
    if not is_alone():
        raise StartError(_SEVERAL)


def _spin_until(
    executor: SingleThreadedExecutor, condition: Callable[[], bool], timeout_s: float
) -> None:
    until_s = time.monotonic() + timeout_s
    while not condition() and time.monotonic() < until_s:
        executor.spin_once(timeout_sec=_SPIN_S)


def _preferences(node: Node, defaults: Mapping[str, float | bool]) -> Preferences:
    values = {name: node.declare_parameter(name, value).value for name, value in defaults.items()}
    for name, value in values.items():
        if not isinstance(value, bool) and not (math.isfinite(value) and value >= 0.0):
            raise StartError(f"{name} is {value}; it must be 0 or more.")
    return Preferences(**values)
