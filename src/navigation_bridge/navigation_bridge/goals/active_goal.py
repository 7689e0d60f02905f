"""An accepted goal: its record, which only its own events write. No ROS."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.goals.admitted import FlightPlan
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.goal_operation import GoalAct, GoalOperation
from navigation_bridge.goals.lifecycle import (
    GoalEvent,
    GoalState,
    next_state,
    terminal_event,
)
from navigation_bridge.goals.mission_plan import MissionTracker
from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_bridge.vehicle.takeover import Takeover
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.observation import OperationStatus
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.task import Task

__all__ = ["ActiveGoal", "GoalLease", "GoalTimes", "PositionDoubt", "Yielded"]

# Period of what is watched less often than setpoints are sent.
_GUARD_PERIOD_S = 0.5


@dataclass
class GoalTimes:
    """The times of one goal, in seconds.

    Attributes:
        next_step_s: of the next step of the task.
        feedback_due_s: from which the next position triggers feedback.
        replan_s: from which the task may replan; infinite until its next setpoint is sent.
        guard_s: of the next look at what is watched twice a second.
        setpoint_s: of the last setpoint, or None.
    """

    next_step_s: float
    feedback_due_s: float
    replan_s: float = math.inf
    guard_s: float = -math.inf
    setpoint_s: float | None = None

    def due(self, now: float) -> None:
        """Have the task step at once."""
        self.next_step_s = min(self.next_step_s, now)

    def step_begins(self, period_s: float, now: float) -> None:
        """Set the time of the next step: the first after ``now`` on the grid of the last one."""
        following = self.next_step_s + period_s
        if following <= now:
            periods = math.floor((now - self.next_step_s) / period_s) + 1
            following = self.next_step_s + periods * period_s
        self.next_step_s = following

    def replan_begins(self) -> None:
        """The task replans; not again before its next setpoint is out."""
        self.replan_s = math.inf

    def setpoint_sent(self, may_replan: bool, now: float) -> None:
        """A setpoint of the task is out; the next turn is for a task that may replan."""
        self.setpoint_s = now
        if may_replan:
            self.replan_s = now

    def guard_begins(self, now: float) -> None:
        """Set the time of the next look at what is watched less often."""
        self.guard_s = now + _GUARD_PERIOD_S

    def feedback_given(self, period_s: float, now: float) -> None:
        """Set the time of the next feedback.

        It counts from now, not on a grid, so that feedback keeps in step with the positions.
        """
        self.feedback_due_s = now + period_s


@dataclass
class GoalLease:
    """Whether the client of a goal is still there.

    Attributes:
        renewed_s: when it was last heard; None if it has asked for no lease.
    """

    renewed_s: float | None = None

    def renew(self, now: float) -> None:
        """The client was heard, and wants the goal ended once it is not heard any more."""
        self.renewed_s = now


@dataclass
class Yielded:
    """A vehicle stopped by a ground station in another mode; nothing is sent to it.

    Attributes:
        since_s: since when.
        stopped: whether it has come to rest.
    """

    since_s: float
    stopped: Standstill


@dataclass(frozen=True)
class PositionDoubt:
    """A doubt about the vehicle's position while a goal is flown.

    Attributes:
        jumps_ned_m: sum of the position's jumps before the goal began, north and east.
        since_s: start of the doubt; None while there is none.
        reasons: the latest reason by the report that shows it.
    """

    jumps_ned_m: tuple[float, float] = (0.0, 0.0)
    since_s: float | None = None
    reasons: Mapping[type, str] = field(default_factory=dict)

    def summary(self, accepted_s: float, now: float) -> str:
        """Return duration, start and reasons of the doubt in a sentence; empty without one."""
        if self.since_s is None:
            return ""
        return (
            f"The position was in doubt for {now - self.since_s:.1f} s, starting at "
            f"{self.since_s - accepted_s:.0f} s ({'; '.join(self.reasons.values())})."
        )


@dataclass
class ActiveGoal:
    """An accepted goal that has not ended, with its task and timers.

    Only its own methods write it, one for each event in its life.

    Attributes:
        goal_id: UUID as hexadecimal digits.
        description: what it aims at, for the log.
        target_enu_m: the target in the map frame; None when the vehicle decides.
        task: the task that flies it.
        accepted_s: time of acceptance.
        times: when something is due for it.
        state: state of its life cycle.
        status: last status; the one reported while the link is lost.
        cancel_requested_s: time of the first cancel, or None.
        closing: the outcome that a commanded stop ends in instead of CANCELED.
        operation: the operation of the vehicle that the task has asked for.
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
        followed: source of the target that it follows, or None.
        doubt: doubt about the vehicle's position.
        facts: what rules remember, by name of the rule.
        act: the act that the task has asked for.
        lease: when its client was heard, if the client wants it ended with itself.
    """

    goal_id: str
    description: str
    target_enu_m: Vector3 | None
    task: Task
    accepted_s: float
    times: GoalTimes
    operation: GoalOperation
    state: GoalState = GoalState.ACCEPTED
    status: Status = Status.PREPARING
    cancel_requested_s: float | None = None
    closing: Outcome | None = None
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
    followed: TargetSource | None = None
    doubt: PositionDoubt = field(default_factory=PositionDoubt)
    facts: dict[str, object] = field(default_factory=dict)
    act: GoalAct = field(default_factory=GoalAct)
    lease: GoalLease = field(default_factory=GoalLease)

    @property
    def ending(self) -> bool:
        """True while the goal is being ended: cancelled, or stopped for a reason."""
        return self.cancel_requested_s is not None or self.closing is not None

    def is_guarded(self, now: float) -> bool:
        """Whether what is watched less often is looked at now: not while it is being ended."""
        return now >= self.times.guard_s and not self.ending

    # --- its turns -------------------------------------------------------------------

    def progressed(self, progress: Progress) -> None:
        """Keep the progress."""
        self.progress = progress

    def show(self, status: Status) -> None:
        """Keep the reported status."""
        self.status = status

    def show_path(self, path_enu_m: tuple[Vector3, ...]) -> None:
        """Keep the reported path."""
        self.path_enu_m = path_enu_m

    def upload_began(self, mission: MissionTracker) -> None:
        """The vehicle was asked to store a mission."""
        self.mission = mission

    def operation_ended(self, status: OperationStatus, reason: str, now: float) -> None:
        """The operation in progress has ended."""
        self.operation.ended(status, reason)
        self.times.due(now)

    # --- rules ---------------------------------------------------------------------------

    def remember(self, rule: str, fact: object, text: str) -> None:
        """Keep what a rule has seen, and a sentence for the final message unless it is empty."""
        self.facts[rule] = fact
        if text:
            self.notes.append(text)

    def doubted(self, doubt: PositionDoubt | None, now: float) -> None:
        """The doubt about the position has changed; None: it is over, or the goal is."""
        if doubt is not None:
            self.doubt = doubt
            return
        summary = self.doubt.summary(self.accepted_s, now)
        if summary:
            self.notes.append(summary)
            self.doubt = PositionDoubt(self.doubt.jumps_ned_m)

    def stop(self, outcome: Outcome, now: float) -> None:
        """Have the task stop the vehicle; the goal then ends with this outcome."""
        self.closing = outcome
        self.task.cancel(now)
        self.times.due(now)

    # --- clients ---------------------------------------------------------------------------

    def begin_cancel(self, now: float) -> None:
        """Have the task stop the vehicle; the goal then ends CANCELED."""
        self.apply(GoalEvent.CANCEL)
        self.cancel_requested_s = now
        self.task.cancel(now)
        self.times.due(now)

    def pause(self, now: float) -> Rejection | None:
        """Pause by the service; return why that is not possible."""
        rejection = self.task.pause(now)
        if rejection is None:
            self.paused_by_client = True
            self.times.due(now)
        return rejection

    def resume(self, now: float) -> str:
        """Resume by the service; return why it stays paused, a sentence, or an empty text."""
        self.paused_by_client = False
        if self.paused_by:
            # The person who stopped the vehicle may be standing beside it.
            return f"{self.paused_by} Only a ground station can resume the goal, or cancel it here."
        self.task.unpause(now)
        self.times.due(now)
        return ""

    # --- ground stations and pilots ----------------------------------------------------------

    def cancel_by_station(self, sentence: str, by_pause: bool, now: float) -> None:
        """A ground station has cancelled it, perhaps only by stopping the vehicle."""
        self.cancelled_by, self.cancelled_by_pause = sentence, by_pause
        self.begin_cancel(now)

    def pause_by_station(self, sentence: str, now: float) -> None:
        """A ground station has paused it."""
        self.paused_by = sentence
        self.task.pause(now)

    def resume_by_station(self, now: float) -> None:
        """The ground station lets it continue."""
        self.paused_by = ""
        if not self.paused_by_client:
            self.task.unpause(now)

    def yield_vehicle(self, stopped: Standstill, now: float) -> None:
        """The vehicle is left alone: a ground station made it hold."""
        self.yielded = Yielded(now, stopped)

    def take_back(self, now: float) -> None:
        """The vehicle is flown again after it was left alone."""
        self.yielded = None
        self.task.resume_control(now)

    def taken(self, takeover: Takeover | None) -> None:
        """Somebody else has the vehicle, or more is known of it; None: it was explained."""
        self.takeover = takeover

    def see_failsafe(self, state: VehicleState) -> None:
        """Keep the failsafe that is active while it is unclear who has the vehicle."""
        if self.takeover is not None:
            self.takeover = self.takeover.watched(state)

    def redirect(self, takeover: Takeover) -> None:
        """A ground station sends the vehicle elsewhere; its stop before was part of that."""
        self.takeover = takeover
        if self.cancelled_by_pause:
            self.cancelled_by, self.cancelled_by_pause = "", False

    # --- its end ---------------------------------------------------------------------------

    @property
    def short_id(self) -> str:
        """The first eight digits of the goal's UUID, for messages."""
        return self.goal_id[:8]

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
        orbit = None if self.progress is None else self.progress.orbit
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
            next_index=route.next_index if route is not None else 0,
            route_id=route.route_id if route is not None else 0,
            laps_flown=orbit.laps_flown if orbit is not None else 0.0,
            action=self.kind,
        )
