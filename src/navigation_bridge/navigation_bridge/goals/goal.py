"""One accepted goal and the outputs of the bridge about goals. No ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeAlias

from mavlink_vehicle.codec import Message
from navigation_bridge.goals.lifecycle import (
    TERMINAL_STATES,
    GoalEvent,
    GoalState,
    next_state,
    terminal_event,
)
from navigation_bridge.goals.log_outputs import LogOutput
from navigation_bridge.goals.mission_plan import MissionTracker
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_bridge.vehicle.takeover import Takeover
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Outcome, Perform
from navigation_core.tasks.observation import OperationReport
from navigation_core.tasks.progress import Progress, RouteProgress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.task import Task


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
        replans: number of replans because of obstacles.
        late_s: the worst delay of a setpoint in the last seconds.
        action: name of the goal's action; ids are unique within one action only.
    """

    goal_id: str
    pose: MapPose | None
    distance_remaining_m: float
    time_remaining_s: float
    battery_remaining: float | None
    status: Status
    height_m: float | None = None
    route: RouteProgress | None = None
    replans: int = 0
    late_s: float = 0.0
    action: str = ""


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
    action: str = ""


@dataclass(frozen=True)
class GoalRejected:
    """A goal was rejected before acceptance."""

    rejection: Rejection

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
        number: number passed to :meth:`Bridge.serve`.
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
        goal_id: UUID as hexadecimal digits; empty for a rejected goal.
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
    | LogOutput
)


@dataclass
class Yielded:
    """A vehicle stopped by a ground station in another mode; nothing is sent to it.

    Attributes:
        since_s: since when.
        stopped: whether it has come to rest.
    """

    since_s: float
    stopped: Standstill


@dataclass
class PositionDoubt:
    """A doubt about the vehicle's position while a goal is flown.

    Attributes:
        jumps_ned_m: sum of the position's jumps before the goal began, north and east.
        since_s: start of the doubt; None while there is none.
        reasons: the latest reason by the report that shows it.
    """

    jumps_ned_m: tuple[float, float] = (0.0, 0.0)
    since_s: float | None = None
    reasons: dict[type, str] = field(default_factory=dict)


@dataclass
class ActiveGoal:
    """An accepted goal that has not ended, with its task and timers.

    Attributes:
        goal_id: UUID as hexadecimal digits.
        description: what it aims at, for the log.
        target_enu_m: the target in the map frame; None when the vehicle decides.
        task: the task that flies it.
        accepted_s: time of acceptance.
        next_step_s: time of the next step of the task.
        think_s: time from which the task may think; infinite until its next setpoint is sent.
        feedback_due_s: time from which the next position triggers feedback.
        state: state of its life cycle.
        status: last status; the one reported while the link is lost.
        cancel_requested_s: time of the first cancel, or None.
        closing: the outcome that a commanded stop ends in instead of CANCELED.
        asked: the last operation that the task requested.
        operation: its state; None once the task knows the result.
        operation_id: the vehicle's number for it.
        setpoint_s: time of the last setpoint, or None.
        notes: sentences that are added to the final message.
        progress: the last progress, or None.
        mission: tracks the mission that was uploaded for it, or None.
        path_enu_m: the path that was last reported.
        plan: the straight legs that the server flies; None if the vehicle decides.
        takeover: a mode change that ends it once its origin is clear, or None.
        cancelled_by: sentence about the ground station that cancelled it; empty if none did.
        cancelled_by_pause: whether that ground station only stopped the vehicle.
        paused_by: the same about one that paused it, until it is resumed.
        paused_by_client: whether the pause service has paused it.
        yielded: set while the vehicle is left alone because a ground station made it hold.
        kind: name of its action.
        follows_commands: whether it follows velocity commands.
        doubt: doubt about the vehicle's position.
    """

    goal_id: str
    description: str
    target_enu_m: Vector3 | None
    task: Task
    accepted_s: float
    next_step_s: float
    feedback_due_s: float
    think_s: float = math.inf
    state: GoalState = GoalState.ACCEPTED
    status: Status = Status.PREPARING
    cancel_requested_s: float | None = None
    closing: Outcome | None = None
    asked: Perform | None = None
    operation: OperationReport | None = None
    operation_id: int | None = None
    setpoint_s: float | None = None
    notes: list[str] = field(default_factory=list)
    progress: Progress | None = None
    mission: MissionTracker | None = None
    path_enu_m: tuple[Vector3, ...] = ()
    plan: FlightPlan | None = None
    takeover: Takeover | None = None
    cancelled_by: str = ""
    cancelled_by_pause: bool = False
    paused_by: str = ""
    paused_by_client: bool = False
    yielded: Yielded | None = None
    kind: str = ""
    follows_commands: bool = False
    doubt: PositionDoubt = field(default_factory=PositionDoubt)

    @property
    def ending(self) -> bool:
        """True while the goal is being ended: cancelled, or stopped for a reason."""
        return self.cancel_requested_s is not None or self.closing is not None

    def begin_cancel(self, now: float) -> None:
        """Have the task stop the vehicle; the goal then ends CANCELED."""
        self.apply(GoalEvent.CANCEL)
        self.cancel_requested_s = now
        self.task.cancel(now)
        self.next_step_s = min(self.next_step_s, now)

    @property
    def short_id(self) -> str:
        """The first eight digits of the goal's UUID, for messages."""
        return self.goal_id[:8]

    @property
    def finished(self) -> bool:
        """Whether the goal has ended."""
        return self.state in TERMINAL_STATES

    def apply(self, event: GoalEvent) -> None:
        """Move along the life cycle.

        Raises:
            LifecycleError: the event cannot happen in this state.
        """
        self.state = next_state(self.state, event)

    def end_of(self, outcome: Outcome) -> Outcome:
        """Return the outcome of the goal: only a client's cancel ends CANCELED."""
        if outcome.code is OutcomeCode.CANCELED and self.closing is not None:
            return self.closing
        return outcome

    def finish(
        self, outcome: Outcome, pose: MapPose | None, now: float, said: str = ""
    ) -> GoalFinished:
        """End the goal and return its result.

        Args:
            outcome: how it ended.
            pose: where the vehicle is.
            now: time.
            said: text of the autopilot that explains the end, if any.

        Raises:
            LifecycleError: the goal has ended already.
        """
        outcome = self.end_of(outcome)
        code = outcome.code
        self.apply(terminal_event(code))
        error_m = outcome.final_error_m
        if error_m is None and pose is not None and self.target_enu_m is not None:
            error_m = math.dist(pose.position_enu_m, self.target_enu_m)
        route = None if self.progress is None else self.progress.route
        words = [self.cancelled_by, outcome.message] if self.cancelled_by else [outcome.message]
        message = f"{code.value}: {' '.join([*words, *dict.fromkeys(self.notes)])}"
        if said and said not in message:
            message += f" The autopilot reported: '{said}'."
        return GoalFinished(
            goal_id=self.goal_id,
            state=self.state,
            code=code,
            message=message,
            pose=pose,
            elapsed_s=now - self.accepted_s,
            final_error_m=error_m,
            waypoints_reached=route.reached if route is not None else 0,
            waypoints_missed=route.missed if route is not None else (),
            action=self.kind,
        )
