"""The flight of ``make demo-nav2``: goals as Nav2's clients send them."""

from __future__ import annotations

import time
from typing import TypeAlias

import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import FollowWaypoints, NavigateToPose
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from drone_navigation.processes import ProcessError

_Feedback: TypeAlias = NavigateToPose.Impl.FeedbackMessage | FollowWaypoints.Impl.FeedbackMessage
_READY_TIMEOUT_S = 20.0
_GOAL_TIMEOUT_S = 180.0
_SPIN_S = 0.2
# Two-dimensional, as RViz and the examples of Nav2 send them.
_POSE = (15.0, 5.0)
_WAYPOINTS = ((15.0, -5.0), (5.0, -5.0), (0.0, 0.0))


def fly() -> bool:
    """Fly a pose and waypoints; return whether both goals succeed."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("demo_nav2")
    try:
        pose = NavigateToPose.Goal(pose=_pose(_POSE))
        waypoints = FollowWaypoints.Goal(poses=[_pose(place) for place in _WAYPOINTS])
        arrived = _send(node, NavigateToPose, "navigate_to_pose", pose)
        followed = arrived and _send(node, FollowWaypoints, "follow_waypoints", waypoints)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return followed


def _pose(place: tuple[float, float]) -> PoseStamped:
    pose = PoseStamped()
    pose.header.frame_id = "map"
    pose.pose.position.x, pose.pose.position.y = place
    return pose


def _spin(node: Node, future: Future, timeout_s: float) -> None:
    """Spin until an answer is there; an interrupt is seen after a short wait."""
    until_s = time.monotonic() + timeout_s
    while not future.done() and time.monotonic() < until_s:
        rclpy.spin_once(node, timeout_sec=_SPIN_S)


def _send(
    node: Node,
    kind: type[NavigateToPose | FollowWaypoints],
    name: str,
    goal: NavigateToPose.Goal | FollowWaypoints.Goal,
) -> bool:
    """Send a goal, print its feedback once a second, and return whether it succeeds."""
    client = ActionClient(node, kind, name)
    if not client.wait_for_server(_READY_TIMEOUT_S):
        raise ProcessError(f"Nobody offers {name}.")
    printed_s = 0.0

    def tell(message: _Feedback) -> None:
        nonlocal printed_s
        now_s, feedback = time.monotonic(), message.feedback
        if now_s < printed_s + 1.0:
            return
        printed_s = now_s
        if isinstance(feedback, FollowWaypoints.Feedback):
            print(f"  waypoint {feedback.current_waypoint + 1}", flush=True)
        else:
            place = feedback.current_pose.pose.position
            print(
                f"  at ({place.x:.1f}, {place.y:.1f}, {place.z:.1f}) m, "
                f"{feedback.distance_remaining:.1f} m left",
                flush=True,
            )

    print(f"Sending a goal to {name}", flush=True)
    sent = client.send_goal_async(goal, feedback_callback=tell)
    _spin(node, sent, _READY_TIMEOUT_S)
    handle = sent.result()
    if handle is None or not handle.accepted:
        raise ProcessError(f"{name} did not accept the goal.")
    future = handle.get_result_async()
    _spin(node, future, _GOAL_TIMEOUT_S)
    if not future.done():
        raise ProcessError(f"{name} did not end within {_GOAL_TIMEOUT_S:g} s.")
    end = future.result()
    succeeded = bool(end.status == GoalStatus.STATUS_SUCCEEDED)
    print(f"{name}: {'SUCCEEDED' if succeeded else end.result.error_msg}", flush=True)
    return succeeded
