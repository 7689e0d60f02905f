"""Feedback and status of recorded goals as ROS action topics, as rosbag2 records them."""

from __future__ import annotations

from dataclasses import dataclass

from action_msgs.msg import GoalStatus, GoalStatusArray
from rclpy.qos import QoSProfile, qos_profile_action_status_default

from drone_navigation.bag.topics import BagNode
from drone_navigation.qos import RESULT_TIMEOUT_S
from drone_navigation.server.actions import ACTIONS, ActionKind
from drone_navigation.server.frame_names import FrameNames
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_bridge.goals.lifecycle import GoalState

_FEEDBACK_QOS = QoSProfile(depth=10)
_KINDS = {kind.name: kind for kind in ACTIONS}
_STATUSES = {state: getattr(GoalStatus, f"STATUS_{state.name}") for state in GoalState}
_UUID_BYTES = 16


@dataclass
class _Goal:
    kind: ActionKind
    status: GoalStatus
    ended_ns: int | None = None


class BagGoals:
    """Writes the topics of actions; an action without goals has none.

    A recording doesn't say when a cancel was accepted: CANCELING comes just before CANCELED.
    """

    def __init__(self, node: BagNode, frames: FrameNames) -> None:
        """Write as the vehicle's ``node``, with its frames."""
        self._node = node
        self._frames = frames
        self._goals: dict[tuple[str, str], _Goal] = {}

    def accept(self, goal_id: str, action: str) -> None:
        """Start a goal; one whose id or action is incomplete in the recording is skipped."""
        uuid = _uuid(goal_id)
        kind = _KINDS.get(action)
        if uuid is None or kind is None or (action, goal_id) in self._goals:
            return
        status = GoalStatus()
        status.goal_info.goal_id.uuid = uuid
        status.goal_info.stamp = self._node.get_clock().now().to_msg()
        goal = self._goals[action, goal_id] = _Goal(kind, status)
        self._enter(goal, GoalState.ACCEPTED)
        self._enter(goal, GoalState.EXECUTING)

    def feedback(self, feedback: GoalFeedback) -> None:
        """Write a goal's feedback."""
        goal = self._goals.get((feedback.action, feedback.goal_id))
        if goal is None or goal.ended_ns is not None:
            return
        kind = goal.kind
        message = kind.type.Impl.FeedbackMessage()
        message.goal_id = goal.status.goal_info.goal_id
        stamp = self._node.get_clock().now().to_msg()
        kind.feedback(message.feedback, feedback, stamp, self._frames.map)
        self._publish(kind, "feedback", type(message), message, _FEEDBACK_QOS)

    def finish(self, finished: GoalFinished) -> None:
        """Write a goal's end."""
        goal = self._goals.get((finished.action, finished.goal_id))
        if goal is None or goal.ended_ns is not None:
            return
        if finished.state is GoalState.CANCELED:
            self._enter(goal, GoalState.CANCELING)
        goal.ended_ns = self._node.get_clock().unix_ns
        self._enter(goal, finished.state)

    def _enter(self, goal: _Goal, state: GoalState) -> None:
        """Write the status of all goals that the action server still keeps."""
        goal.status.status = _STATUSES[state]
        oldest_ns = self._node.get_clock().unix_ns - RESULT_TIMEOUT_S * 10**9
        self._goals = {
            key: known
            for key, known in self._goals.items()
            if known.ended_ns is None or known.ended_ns >= oldest_ns
        }
        listed = [known.status for known in self._goals.values() if known.kind is goal.kind]
        message = GoalStatusArray(status_list=listed)
        self._publish(
            goal.kind, "status", GoalStatusArray, message, qos_profile_action_status_default
        )

    def _publish(
        self, kind: ActionKind, topic: str, message_type: type, message: object, qos: QoSProfile
    ) -> None:
        name = f"{kind.name}/_action/{topic}"
        self._node.create_publisher(message_type, name, qos).publish(message)


def _uuid(goal_id: str) -> list[int] | None:
    try:
        uuid = list(bytes.fromhex(goal_id))
    except ValueError:
        return None
    return uuid if len(uuid) == _UUID_BYTES else None
