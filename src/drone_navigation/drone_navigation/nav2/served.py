"""Action servers with Nav2's names."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Protocol, TypeAlias

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from drone_navigation.nav2.outcomes import Nav2Outcome, Nav2Result, aborted, result
from drone_navigation.nav2.targets import TargetError
from drone_navigation.qos import RESULT_TIMEOUT_S

GoalEnd: TypeAlias = tuple[Nav2Outcome, Nav2Result | None]
"""The end of a goal, and its result message or None for one with nothing more"""
Run: TypeAlias = Callable[[ServerGoalHandle], Awaitable[GoalEnd]]
"""Executes a goal"""


class Nav2Action(Protocol):
    """The type of an action."""

    @property
    def Result(self) -> type[Nav2Result]:  # noqa: N802 - the name that ROS gives it
        """Its result message."""


def duration(seconds: float) -> Duration:
    """Return a duration, at least zero."""
    whole, part = divmod(max(seconds, 0.0), 1.0)
    return Duration(sec=min(int(whole), 2**31 - 1), nanosec=int(1e9 * part))


def serve(node: Node, kind: Nav2Action, name: str, run: Run) -> None:
    """Offer an action that accepts each goal; one that cannot be done is aborted with a sentence.

    A rejected goal would have no result to carry the reason.
    """

    async def execute(handle: ServerGoalHandle) -> Nav2Result:
        try:
            outcome, message = await run(handle)
        except TargetError as error:
            outcome, message = aborted(*error.refusal), None
        except Exception as error:  # a goal must end, whatever happens
            node.get_logger().error(f"{name} failed: {error!r}")
            outcome, message = aborted("INTERNAL_ERROR", repr(error)), None
        if message is None:
            message = result(kind.Result, outcome)
        if outcome.status == GoalStatus.STATUS_SUCCEEDED:
            handle.succeed()
            node.get_logger().info(f"{name} succeeded")
        elif outcome.status == GoalStatus.STATUS_CANCELED and handle.is_cancel_requested:
            handle.canceled()
            node.get_logger().info(f"{name} canceled")
        else:
            handle.abort()
            node.get_logger().warning(f"{name} aborted. {outcome.message}")
        return message

    ActionServer(
        node,
        kind,
        name,
        execute_callback=execute,
        cancel_callback=lambda _handle: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
        result_timeout=RESULT_TIMEOUT_S,
    )
