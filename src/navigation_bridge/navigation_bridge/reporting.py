"""Outputs of the bridge: feedback, results, rejections, log lines and notes. No ROS."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Collection, Iterable
from functools import partial

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    HeartbeatLost,
    HeartbeatRegained,
    OperationFinished,
    OperationKind,
    OperationResult,
    StatusTextReceived,
    StoodStill,
    TwinHeard,
    VehicleDiscovered,
    VehicleEvent,
)
from mavlink_vehicle.profiles.flown_releases import FLOWN, flown_with
from mavlink_vehicle.ranges import RangesRefused
from mavlink_vehicle.state.status_text import StatusText
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge import notes
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import (
    Annotation,
    CancelWanted,
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    GoalRejected,
    LogLevel,
    LogLine,
    Output,
    PlanChanged,
    ServiceDone,
)
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.takeover import FAILSAFE_CODES
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.progress import Progress

_MAV_SEVERITY_WARNING = 4


class Front:
    """Publishes what a bridge puts out; this one leaves all of it in `Bridge.next_output`.

    All is called on the driver's thread, at the end of what the bridge was called for.
    """

    def put_out(self) -> None:
        """Publish the outputs."""

    def update(self, now: float) -> None:
        """Publish the outputs, and what has changed of the vehicle's state."""

    def next_deadline(self) -> float | None:
        """Return the latest time of the next call of :meth:`update`."""
        return None

    def fail(self, error: Exception) -> None:
        """Log an internal error."""

    def give_up(self, error: Exception) -> None:
        """Log an error, and end all goals without the bridge, which is not called again."""


class Reporter:
    """Output queue between bridge and driver thread."""

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame) -> None:
        """Report about ``vehicle`` in ``map_frame``."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        # Or notes that are made when they are reached, because what is before them is urgent.
        self._outputs: deque[Output | Callable[[], list[Message]]] = deque()
        self._position_known = False
        self._text_ids = itertools.count()
        self._answers: frozenset[StatusText] = frozenset()

    def next_output(self, recorded: bool = True) -> Output | None:
        """Return the next output, or None; without a recording perhaps no notes."""
        while self._outputs:
            output = self._outputs.popleft()
            if not callable(output):
                return output
            if recorded:
                self._outputs.extendleft(Annotation(message) for message in reversed(output()))
        return None

    def log(self, level: LogLevel, text: str) -> None:
        """Add a log line."""
        self._outputs.append(LogLine(level, text))

    def note(self, message: Message) -> None:
        """Add a note to the recording."""
        self._outputs.append(Annotation(message))

    def rejected(self, rejection: Rejection, goal_id: str) -> None:
        """Report the rejection of a goal; an id that is not known is empty."""
        output = GoalRejected(rejection, goal_id)
        self._outputs.append(output)
        self._happened(goal_id, "REJECTED", rejection.code.value, output.text)
        self.log(LogLevel.WARN, f"Goal rejected: {output.text}")

    def accepted(self, goal: ActiveGoal) -> None:
        """Report the start of a goal."""
        self.log(LogLevel.INFO, f"Goal {goal.short_id} accepted: {goal.description}")
        self._happened(goal.goal_id, "ACCEPTED", "", goal.description, goal.kind)
        if goal.target_enu_m is not None:
            route = (goal.target_enu_m,) if goal.plan is None else goal.plan.targets_enu_m
            for target in route:
                self.note(notes.goal_accepted(goal.short_id, target))
        for warning in goal.notes:
            # Now, and not only with the result: clients show it while the goal can be cancelled.
            self.remark(goal, warning)
            self.log(LogLevel.WARN, f"Goal {goal.short_id}: {warning}")

    def status(self, goal: ActiveGoal, progress: Progress) -> None:
        """Report the new status of a goal."""
        goal.show(progress.status)
        self._happened(goal.goal_id, "STATUS", progress.status.value, progress.blocked)
        text = f"{goal.short_id} {progress.status.value}"
        why = f": {progress.blocked}" if progress.blocked else ""
        self.log(LogLevel.INFO, f"Goal {text}{why}")

    def feedback(self, goal: ActiveGoal, progress: Progress, snapshot: Snapshot) -> None:
        """Report the progress of a goal."""
        battery, pose = snapshot.state.battery, snapshot.pose
        self._outputs.append(
            GoalFeedback(
                goal_id=goal.goal_id,
                pose=pose,
                distance_remaining_m=progress.distance_remaining_m,
                time_remaining_s=progress.time_remaining_s,
                battery_remaining=None if battery is None else battery.remaining,
                status=progress.status,
                height_m=(None if pose is None else pose.position_enu_m[2] - snapshot.ground_enu_m),
                route=progress.route,
                orbit=progress.orbit,
                follow=progress.follow,
                trajectory=progress.trajectory,
                replans=progress.replans,
                late_s=snapshot.late_s,
                velocity_enu_m_s=snapshot.velocity_enu_m_s,
                limited_by=progress.blocked,
                action=goal.kind,
            )
        )
        self._outputs.append(partial(notes.progress, progress, snapshot.time_s))

    def plan(self, goal: ActiveGoal, path_enu_m: tuple[Vector3, ...]) -> None:
        """Report a planned path that has changed."""
        goal.show_path(path_enu_m)
        self._outputs.append(PlanChanged(path_enu_m))
        for message in notes.plan(path_enu_m):
            self.note(message)

    def _happened(
        self,
        goal_id: str,
        event: str,
        what: str,
        message: str,
        kind: str = "",
        finished: GoalFinished | None = None,
    ) -> None:
        happened = GoalHappened(goal_id, event, what, message)
        self._outputs.append(happened)
        for note in notes.long_text(notes.event(happened, kind, finished), next(self._text_ids)):
            self.note(note)

    def remark(self, goal: ActiveGoal, text: str) -> None:
        """Report an event of a goal whose status has not changed."""
        self._happened(goal.goal_id, "STATUS", goal.status.value, text)

    def cancel_wanted(self, goal: ActiveGoal) -> None:
        """Cancel the action of a goal."""
        self._outputs.append(CancelWanted(goal.goal_id, goal.kind))

    def rejected_at_start(self, goal_id: str, action: str, rejection: Rejection) -> None:
        """Report that a goal, just accepted, can no longer start."""
        text = f"{rejection.code.value}: {rejection.message}"
        pose = self._map_frame.pose(self._vehicle.state)
        self._outputs.append(
            GoalFinished(
                goal_id, GoalState.ABORTED, rejection.code, text, pose, 0.0, None, action=action
            )
        )
        self.log(LogLevel.WARN, f"Goal {goal_id[:8]} ended: {text}")

    def served(self, number: int, success: bool, message: str) -> None:
        """Answer a service request."""
        self._outputs.append(ServiceDone(number, success, message))

    @property
    def height_m(self) -> float | None:
        """The vehicle's height above the ground, or None while it is not known."""
        state = self._vehicle.state
        pose = self._map_frame.pose(state)
        if pose is None:
            return None
        return pose.position_enu_m[2] - self._map_frame.ground_enu_m(state)

    def ended(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        """End a goal and report its result."""
        state = self._vehicle.state
        heard_s = now if state.last_heartbeat_s is None else state.last_heartbeat_s
        code = goal.end_of(outcome).code
        said = worst_text(state.status_texts, code, goal.accepted_s, heard_s, self._answers)
        if outcome.code in FAILSAFE_CODES:
            said = ""  # only texts about this goal are quoted
        finished = goal.finish(outcome, self._map_frame.pose(state), now, said)
        self._outputs.append(finished)
        self._happened(
            goal.goal_id, "ENDED", finished.code.value, finished.message, finished=finished
        )
        if goal.path_enu_m:
            self._outputs.append(PlanChanged(()))
        self.log(
            LogLevel.INFO if finished.code is OutcomeCode.SUCCESS else LogLevel.WARN,
            f"Goal {goal.short_id} ended: {finished.message}",
        )

    def operation(self, event: OperationFinished) -> None:
        """Remember texts that answered a request of this server: they explain no other end."""
        texts = self._vehicle.state.status_texts
        self._answers = self._answers.intersection(texts) | answers_in(event, texts)

    @property
    def has_position(self) -> bool:
        """Whether the position was valid when it was last looked at."""
        return self._position_known

    def position(self, state: VehicleState) -> None:
        """Report that the position has become valid or invalid."""
        valid = self._map_frame.pose(state) is not None
        if valid is self._position_known:
            return
        self._position_known = valid
        if valid:
            self.log(LogLevel.INFO, "Position valid; ready for goals")
        else:
            self.log(LogLevel.WARN, "The vehicle's position is no longer valid")

    def firmware(self, state: VehicleState) -> None:
        """Report the vehicle's release, and whether goals have been flown with it."""
        if state.firmware_version is None or state.autopilot not in FLOWN:
            return
        known, text = flown_with(state.autopilot, state.firmware_version)
        self.log(LogLevel.INFO if known else LogLevel.WARN, text)

    def protocol(self, before: VehicleState) -> None:
        """Report whether the vehicle speaks MAVLink 1 only, if it did not before, or no longer."""
        speaks_mavlink_1 = self._vehicle.state.speaks_mavlink_1
        if speaks_mavlink_1 is before.speaks_mavlink_1:
            return
        if speaks_mavlink_1:
            text = (
                "The vehicle speaks MAVLink 1 only, and is answered so; its fence and rally points "
                "cannot be read or written, and messages that MAVLink 1 lacks, of ground stations "
                "too, may not reach it"
            )
            self.log(LogLevel.WARN, text)
        else:
            self.log(LogLevel.INFO, "The vehicle speaks MAVLink 2 now")

    def vehicle(self, event: VehicleEvent) -> None:
        """Report an event of the vehicle that is relevant for people."""
        if isinstance(event, StatusTextReceived):
            severe = event.severity <= _MAV_SEVERITY_WARNING
            self.log(LogLevel.WARN if severe else LogLevel.INFO, f"Vehicle reports: {event.text}")
        elif isinstance(event, VehicleDiscovered):
            self.log(LogLevel.INFO, f"Found vehicle {event.system_id}, {event.profile_name}")
        elif isinstance(event, RangesRefused):
            self.log(LogLevel.WARN, event.reason)
        elif isinstance(event, StoodStill):
            self.log(
                LogLevel.WARN,
                f"The server was suspended for {event.gap_s:.1f} s; it sends no motion command "
                "until the vehicle has reported its mode again",
            )
        elif isinstance(event, TwinHeard):
            self.log(LogLevel.ERROR, event.reason)
        elif isinstance(event, HeartbeatLost):
            self.log(LogLevel.WARN, "No HEARTBEAT from the vehicle")
        elif isinstance(event, HeartbeatRegained):
            self.log(LogLevel.INFO, "HEARTBEAT received again")


RECENT_S = 30.0
"""Maximum age of a text that explains an end, counted from the last HEARTBEAT.

Some ends come long after their cause: a goal without progress ends after 20 s (`settle_timeout_s`),
a blocked one after 30 s. Observed on ArduCopter 4.7 with a dead motor:
"Potential Thrust Loss (1)" 15.5 s before TIMEOUT.
"""
# Lower severities are remarks (https://mavlink.io/en/messages/common.html#MAV_SEVERITY), such as
# every answer to a request for messages: ArduPilot's "No ap_message for mavlink id" and "Requested
# rate ... too fast" have severity INFO (observed on ArduCopter and ArduRover 4.7).
_LEAST_SEVERE = mavlink.MAV_SEVERITY_WARNING
_AS_ASKED = frozenset({OutcomeCode.SUCCESS, OutcomeCode.CANCELED, OutcomeCode.PREEMPTED})
# During these the vehicle flies, so a text may concern the flight instead of the request.
_FLOWN = frozenset(
    {
        OperationKind.TAKE_OFF,
        OperationKind.LAND,
        OperationKind.RETURN_TO_LAUNCH,
        OperationKind.REPOSITION,
        OperationKind.START_MISSION,
    }
)


def worst_text(
    texts: Iterable[StatusText],
    code: OutcomeCode,
    since_s: float,
    heard_s: float,
    answers: Collection[StatusText] = (),
) -> str:
    """Return the text to quote for the end of a goal: the worst recent one (then the latest).

    Args:
        texts: texts of the autopilot, oldest first.
        code: code of the end. Nothing is quoted for a requested end.
        since_s: time of acceptance.
        heard_s: time of the last message; a silent vehicle gave its reason before the silence.
        answers: texts that only answered a request of this server.

    Returns:
        Empty if there is nothing to quote.
    """
    if code in _AS_ASKED:
        return ""
    begin_s = max(since_s, heard_s - RECENT_S)
    candidates = [
        text
        for text in texts
        if text.time_s >= begin_s and text.severity <= _LEAST_SEVERE and text not in answers
    ]
    worst = min(reversed(candidates), key=lambda text: text.severity, default=None)
    return "" if worst is None else worst.text.strip()


def answers_in(event: OperationFinished, texts: Iterable[StatusText]) -> frozenset[StatusText]:
    """Return the texts with which a vehicle rejected a request; the event's reason quotes them."""
    if event.result is not OperationResult.REFUSED or event.kind in _FLOWN:
        return frozenset()
    return frozenset(text for text in texts if f'"{text.text}"' in event.reason)
