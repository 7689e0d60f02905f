"""The navigation client: ``ros2 run drone_navigation navigation_client``."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args
from std_msgs.msg import String

from drone_navigation.client_errands import Errand, make_errand
from drone_navigation.client_view import Telemetry, View, make_view
from drone_navigation.names import SERVER_NODE_NAME
from drone_navigation.plan_files import PlanError
from drone_navigation.route_requests import LAPS_MAX
from drone_navigation.topics import LATCHED_QOS

EXIT_SUCCESS = 0
EXIT_ABORTED = 1
EXIT_USAGE = 2
EXIT_REJECTED = 3
EXIT_CANCELED = 4
EXIT_NO_SERVER = 5

_RESPONSE_TIMEOUT_S = 5.0
# After this long without feedback the client asks whether the server is still there.
_SILENCE_S = 5.0
# A server that was killed is only forgotten by DDS after its lease; this bounds the wait.
_SILENCE_MAX_S = 30.0

_EXIT_CODES = {
    GoalStatus.STATUS_SUCCEEDED: EXIT_SUCCESS,
    GoalStatus.STATUS_CANCELED: EXIT_CANCELED,
    GoalStatus.STATUS_ABORTED: EXIT_ABORTED,
}


class NavigationClient:
    """Sends one goal, shows its progress, and cancels it when asked to."""

    def __init__(self, node: Node, view: View, errand: Errand) -> None:
        """Create the action client for an errand on ``node``."""
        self._node = node
        self._view = view
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._errand = errand
        self._client = ActionClient(node, errand.action, errand.name)
        self._rejections: list[str] = []
        node.create_subscription(
            String,
            f"{SERVER_NODE_NAME}/last_rejection",
            lambda message: self._rejections.append(message.data),
            LATCHED_QOS,
        )
        self._interrupts = 0
        self._last_feedback_s = 0.0
        self._started_s = 0.0

    def interrupt(self) -> None:
        """Cancel the goal (first call) or give up waiting (second call)."""
        self._interrupts += 1

    def run(self, server_timeout_s: float, cancel_after_s: float) -> int:
        """Send the goal and follow it to its end.

        Args:
            server_timeout_s: longest wait for the server to appear.
            cancel_after_s: time after which the goal is cancelled; infinite for never.

        Returns:
            The exit code.
        """
        if not self._wait(self._client.server_is_ready, server_timeout_s):
            self._view.note(
                f"No server offers {self._errand.name}; start navigation_server, in the same ROS "
                "domain.",
                bad=True,
            )
            return EXIT_NO_SERVER
        for note in self._errand.notes:
            self._view.note(note)
        self._view.note(f"Sending {self._errand.description}")
        self._started_s = self._last_feedback_s = time.monotonic()
        handle = self._send()
        if handle is None:
            return EXIT_NO_SERVER
        if not handle.accepted:
            self._wait(lambda: bool(self._rejections), 1.0)
            reason = self._rejections[-1] if self._rejections else "no reason was published"
            self._view.note(f"Goal rejected: {reason}", bad=True)
            return EXIT_REJECTED
        return self._follow(handle, cancel_after_s)

    def _send(self) -> ClientGoalHandle | None:
        # The reason of an earlier rejection is latched; only what comes from now on counts.
        self._wait(lambda: bool(self._rejections), 0.2)
        self._rejections.clear()
        future = self._client.send_goal_async(
            self._errand.goal, feedback_callback=self._on_feedback
        )
        if not self._wait(future.done, _RESPONSE_TIMEOUT_S):
            self._view.note("The server did not answer the goal request.", bad=True)
            return None
        return future.result()

    def _follow(self, handle: ClientGoalHandle, cancel_after_s: float) -> int:
        self._view.note("Goal accepted")
        result_future = handle.get_result_async()
        cancel_future: Future | None = None
        while not result_future.done():
            self._executor.spin_once(timeout_sec=0.1)
            elapsed_s = time.monotonic() - self._started_s
            if cancel_future is None and (self._interrupts or elapsed_s >= cancel_after_s):
                self._view.note("Cancelling; waiting for the vehicle to stop")
                cancel_future = handle.cancel_goal_async()
            if self._interrupts > 1:
                self._view.note("Not waiting any longer; the goal may still be active.", bad=True)
                return EXIT_ABORTED
            if self._server_is_gone():
                self._view.note(
                    "The server is gone; what the vehicle does now is its own failsafe's "
                    "business (docs/navigate.md).",
                    bad=True,
                )
                return EXIT_NO_SERVER
        return self._report(result_future.result())

    def _report(self, wrapped: Any) -> int:
        result = wrapped.result
        place = result.final_pose.pose.position
        error_m = getattr(result, "final_error", math.nan)
        error = f", {error_m:.2f} m from the target" if math.isfinite(error_m) else ""
        self._view.note(
            f"{result.message} ({result.total_elapsed_time:.1f} s, at ({place.x:.2f}, "
            f"{place.y:.2f}, {place.z:.2f}) m{error})",
            bad=wrapped.status != GoalStatus.STATUS_SUCCEEDED,
        )
        return _EXIT_CODES.get(wrapped.status, EXIT_ABORTED)

    def _server_is_gone(self) -> bool:
        silence_s = time.monotonic() - self._last_feedback_s
        if silence_s < _SILENCE_S:
            return False
        return silence_s > _SILENCE_MAX_S or not self._client.server_is_ready()

    def _on_feedback(self, message: Any) -> None:
        feedback = message.feedback
        self._last_feedback_s = time.monotonic()
        place = feedback.current_pose.pose.position
        self._view.show(
            Telemetry(
                position_enu_m=(place.x, place.y, place.z),
                distance_m=feedback.distance_remaining,
                time_s=feedback.estimated_time_remaining,
                battery_percent=feedback.battery_percentage,
                status=feedback.current_status,
            ),
            self._last_feedback_s - self._started_s,
        )

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() >= deadline or self._interrupts:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of ``navigation_client``."""
    parser = argparse.ArgumentParser(
        prog="navigation_client",
        description="Send one goal to navigate_to_waypoint, or a route from a file to "
        "navigate_waypoints, show its progress and wait for its end. "
        "Ctrl-C cancels the goal and waits for the vehicle to stop; a second one stops waiting.",
        epilog="exit codes: 0 succeeded, 1 aborted, 2 usage, 3 rejected, 4 canceled, 5 no server",
    )
    parser.add_argument(
        "--goal",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        default=(10.0, 5.0, 2.0),
        help="target in metres (default: 10 5 2)",
    )
    files = parser.add_mutually_exclusive_group()
    files.add_argument(
        "--plan", type=Path, metavar="FILE", help="fly the route of a QGroundControl .plan file"
    )
    files.add_argument(
        "--waypoints", type=Path, metavar="FILE", help="fly the route of a QGC WPL 110 file"
    )
    parser.add_argument(
        "--mission", action="store_true", help="have the vehicle fly a file's route as its mission"
    )
    parser.add_argument(
        "--laps", type=int, default=1, metavar="N", help="how often a file's route is flown"
    )
    parser.add_argument(
        "--frame", default="map", help="frame of the target: map (ENU, default) or base_link (FLU)"
    )
    parser.add_argument(
        "--yaw",
        type=float,
        metavar="DEG",
        help="heading at the target, counter-clockwise from east; "
        "default: face the direction of travel",
    )
    parser.add_argument(
        "--speed", type=float, default=0.0, metavar="M_S", help="max_speed (default: the server's)"
    )
    parser.add_argument("--avoid", action="store_true", help="ask for obstacle avoidance")
    parser.add_argument(
        "--cancel-after", type=float, default=math.inf, metavar="S", help="cancel after S seconds"
    )
    parser.add_argument(
        "--server-timeout",
        type=float,
        default=10.0,
        metavar="S",
        help="longest wait for the server (default: 10)",
    )
    parser.add_argument("--plain", action="store_true", help="plain lines even on a terminal")
    return parser


def main(args: list[str] | None = None) -> int:
    """Send a goal and return the exit code."""
    argv = list(sys.argv if args is None else ["navigation_client", *args])
    parser = make_parser()
    options = parser.parse_args(remove_ros_args(argv)[1:])
    if not 0 <= options.laps <= LAPS_MAX:
        parser.error(f"--laps is {options.laps}; give 1 to {LAPS_MAX}.")
    if options.mission and options.plan is None and options.waypoints is None:
        parser.error("--mission is for a route; give --plan or --waypoints, too.")
    try:
        errand = make_errand(options)
    except PlanError as error:
        parser.error(str(error))
    rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    view = make_view(plain=options.plain)
    node = Node("navigation_client")
    client = NavigationClient(node, view, errand)

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        client.interrupt()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    try:
        return client.run(options.server_timeout, options.cancel_after)
    finally:
        view.close()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    sys.exit(main())
