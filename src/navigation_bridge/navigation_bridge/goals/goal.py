"""Outputs of the bridge about goals. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from mavlink_vehicle.codec import Message
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.progress import (
    FollowProgress,
    OrbitProgress,
    RouteProgress,
    Status,
    TrajectoryProgress,
)


class LogLevel(Enum):
    """Severity of a log line, as rclpy names it."""

    INFO = "info"
    WARN = "warn"
    ERROR = "error"


@dataclass(frozen=True)
class GoalFeedback:
    """Progress of a goal.

    Attributes:
        goal_id: UUID of the goal as hexadecimal digits.
        pose: vehicle's pose in the map frame; None before there is one.
        distance_remaining_m: remaining distance along the path.
        time_remaining_s: estimated time to the end of the goal; always finite.
        battery_remaining: fraction from 0 to 1; None if not reported.
        status: current activity.
        height_m: height above the ground; None while unknown.
        route: progress along the route, for a goal with a route.
        orbit: progress on the circle, for a goal that has one.
        follow: how a target is followed, for a goal that has one.
        replans: number of replans because of obstacles.
        late_s: the worst delay of a setpoint in the last seconds.
        velocity_enu_m_s: velocity over ground, in the map frame; None while unknown.
        limited_by: why it does less than it is commanded to; empty if it does not.
        action: name of the goal's action; ids are unique within one action only.
        trajectory: how a trajectory is flown, for a goal that has one.
    """

    goal_id: str
    pose: MapPose | None
    distance_remaining_m: float
    time_remaining_s: float
    battery_remaining: float | None
    status: Status
    height_m: float | None = None
    route: RouteProgress | None = None
    orbit: OrbitProgress | None = None
    follow: FollowProgress | None = None
    replans: int = 0
    late_s: float = 0.0
    velocity_enu_m_s: Vector3 | None = None
    limited_by: str = ""
    action: str = ""
    trajectory: TrajectoryProgress | None = None


@dataclass(frozen=True)
class GoalFinished:
    """The result of a goal.

    Attributes:
        goal_id: UUID of the goal as hexadecimal digits.
        state: terminal state of the action goal.
        code: stable reason.
        message: "CODE: sentence".
        pose: last known pose in the map frame, or None.
        elapsed_s: time since the goal was accepted.
        final_error_m: measured distance to the target; None when it could not be measured.
        waypoints_reached: for a route, how many waypoints were reached, all laps counted.
        waypoints_missed: for a route, those passed outside their radius, from 0 over all laps.
        next_index: for a route, the first waypoint that is left, from 0 over all laps.
        route_id: for a route, a number that others would not have; 0 for other goals.
        laps_flown: for a circle, how many laps were flown.
        action: name of the goal's action; ids are unique within one action only.
    """

    goal_id: str
    state: GoalState
    code: OutcomeCode
    message: str
    pose: MapPose | None
    elapsed_s: float
    final_error_m: float | None
    waypoints_reached: int = 0
    waypoints_missed: tuple[int, ...] = ()
    next_index: int = 0
    route_id: int = 0
    laps_flown: float = 0.0
    action: str = ""


@dataclass(frozen=True)
class GoalRejected:
    """A goal was rejected before acceptance.

    Attributes:
        rejection: why.
        goal_id: UUID as hexadecimal digits; empty if it is not known.
    """

    rejection: Rejection
    goal_id: str = ""

    @property
    def text(self) -> str:
        """Return the reason as "CODE: sentence"."""
        return f"{self.rejection.code.value}: {self.rejection.message}"


@dataclass(frozen=True)
class LogLine:
    """A line for the server's log."""

    level: LogLevel
    text: str


@dataclass(frozen=True)
class Annotation:
    """A message for the recording only, about ROS-side events."""

    message: Message


@dataclass(frozen=True)
class ServiceDone:
    """Response to a service request that waited for the vehicle.

    Attributes:
        number: number passed to :meth:`ClientServices.serve`.
        success: whether the vehicle obeyed.
        message: a sentence.
    """

    number: int
    success: bool
    message: str


@dataclass(frozen=True)
class GoalHappened:
    """Event in the life cycle of a goal, for observers.

    Attributes:
        goal_id: UUID as hexadecimal digits; empty for a rejected goal in older recordings.
        event: "ACCEPTED", "REJECTED", "STATUS" or "ENDED", as in GoalEvent.msg.
        what: the new status, or the code; empty for ACCEPTED.
        message: for people.
    """

    goal_id: str
    event: str
    what: str
    message: str


@dataclass(frozen=True)
class PlanChanged:
    """A new planned path, or the end of the last one.

    Attributes:
        path_enu_m: points of the path in the map frame; empty if there is none.
    """

    path_enu_m: tuple[Vector3, ...]


@dataclass(frozen=True)
class CancelWanted:
    """A ground station has cancelled a goal; the action must be cancelled as well.

    Attributes:
        goal_id: UUID of the goal as hexadecimal digits.
        action: name of the goal's action; ids are unique within one action only.
    """

    goal_id: str
    action: str = ""


Output: TypeAlias = (
    GoalFeedback
    | CancelWanted
    | GoalFinished
    | GoalRejected
    | GoalHappened
    | PlanChanged
    | LogLine
    | Annotation
    | ServiceDone
)
