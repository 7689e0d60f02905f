"""Flies plans: ``ros2 run mavbridge_trees navigation_plans``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import os
import sys
import time
from pathlib import Path

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from custom_interfaces.action import ExecutePlan
from custom_interfaces.msg import GoalCode
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.vehicle import VehicleClient
from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import StopSignals
from drone_navigation.steady_timer import NextTurn, steady_timer
from flight_logs.command_version import add_version
from mavbridge_trees.plan import PlanTextError, read_plan
from mavbridge_trees.plan_flight import PlanEnd, PlanFlight
from mavbridge_trees.progress import StoredProgress

EXIT_OK = 0
ACTION_NAME = "execute_plan"
# A plan's own words for what GoalCode.msg has under another name.
_NUMBERED = {"NO_SERVER": "NO_VEHICLE", "REJECTED": "INTERNAL_ERROR", "UNFINISHED": "TIMEOUT"}
_TURN_S, _SPIN_S, _STOP_S = 0.1, 0.2, 3.5


def make_parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(
        prog="navigation_plans",
        description="Offer the action execute_plan, and fly its plans with a navigation_server. "
        "For a vehicle with a namespace add --ros-args -r __ns:=/NAME.",
    )
    add_version(parser, "mavbridge_trees")
    parser.add_argument(
        "--progress",
        type=Path,
        default=Path(os.environ.get("ROS_HOME", "~/.ros")).expanduser() / "mavbridge_plans",
        metavar="FOLDER",
        help="where the progress of plans is stored (default: mavbridge_plans in $ROS_HOME)",
    )
    return parser


class PlanServer:
    """Serves `execute_plan`, one plan at a time, in the thread of a single-threaded executor."""

    def __init__(self, node: Node, folder: Path) -> None:
        """Offer the action."""
        self._node = node
        vehicle = node.get_namespace().strip("/").replace("/", "_") or "vehicle"
        self._progress = StoredProgress(folder / f"{vehicle}.json")
        self._board = ShownValues()
        self._vehicle = VehicleClient(node, node.get_namespace(), self._board, time.monotonic())
        self._is_busy = self._stops = False
        # It wakes the executor, in whose turns goals look at their plans.
        self._timer = steady_timer(node, 0.5 * _TURN_S, lambda: None)
        self._server = ActionServer(
            node,
            ExecutePlan,
            ACTION_NAME,
            execute_callback=self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    @property
    def is_idle(self) -> bool:
        """Whether no plan is flown."""
        return not self._is_busy

    def stop(self) -> None:
        """Cancel what is flown."""
        self._stops = True

    async def _execute(self, handle: ServerGoalHandle) -> ExecutePlan.Result:
        if self._is_busy or self._stops:
            code = "SHUTTING_DOWN" if self._stops else "BUSY"
            end = PlanEnd(code, "Another plan is flown." if self._is_busy else "It ends.", 0)
        else:
            self._is_busy = True
            try:
                end = await self._fly(handle)
            finally:
                self._is_busy = False
        if end.code == "SUCCESS":
            handle.succeed()
        elif end.code == "CANCELED" and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        message = f"{end.code}: {end.message}"
        self._node.get_logger().info(f"Plan ended: {message}")
        return ExecutePlan.Result(
            error_code=getattr(GoalCode, _NUMBERED.get(end.code, end.code)),
            message=message,
            steps_done=end.steps_done,
            failed_step=end.failed_step,
            success=end.code == "SUCCESS",
        )

    async def _fly(self, handle: ServerGoalHandle) -> PlanEnd:
        try:
            plan = read_plan(handle.request.plan)
        except PlanTextError as error:
            return PlanEnd("INVALID_PLAN", str(error), 0)
        first = self._progress.steps_done(plan) if handle.request.resume else 0
        if first is None:
            text = "Nothing is stored of this plan; send it without resume to begin."
            return PlanEnd("INVALID_PLAN", text, 0)
        flight = PlanFlight(
            self._node,
            self._vehicle,
            self._board,
            plan,
            first,
            self._progress,
            handle.publish_feedback,
            time.monotonic(),
        )
        due_s, is_over = 0.0, False
        try:
            while flight.end is None:
                now = time.monotonic()
                if (handle.is_cancel_requested or self._stops) and not is_over:
                    is_over = True
                    code = "CANCELED" if handle.is_cancel_requested else "SHUTTING_DOWN"
                    flight.interrupt(code, "The plan was cancelled; the vehicle holds.", now)
                if now >= due_s:
                    due_s = now + _TURN_S
                    flight.turn(now)
                await NextTurn()
        finally:
            flight.close()
        return flight.end


def main(args: list[str] | None = None) -> int:
    """Serve until a signal; return the exit code."""
    return run_program("navigation_plans", args, _main, EXIT_OK)


def _main(argv: list[str]) -> int:
    options = make_parser().parse_args(own_arguments(argv))
    signals = StopSignals("navigation_plans")
    with starting_ros():
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        with starting_ros():
            node = Node("navigation_plans")
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        server = PlanServer(node, options.progress)
        node.get_logger().info(f"Ready for plans, which are stored in {options.progress}")
        while not signals.is_requested:
            executor.spin_once(timeout_sec=_SPIN_S)
        server.stop()
        until_s = time.monotonic() + _STOP_S
        while not server.is_idle and time.monotonic() < until_s:
            executor.spin_once(timeout_sec=_SPIN_S)
        executor.shutdown(timeout_sec=1.0)
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    signals.finish(EXIT_OK)
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
