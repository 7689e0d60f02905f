"""Outputs of a recorded server, restored from its notes. No ROS."""

from __future__ import annotations

import math
from contextlib import suppress

from mavlink_vehicle.codec import Message
from navigation_bridge.bridge import Bridge
from navigation_bridge.goals.goal import (
    GoalFeedback,
    GoalFinished,
    GoalRejected,
    Output,
    PlanChanged,
)
from navigation_bridge.goals.lifecycle import GoalState, next_state, terminal_event
from navigation_bridge.notes import NotedEvent, follow_progress
from navigation_bridge.recording.recorded_notes import NotesReader
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.progress import OrbitProgress, RouteProgress, Status


class NotedOutputs:
    """Converts the notes about one vehicle to the bridge's outputs at that time.

    Pose, height and battery, which the notes do not repeat, come from the replayed bridge.
    """

    def __init__(self, bridge: Bridge) -> None:
        """Attach to the bridge that the recording is played to."""
        self._bridge = bridge
        self._notes = NotesReader()
        self._status = Status.PREPARING
        self._has_plan = False

    def take(self, message: Message, now: float) -> list[Output]:
        """Process a note; returns the outputs of that time.

        Args:
            message: message of the recorder.
            now: seconds since the recording began.
        """
        noted = self._notes
        events, plans, feedbacks = len(noted.events), len(noted.plans), noted.feedbacks
        noted.take(now, message)
        outputs: list[Output] = []
        for _, event in noted.events[events:]:
            outputs += self._event(event)
        for _, points in noted.plans[plans:]:
            self._has_plan = True
            outputs.append(PlanChanged(points))
        if noted.feedbacks != feedbacks and noted.goals and noted.goals[-1].ended_s is None:
            outputs.append(self._feedback(noted.goals[-1].goal_id))
        return outputs

    def action_of(self, goal_id: str) -> str:
        """Return the action name of an accepted goal; empty if not recorded."""
        goals = reversed(self._notes.goals)
        return next((goal.kind for goal in goals if goal.goal_id == goal_id), "")

    def _event(self, noted: NotedEvent) -> list[Output]:
        happened = noted.happened
        outputs: list[Output] = [happened]
        if happened.event == "ACCEPTED":
            self._bridge.goals.recorded_id = happened.goal_id
            self._status = Status.PREPARING
        elif happened.event == "STATUS":
            with suppress(ValueError):  # of another version
                self._status = Status(happened.what)
        elif happened.event == "REJECTED" and (code := _code(happened.what)) is not None:
            sentence = happened.message.removeprefix(f"{code.value}: ")
            outputs.insert(0, GoalRejected(Rejection(code, sentence), happened.goal_id))
        elif happened.event == "ENDED":
            self._bridge.goals.recorded_id = None
            if (code := _code(happened.what)) is not None:
                outputs.insert(0, self._finished(noted, code))
            if self._has_plan:
                self._has_plan = False
                outputs.append(PlanChanged(()))
        return outputs

    def _finished(self, noted: NotedEvent, code: OutcomeCode) -> GoalFinished:
        return GoalFinished(
            goal_id=noted.happened.goal_id,
            state=next_state(GoalState.CANCELING, terminal_event(code)),
            code=code,
            message=noted.happened.message,
            pose=self._bridge.pose,
            elapsed_s=noted.elapsed_s or 0.0,
            final_error_m=noted.final_error_m,
            waypoints_reached=noted.waypoints_reached,
            waypoints_missed=noted.waypoints_missed,
            next_index=noted.next_index,
            route_id=noted.route_id,
            laps_flown=noted.laps_flown,
            action=self.action_of(noted.happened.goal_id),
        )

    def _feedback(self, goal_id: str) -> GoalFeedback:
        noted, battery = self._notes, self._bridge.vehicle.state.battery
        counts = noted.counts
        route = None
        if {"waypoint", "lap", "left", "reached"} <= counts.keys():
            route = RouteProgress(
                counts["waypoint"], counts["lap"], counts["left"], counts["reached"]
            )
        orbit = None
        if {"laps", "radius_err"} <= noted.figures.keys():
            orbit = OrbitProgress(noted.figures["laps"], noted.figures["radius_err"])
        return GoalFeedback(
            goal_id=goal_id,
            pose=self._bridge.pose,
            distance_remaining_m=noted.distance_m[-1][1] if noted.distance_m else math.nan,
            time_remaining_s=noted.time_left_s[-1][1] if noted.time_left_s else math.nan,
            battery_remaining=None if battery is None else battery.remaining,
            status=self._status,
            height_m=self._bridge.height_m,
            route=route,
            orbit=orbit,
            follow=follow_progress(counts, noted.figures),
            replans=counts["replans"],
            action=self.action_of(goal_id),
        )


def _code(name: str) -> OutcomeCode | None:
    try:
        return OutcomeCode(name)
    except ValueError:  # of another version
        return None
