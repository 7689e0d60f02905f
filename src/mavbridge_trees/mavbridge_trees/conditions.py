"""Conditions of a behaviour tree: the battery, the position, and how the last goal ended."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from typing import Any, ClassVar

from nav_msgs.msg import Odometry
from py_trees.behaviour import Behaviour
from py_trees.blackboard import Client
from py_trees.common import Access, Status
from rclpy.node import Node
from sensor_msgs.msg import BatteryState

from drone_navigation.qos import STREAM_QOS
from mavbridge_trees.leaves import LAST_END, SERVER_TIMEOUT_S
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.geometry import Vector3

__all__ = ["BatteryAbove", "IsNear", "LastEndWas"]


class _Heard(Behaviour):
    """A condition on a topic of the server. It runs until that was heard, and fails without it."""

    kind: ClassVar[Any]
    topic: ClassVar[str]

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._message: Any = None
        self._asked_s: float | None = None

    def setup(self, **kwargs: Any) -> None:
        """Listen through a ``node``."""
        node: Node = kwargs["node"]
        name = f"{SERVER_NODE_NAME}/{self.topic}"
        node.create_subscription(self.kind, name, self._hear, STREAM_QOS)

    def _hear(self, message: Any) -> None:
        self._message = message

    def update(self) -> Status:
        """Compare with what was heard last."""
        if self._message is not None:
            return Status.SUCCESS if self.holds(self._message) else Status.FAILURE
        now_s = time.monotonic()
        self._asked_s = now_s if self._asked_s is None else self._asked_s
        self.feedback_message = f"Nothing was heard of {self.topic}."
        late = now_s - self._asked_s > SERVER_TIMEOUT_S
        return Status.FAILURE if late else Status.RUNNING

    @abstractmethod
    def holds(self, message: Any) -> bool:
        """Return whether it holds by a message."""


class BatteryAbove(_Heard):
    """Whether more than a share of the battery, 0 to 1, remains. An unknown charge fails.

    Once it has failed it holds again above another share only, as with another battery: under load
    a charge goes up and down.
    """

    kind, topic = BatteryState, "battery"

    def __init__(self, share: float, again: float | None = None, name: str = "battery") -> None:
        """Prepare; without ``again`` one share decides."""
        super().__init__(name)
        self._share, self._again = share, share if again is None else again
        self._was_low = False

    def holds(self, message: BatteryState) -> bool:
        """See `_Heard`."""
        self.feedback_message = f"{message.percentage:.0%} of the battery"
        self._was_low = not message.percentage > (self._again if self._was_low else self._share)
        return not self._was_low


class IsNear(_Heard):
    """Whether the vehicle is within a distance of a place of the map, m."""

    kind, topic = Odometry, "odometry"

    def __init__(self, position_enu_m: Vector3, within_m: float, name: str = "near") -> None:
        """Prepare."""
        super().__init__(name)
        self._place, self._within_m = position_enu_m, within_m

    def holds(self, message: Odometry) -> bool:
        """See `_Heard`."""
        at = message.pose.pose.position
        distance_m = math.dist((at.x, at.y, at.z), self._place)
        self.feedback_message = f"{distance_m:.1f} m away"
        return distance_m <= self._within_m


class LastEndWas(Behaviour):
    """Whether the goal that ended last has one of some codes of GoalCode.msg."""

    def __init__(self, *codes: str, name: str = "last end") -> None:
        """Prepare."""
        super().__init__(name)
        self._codes = codes
        self._board = Client(name=f"{name} {id(self):x}")
        self._board.register_key(LAST_END, access=Access.READ)

    def update(self) -> Status:
        """Compare."""
        last = self._board.get(LAST_END) if self._board.exists(LAST_END) else ""
        self.feedback_message = last
        return Status.SUCCESS if last in self._codes else Status.FAILURE
