"""Leaves of a behaviour tree (py_trees), one for each action of the server.

A leaf sends its goal when it is entered, runs while that is flown, and ends as it does. A leaf that
is left earlier cancels its goal. All leaves take the node that they speak through from
`tree.setup(node=node)`; what the server answers comes while that node spins.
"""

from __future__ import annotations

import math
import time
import uuid
from collections.abc import Sequence
from typing import Any, ClassVar
from weakref import WeakKeyDictionary

from py_trees.behaviour import Behaviour
from py_trees.blackboard import Client
from py_trees.common import Access, Status
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger
from unique_identifier_msgs.msg import UUID

from custom_interfaces.action import (
    Follow,
    Land,
    Navigate,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import Waypoint
from drone_navigation.client.rejections import Rejections
from drone_navigation.programs import goal_messages
from navigation_bridge.names import (
    ACTION_NAME,
    FOLLOW_ACTION_NAME,
    LAND_ACTION_NAME,
    ORBIT_ACTION_NAME,
    RETURN_ACTION_NAME,
    SERVER_NODE_NAME,
    TAKEOFF_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)
from navigation_core.geometry import Vector3

__all__ = [
    "LAST_END",
    "FlyOrbit",
    "FlyRoute",
    "FollowPoses",
    "GoTo",
    "GoalLeaf",
    "HoldFor",
    "LandHere",
    "Photo",
    "Return",
    "TakeOff",
]

LAST_END = "last_end"
"""Key of the blackboard: the code of the goal that ended last, as in GoalCode.msg, or NO_SERVER"""

SERVER_TIMEOUT_S = 10.0
"""For so long the server is waited for, and its answer to a goal"""
_REASON_S = 1.0
"""The reason of a rejection comes by a topic, beside the answer"""


# One for all leaves of a node.
_REJECTIONS: WeakKeyDictionary[Node, Rejections] = WeakKeyDictionary()


class GoalLeaf(Behaviour):
    """A goal of one action.

    Attributes:
        feedback: the newest of its goal, or None.
        code: of its end or rejection; empty before.
        feedback_message: the sentence of its end or rejection, or what it does.
    """

    action: ClassVar[Any]
    action_name: ClassVar[str]

    def __init__(self, name: str, goal: Any) -> None:
        """Prepare.

        Args:
            name: of the leaf.
            goal: what is sent, of the action's own type.
        """
        super().__init__(name)
        self._goal = goal
        self._client: ActionClient | None = None
        self._sent: Future | None = None
        self._handle: ClientGoalHandle | None = None
        self._result: Future | None = None
        self._since_s = 0.0
        self._rejections: Rejections | None = None
        self._goal_id = ""
        self.feedback: Any = None
        self.code = ""
        self._board = Client(name=f"{name} {id(self):x}")
        self._board.register_key(LAST_END, access=Access.WRITE)

    def setup(self, **kwargs: Any) -> None:
        """Take the ``node`` that it speaks through."""
        node: Node = kwargs["node"]
        self._client = ActionClient(node, self.action, self.action_name)
        if node not in _REJECTIONS:
            _REJECTIONS[node] = Rejections(node)
        self._rejections = _REJECTIONS[node]

    def initialise(self) -> None:
        """Begin: the goal is sent with the first tick at which the server is there."""
        self._sent = self._result = self._handle = self.feedback = None
        self.code, self.feedback_message = "", ""
        self._since_s = time.monotonic()

    def update(self) -> Status:
        """Return RUNNING until the goal has ended, then whether it succeeded."""
        client, rejections = self._client, self._rejections
        if client is None or rejections is None:
            raise RuntimeError(f"The leaf {self.name!r} was not set up: tree.setup(node=node).")
        if self._sent is None:
            if not client.server_is_ready():
                return self._wait(f"There is no server of {self.action_name}.")
            number, self._since_s = uuid.uuid4(), time.monotonic()
            self._goal_id = number.hex
            self._sent = client.send_goal_async(
                self._goal, feedback_callback=self._hear, goal_uuid=UUID(uuid=list(number.bytes))
            )
        if self._handle is None:
            if not self._sent.done():
                return self._wait("The server did not answer.")
            self._handle, self._since_s = self._sent.result(), time.monotonic()
            if self._handle.accepted:
                self._result = self._handle.get_result_async()
        if self._result is None:
            reason = rejections.of(self._goal_id)
            if reason is not None:
                return self._end(reason.code, f"{reason.code}: {reason.sentence}")
            late = time.monotonic() - self._since_s > _REASON_S
            return self._end("REJECTED", "The goal was rejected.") if late else Status.RUNNING
        if not self._result.done():
            # An active goal has feedback at least once a second.
            text = f"The server has been silent for {SERVER_TIMEOUT_S:g} s; it may have ended."
            return self._wait(f"{text} What became of the goal is unknown.")
        result = self._result.result().result
        return self._end(result.message.partition(":")[0], result.message, bool(result.success))

    def terminate(self, new_status: Status) -> None:
        """Cancel the goal of a leaf that is left before it has ended."""
        if new_status is Status.INVALID and self._sent is not None and not self.code:
            self._sent.add_done_callback(_cancel)
            self.code = "CANCELED"

    def _hear(self, message: Any) -> None:
        self.feedback, self._since_s = message.feedback, time.monotonic()

    def _wait(self, without: str) -> Status:
        """HoldFor for the server; end with a sentence when that takes too long."""
        late = time.monotonic() - self._since_s > SERVER_TIMEOUT_S
        return self._end("NO_SERVER", without) if late else Status.RUNNING

    def _end(self, code: str, message: str, succeeded: bool = False) -> Status:
        self.code, self.feedback_message = code, message
        self._board.set(LAST_END, code)
        return Status.SUCCESS if succeeded else Status.FAILURE


def _cancel(sent: Future) -> None:
    handle = sent.result()
    if handle is not None and handle.accepted:
        handle.cancel_goal_async()


class TakeOff(GoalLeaf):
    """Arms if need be, takes off, and holds at a height above the ground, m; 0: the server's."""

    action, action_name = Takeoff, TAKEOFF_ACTION_NAME

    def __init__(self, height_m: float = 0.0, name: str = "take off") -> None:
        """Prepare."""
        super().__init__(name, Takeoff.Goal(height=height_m))


class GoTo(GoalLeaf):
    """Flies to a place, m, in a frame of Navigate.action, and faces the way."""

    action, action_name = Navigate, ACTION_NAME

    def __init__(
        self,
        position_m: Vector3,
        speed_m_s: float = 0.0,
        avoid_obstacles: bool = False,
        frame: str = Navigate.Goal.FRAME_MAP,
        name: str = "go to",
    ) -> None:
        """Prepare."""
        goal = goal_messages.point(position_m, frame, None, speed_m_s, avoid_obstacles)
        super().__init__(name, goal.goal)


class FlyRoute(GoalLeaf):
    """Flies waypoints one after another."""

    action, action_name = NavigateWaypoints, WAYPOINTS_ACTION_NAME

    def __init__(
        self,
        waypoints: Sequence[Waypoint],
        speed_m_s: float = 0.0,
        avoid_obstacles: bool = False,
        name: str = "fly route",
    ) -> None:
        """Prepare."""
        goal = NavigateWaypoints.Goal(
            waypoints=list(waypoints), max_speed=speed_m_s, avoid_obstacles=avoid_obstacles
        )
        super().__init__(name, goal)


class FlyOrbit(GoalLeaf):
    """Flies laps around a point of the map, m; a negative radius is clockwise."""

    action, action_name = Orbit, ORBIT_ACTION_NAME

    def __init__(
        self,
        centre_enu_m: tuple[float, float],
        radius_m: float,
        laps: float = 1.0,
        height_m: float = float("nan"),
        speed_m_s: float = 0.0,
        avoid_obstacles: bool = False,
        name: str = "orbit",
    ) -> None:
        """Prepare."""
        kept_m = None if math.isnan(height_m) else height_m
        goal = goal_messages.orbit(
            centre_enu_m, radius_m, kept_m, laps, speed_m_s, "centre", avoid_obstacles
        )
        super().__init__(name, goal.goal)


class FollowPoses(GoalLeaf):
    """Follows the poses of a topic."""

    action, action_name = Follow, FOLLOW_ACTION_NAME

    def __init__(self, goal: Follow.Goal, name: str = "follow") -> None:
        """Prepare."""
        super().__init__(name, goal)


class LandHere(GoalLeaf):
    """Lands where the vehicle is."""

    action, action_name = Land, LAND_ACTION_NAME

    def __init__(self, name: str = "land") -> None:
        """Prepare."""
        super().__init__(name, Land.Goal())


class Return(GoalLeaf):
    """Returns to the launch point, where a copter lands."""

    action, action_name = ReturnToLaunch, RETURN_ACTION_NAME

    def __init__(self, name: str = "return") -> None:
        """Prepare."""
        super().__init__(name, ReturnToLaunch.Goal())


class Photo(Behaviour):
    """Takes a photo."""

    def __init__(self, name: str = "photo") -> None:
        """Prepare."""
        super().__init__(name)
        self._node: Node | None = None
        self._answer: Future | None = None
        self._entered_s = 0.0

    def setup(self, **kwargs: Any) -> None:
        """Take the ``node`` that it speaks through."""
        node: Node = kwargs["node"]
        self._node = node
        self._service = node.create_client(Trigger, f"{SERVER_NODE_NAME}/trigger_camera")

    def initialise(self) -> None:
        """Begin."""
        self._answer, self._entered_s = None, time.monotonic()

    def update(self) -> Status:
        """Return RUNNING until the server has answered, then whether there is a photo."""
        late = time.monotonic() - self._entered_s > SERVER_TIMEOUT_S
        if self._answer is None:
            if self._service.service_is_ready():
                self._answer = self._service.call_async(Trigger.Request())
        elif self._answer.done():
            answer = self._answer.result()
            self.feedback_message = answer.message
            return Status.SUCCESS if answer.success else Status.FAILURE
        if late:
            self.feedback_message = "The server did not answer."
        return Status.FAILURE if late else Status.RUNNING


class HoldFor(Behaviour):
    """Lets a time pass, in which the vehicle holds."""

    def __init__(self, seconds: float, name: str = "wait") -> None:
        """Prepare."""
        super().__init__(name)
        self._seconds = seconds
        self._until_s = 0.0

    def initialise(self) -> None:
        """Begin."""
        self._until_s = time.monotonic() + self._seconds

    def update(self) -> Status:
        """Return RUNNING until the time has passed."""
        return Status.SUCCESS if time.monotonic() >= self._until_s else Status.RUNNING
