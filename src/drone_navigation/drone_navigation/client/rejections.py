"""Reasons of rejected goals, as the server reports them to everybody, by the ids of the goals."""

from __future__ import annotations

from typing import NamedTuple

from rclpy.node import Node

from custom_interfaces.msg import GoalEvent, GoalRejected
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME

__all__ = ["Reason", "Rejections"]

_KEPT = 100


class Reason(NamedTuple):
    """Why a goal was rejected.

    Attributes:
        code: a name of GoalCode.msg.
        sentence: for people.
    """

    code: str
    sentence: str


class Rejections:
    """The reasons that a node has heard, usually before the rejection itself.

    Of two topics: the one has the last reason for who comes late, the other has all.
    """

    def __init__(self, node: Node) -> None:
        """Listen."""
        self._reasons: dict[str, Reason] = {}
        node.create_subscription(
            GoalRejected, f"{SERVER_NODE_NAME}/goal_rejected", self._hear_last, LATCHED_QOS
        )
        node.create_subscription(
            GoalEvent, f"{SERVER_NODE_NAME}/goal_events", self._hear_event, STREAM_QOS
        )

    def of(self, goal_id: str) -> Reason | None:
        """Return the reason for a goal, by its id in hexadecimal digits; None while unknown."""
        return self._reasons.get(goal_id)

    def _hear_last(self, message: GoalRejected) -> None:
        self._keep(message.goal_id, Reason(message.code, message.message))

    def _hear_event(self, message: GoalEvent) -> None:
        if message.event == GoalEvent.REJECTED:
            sentence = message.message.removeprefix(f"{message.what}: ")
            self._keep(message.goal_id, Reason(message.what, sentence))

    def _keep(self, goal_id: str, reason: Reason) -> None:
        self._reasons[goal_id] = reason
        while len(self._reasons) > _KEPT:
            self._reasons.pop(next(iter(self._reasons)))
