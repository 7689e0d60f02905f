"""``ros2 action``: info and send_goal, which cancels its goal when it is ended."""

from __future__ import annotations

import argparse

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)

from drone_navigation.ros2.nodes import nodes_that_have
from drone_navigation.ros2.session import (
    CommandError,
    Interrupted,
    Session,
    absolute,
    interface,
)
from drone_navigation.ros2.values import as_yaml, filled, read_yaml

__all__ = ["info", "send_goal"]

_STATUSES = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}
# An answer to a cancel, or to a goal that is to be cancelled, is waited for so long.
_CANCEL_S = 3.0
_ENDED = "The action server has ended; what became of the goal is unknown."


def info(session: Session, options: argparse.Namespace) -> int:
    """Print which nodes are clients and servers of an action."""
    name = absolute(options.name)
    node = session.node
    session.discover(lambda: name in dict(get_action_names_and_types(node)))
    print(f"Action: {options.name}")
    for title, by_node in (
        ("clients", get_action_client_names_and_types_by_node),
        ("servers", get_action_server_names_and_types_by_node),
    ):
        found = nodes_that_have(node, name, by_node)
        print(f"Action {title}: {len(found)}")
        for who, types in () if options.count else found:
            print(f"    {who} [{', '.join(types)}]" if options.show_types else f"    {who}")
    return 0


def send_goal(session: Session, options: argparse.Namespace) -> int:
    """Send a goal, print what comes back, and return 0 if there is a result."""
    kind = interface("action", options.type)
    goal = filled(kind.Goal, read_yaml(options.values))
    client = ActionClient(session.node, kind, options.name)
    try:
        print("Waiting for an action server to become available...")
        session.wait(client.server_is_ready)
        print(f"Sending goal:\n     {as_yaml(goal)}")
        answer = client.send_goal_async(
            goal,
            (lambda message: print(f"Feedback:\n    {as_yaml(message.feedback)}"))
            if options.feedback
            else None,
        )
        try:
            session.wait_for_answer(answer, client.server_is_ready, _ENDED)
            handle = answer.result()
            if not handle.accepted:
                print("Goal was rejected.")
                return 1
            print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n")
            result = handle.get_result_async()
            session.wait_for_answer(result, client.server_is_ready, _ENDED)
        except Interrupted:
            # It may be accepted while the command ends.
            if session.wait(answer.done, _CANCEL_S) and answer.result().accepted:
                _cancel(session, answer.result())
            raise
        print(f"Result:\n    {as_yaml(result.result().result)}")
        print(f"Goal finished with status: {_STATUSES.get(result.result().status, 'UNKNOWN')}")
        return 0
    finally:
        client.destroy()


def _cancel(session: Session, handle: ClientGoalHandle) -> None:
    print("Canceling goal...")
    answer = handle.cancel_goal_async()
    if not session.wait(answer.done, _CANCEL_S):
        raise CommandError(f"The action server did not answer to the cancel in {_CANCEL_S:g} s.")
    if not answer.result().goals_canceling:
        raise CommandError("Failed to cancel goal: it has ended, or the server rejects the cancel.")
    print("Goal canceled.")
