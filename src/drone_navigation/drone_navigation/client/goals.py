"""One goal of the navigation client, from request to result, without blocking."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable
from enum import Enum, auto

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

from custom_interfaces.action import Follow, Navigate, NavigateWaypoints
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Ended, Telemetry

RESPONSE_TIMEOUT_S = 5.0
_CANCEL_AGAIN_S = 1.0

_STATES = {
    GoalStatus.STATUS_SUCCEEDED: "SUCCEEDED",
    GoalStatus.STATUS_CANCELED: "CANCELED",
    GoalStatus.STATUS_ABORTED: "ABORTED",
}


class GoalStage(Enum):
    """RehearsedFlight of a goal."""

    SENT = auto()
    OPEN = auto()
    REFUSED = auto()
    UNANSWERED = auto()
    ENDED = auto()
    FORGOTTEN = auto()


class SentGoal:
    """A goal that was sent.

    Attributes:
        number: counted from 1.
        client_goal: what was sent.
        typed: whether a person typed it in flight.
        stage: as of the last :meth:`look`.
        id: hexadecimal digits, as the server writes them.
        since_s: when the stage began.
    """

    def __init__(
        self,
        number: int,
        client_goal: ClientGoal,
        client: ActionClient,
        on_feedback: Callable[[SentGoal, Telemetry], None],
        now_s: float,
        *,
        typed: bool = False,
    ) -> None:
        """Send it.

        Args:
            number: counted from 1.
            client_goal: what to send.
            client: of the client_goal's action.
            on_feedback: called with each feedback of this goal.
            now_s: the time, of any clock that goes steadily.
            typed: whether a person typed it in flight.
        """
        self.number = number
        self.client_goal = client_goal
        self.typed = typed
        self.stage = GoalStage.SENT
        self.since_s = now_s
        self._handle: ClientGoalHandle | None = None
        self._results: list[Future] = []
        self._cancel: Future | None = None
        self._cancelled_s = 0.0
        self._cancel_again_s = -math.inf
        # Chosen here: the server may report about it before its answer is there.
        self.id = uuid.uuid4().hex
        self._answer = client.send_goal_async(
            client_goal.goal,
            feedback_callback=lambda message: on_feedback(self, self._telemetry(message.feedback)),
            goal_uuid=UUID(uuid=list(bytes.fromhex(self.id))),
        )

    def look(self, now_s: float) -> bool:
        """Process answers; True if the stage has changed."""
        before = self.stage
        if self.stage is GoalStage.SENT:
            self._look_for_answer(now_s)
        elif self.stage is GoalStage.OPEN:
            self._look_for_end()
        if self.stage is before:
            return False
        self.since_s = now_s
        return True

    def _look_for_answer(self, now_s: float) -> None:
        if self._answer.done():
            self._handle = self._answer.result()
            if self._handle.accepted:
                self.stage = GoalStage.OPEN
                self.ask_again()
            else:
                self.stage = GoalStage.REFUSED
        elif now_s - self.since_s > RESPONSE_TIMEOUT_S:
            self.stage = GoalStage.UNANSWERED

    def _look_for_end(self) -> None:
        """Take the first result received; all requests get the same one."""
        answers = [future.result().status for future in self._results if future.done()]
        if any(status != GoalStatus.STATUS_UNKNOWN for status in answers):
            self.stage = GoalStage.ENDED
        elif answers:
            self.stage = GoalStage.FORGOTTEN

    def ask_again(self) -> None:
        """Request the result again; an answer sent while the server was lost never arrives."""
        if self._handle is not None and self.stage is GoalStage.OPEN:
            self._results.append(self._handle.get_result_async())

    def cancel(self, now_s: float) -> bool:
        """Request the cancel; called repeatedly until the goal ends.

        Returns:
            Whether the server has just rejected; it is asked again a while later.
        """
        if self._handle is None or self.stage is not GoalStage.OPEN:
            return False
        if self._cancel is None:
            if now_s >= self._cancel_again_s:
                self._cancel = self._handle.cancel_goal_async()
                self._cancelled_s = now_s
            return False
        if not self._cancel.done():
            if now_s - self._cancelled_s > RESPONSE_TIMEOUT_S:
                self._cancel = None  # lost with the connection; the server takes a second one, too
            return False
        if self._cancel.result().goals_canceling:
            return False
        self._cancel = None
        self._cancel_again_s = now_s + _CANCEL_AGAIN_S
        return True

    def end(self, *, replaced: bool) -> Ended:
        """Return how it ended.

        Args:
            replaced: whether a later goal of this client was accepted, or may be.
        """
        answers = [future.result() for future in self._results if future.done()]
        wrapped = next(each for each in answers if each.status != GoalStatus.STATUS_UNKNOWN)
        result = wrapped.result
        place = result.final_pose.pose.position
        code = result.message.partition(":")[0]
        return Ended(
            goal=self.number,
            state=_STATES.get(wrapped.status, "ABORTED"),
            code=code,
            message=result.message,
            replaced=replaced and code == "PREEMPTED",
            position_enu_m=(place.x, place.y, place.z),
            elapsed_s=result.total_elapsed_time,
            error_m=getattr(result, "final_error", math.nan),
            waypoints_reached=getattr(result, "waypoints_reached", None),
            waypoints_missed=_missed(result),
            next_index=getattr(result, "next_index", None),
            route_id=getattr(result, "route_id", None),
            laps_flown=getattr(result, "laps_flown", None),
        )

    def _telemetry(self, feedback: Navigate.Feedback | NavigateWaypoints.Feedback) -> Telemetry:
        place = feedback.current_pose.pose.position
        route = self.client_goal.waypoints > 0
        return Telemetry(
            goal=self.number,
            status=feedback.current_status,
            position_enu_m=(place.x, place.y, place.z),
            distance_left_m=getattr(feedback, "distance_remaining", math.nan),
            time_left_s=getattr(feedback, "estimated_time_remaining", math.nan),
            battery_percent=feedback.battery_percentage,
            replans=getattr(feedback, "replans", 0),
            setpoint_delay_s=getattr(feedback, "setpoint_delay", 0.0),
            waypoint=feedback.current_waypoint + 1 if route else None,
            waypoints=self.client_goal.waypoints if route else None,
            lap=feedback.current_lap + 1 if route else None,
            laps_flown=getattr(feedback, "laps_flown", None),
            radius_error_m=getattr(feedback, "radius_error", None),
            follow_state=_follow_state(feedback),
            target_distance_m=getattr(feedback, "distance", None),
            target_age_s=getattr(feedback, "target_age", None),
        )


def _follow_state(feedback: object) -> str | None:
    """Return the name of the state with which a target is followed; None for other goals."""
    if not isinstance(feedback, Follow.Feedback):
        return None
    names = ("ACQUIRING", "FOLLOWING", "LOST")
    return next((name for name in names if getattr(feedback, name) == feedback.state), None)


def _missed(result: object) -> tuple[int, ...] | None:
    """Return the waypoints that a route's result names as missed."""
    missed = getattr(result, "waypoints_missed", None)
    return None if missed is None else tuple(int(index) for index in missed)
