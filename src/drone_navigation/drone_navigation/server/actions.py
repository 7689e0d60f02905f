"""The action servers: front ends that hand goals to the driver thread.

How rclpy 7.1 behaves decides the shape of this file. Each accepted goal's execute
callback is parked on an event in an executor thread and costs nothing while it waits;
the driver thread publishes feedback and, by setting the event, lets the callback put the
goal into its terminal state. Feedback and end come from one thread in one order, so no
feedback follows the end.

Only a goal in CANCELING can end CANCELED. A goal that a ground station has cancelled is put into
that state here, and its clients see what they would see if one of them had cancelled it.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol, TypeAlias

from action_msgs.msg import GoalInfo
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import GoalEvent, ServerGoalHandle
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.impl.implementation_singleton import rclpy_implementation

from custom_interfaces.action import (
    Follow,
    FollowTrajectory,
    FollowVelocity,
    Land,
    Navigate,
    NavigateWaypoints,
    Orbit,
    ReturnToLaunch,
    Takeoff,
)
from drone_navigation.presence import Presence
from drone_navigation.qos import REQUEST_QOS, RESULT_TIMEOUT_S
from drone_navigation.server import conversions as convert
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.subscribing.target_topic import topic_types
from drone_navigation.server.subscribing.trajectory_messages import (
    placed_in_time,
    request_from_trajectory,
)
from mavlink_vehicle.errors import DriverError
from navigation_bridge.goals.goal import CancelWanted, GoalFeedback, GoalFinished
from navigation_bridge.goals.lifecycle import GoalState
from navigation_bridge.goals.requests import (
    FollowRequest,
    LandRequest,
    NavigateRequest,
    OrbitRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    TrajectoryRequest,
    VelocityRequest,
    WaypointsRequest,
)
from navigation_bridge.tasks.registry import TASKS
from navigation_bridge.tasks.task_kind import TaskKind
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

# On a computer that others keep busy the driver's thread has waited 3.8 s for a processor. Clients
# wait 5 s for an answer.
_CALL_TIMEOUT_S = 4.0
_LATE_ADVICE = "Send the goal again; if this returns, the computer has too much to do."
_CANCEL_STATE_TIMEOUT_S = 2.0


ActionType: TypeAlias = (
    type[Navigate | NavigateWaypoints | Orbit | Takeoff]
    | type[Follow | Land | ReturnToLaunch | FollowVelocity | FollowTrajectory]
)
RequestType: TypeAlias = type[Any]
GoalMessage: TypeAlias = (
    Navigate.Goal | NavigateWaypoints.Goal | Orbit.Goal | Takeoff.Goal
    | Follow.Goal | Land.Goal | ReturnToLaunch.Goal | FollowVelocity.Goal | FollowTrajectory.Goal
)  # fmt: skip


class FeedbackMessage(Protocol):
    """The feedback of each action."""

    current_pose: PoseStamped


class ResultMessage(Protocol):
    """The result of each action."""

    final_pose: PoseStamped


@dataclass(frozen=True)
class ActionKind:
    """One served action.

    Attributes:
        name: its name in the graph.
        type: its generated type.
        request: makes the bridge's request from a goal.
        feedback: writes the feedback into a message, with its pose in a frame.
        result: makes the result message.
    """

    name: str
    type: ActionType
    request: Callable[[GoalMessage], Request]
    feedback: Callable[[FeedbackMessage, GoalFeedback, Time, str], None]
    result: Callable[[GoalFinished, Time], ResultMessage]


@dataclass(frozen=True)
class _Interface:
    """The ROS side of all tasks with requests of one kind."""

    type: ActionType
    request: Callable[[GoalMessage, RequestType], Request]
    feedback: Callable[[GoalFeedback], convert.Fields]
    result: Callable[[Callable[[], ResultMessage], GoalFinished, Time], ResultMessage]


_INTERFACES: dict[type[Request], _Interface] = {
    NavigateRequest: _Interface(
        Navigate, convert.request_from_goal, convert.flown_feedback, convert.flown_result
    ),
    WaypointsRequest: _Interface(
        NavigateWaypoints,
        convert.request_from_waypoints,
        convert.waypoints_feedback,
        convert.waypoints_result,
    ),
    OrbitRequest: _Interface(
        Orbit, convert.request_from_orbit, convert.orbit_feedback, convert.orbit_result
    ),
    FollowRequest: _Interface(
        Follow, convert.request_from_follow, convert.follow_feedback, convert.result_of
    ),
    TakeoffRequest: _Interface(
        Takeoff, convert.request_from_takeoff, convert.height_feedback, convert.result_of
    ),
    LandRequest: _Interface(
        Land, convert.request_from_land, convert.height_feedback, convert.land_result
    ),
    ReturnRequest: _Interface(
        ReturnToLaunch, convert.request_from_return, convert.height_feedback, convert.result_of
    ),
    VelocityRequest: _Interface(
        FollowVelocity, convert.request_from_velocity, convert.velocity_feedback, convert.result_of
    ),
    TrajectoryRequest: _Interface(
        FollowTrajectory,
        request_from_trajectory,
        convert.trajectory_feedback,
        convert.flown_result,
    ),
}


def action_of(task: TaskKind[Any]) -> ActionKind:
    """Return the action by which a task is served: that of the request that its own is based on.

    Raises:
        LookupError: no action has such requests.
    """
    bases = [base for base in _INTERFACES if issubclass(task.request, base)]
    if not bases:
        raise LookupError(f"No action is known for a {task.request.__name__}.")
    interface = _INTERFACES[bases[0]]

    def feedback(message: FeedbackMessage, given: GoalFeedback, stamp: Time, frame_id: str) -> None:
        for name, value in interface.feedback(given).items():
            setattr(message, name, value)
        convert.put_pose(message.current_pose, given.pose, stamp, frame_id)

    return ActionKind(
        task.action,
        interface.type,
        lambda goal: interface.request(goal, task.request),
        feedback,
        partial(interface.result, interface.type.Result),
    )


ACTIONS = tuple(action_of(task) for task in TASKS)


@dataclass
class _Session:
    """One accepted goal: its rclpy handle, its feedback and, later, its result."""

    kind: ActionKind
    handle: ServerGoalHandle
    feedback: _GoalFeedback
    accepted_s: float
    done: threading.Event = field(default_factory=threading.Event)
    finished: GoalFinished | None = None


class _GoalFeedback:
    """The feedback of one goal: one message that is written again and again.

    rclpy's own way makes two messages each time, and throws one away: 3 % of what a vehicle costs.
    """

    def __init__(self, kind: ActionKind, handle: ServerGoalHandle) -> None:
        self._kind, self._handle = kind, handle
        self._message = kind.type.Impl.FeedbackMessage(goal_id=handle.goal_id)

    def publish(self, feedback: GoalFeedback, stamp: Time, frame_id: str) -> None:
        self._kind.feedback(self._message.feedback, feedback, stamp, frame_id)
        handle = self._handle
        with handle._lock:
            if handle._goal_handle is not None:
                handle._action_server._handle.publish_feedback(self._message)


class _GoalActionServer(ActionServer):
    """An action server with a working "cancel all", and a reason for an id that is used twice.

    rclpy 7.1 removes rejected goals from the list that it is iterating, so that the goal
    after a rejected one is skipped, but reported to its client as being cancelled. It rejects a
    goal whose id the action still knows, until :data:`RESULT_TIMEOUT_S` after the end, without a
    reason.

    Attributes:
        on_known_id: called with the goal's id, as hexadecimal digits, when one is rejected so.
        requested_id: the id of the goal that is being decided on, which rclpy does not pass on;
            one at a time, as the callbacks of an action exclude each other.
    """

    on_known_id: Callable[[str], None]
    requested_id = ""

    async def _execute_goal_request(self, request_header_and_message: tuple[object, Any]) -> None:
        _, request = request_header_and_message
        goal_id = bytes(request.goal_id.uuid)
        if goal_id in self._goal_handles:
            self.on_known_id(goal_id.hex())
        self.requested_id = goal_id.hex()
        await super()._execute_goal_request(request_header_and_message)

    async def _execute_cancel_request(self, request_header_and_message: tuple[object, Any]) -> None:
        header, request = request_header_and_message
        with self._lock:
            response = self._handle.process_cancel_request(
                request, self._action_type.Impl.CancelGoalService.Response
            )
        candidates = list(response.goals_canceling)
        response.goals_canceling = [info for info in candidates if self._cancel(info)]
        if candidates and not response.goals_canceling:
            response.return_code = CancelGoal.Response.ERROR_REJECTED
        try:
            self._handle.send_cancel_response(header, response)
        except rclpy_implementation.RCLError:
            self._logger.warning("A client disconnected before its cancel was answered")

    def _cancel(self, info: GoalInfo) -> bool:
        handle = self._goal_handles.get(bytes(info.goal_id.uuid))
        if handle is None or self._cancel_callback(handle) != CancelResponse.ACCEPT:
            return False
        _show_canceling(handle)
        return bool(handle.is_cancel_requested)  # not if it ended in the meantime


class GoalServers:
    """Serves all actions of a bridge that runs on a driver thread.

    The vehicle has one goal at a time, whichever action it came by.
    """

    def __init__(
        self,
        access: BridgeAccess,
        presence: Presence | None = None,
    ) -> None:
        """Offer the actions.

        Args:
            access: to node and bridge.
            presence: knows of other servers of the same name.
        """
        self._presence = presence
        self._access = access
        self._node, self._bridge, self._frames = access.node, access.bridge, access.frames
        self._driver, self._clock = access.driver, access.clock
        # A goal's id is its client's choice, and unique within one action only.
        self._sessions: dict[tuple[str, str], _Session] = {}
        self._lock = threading.Lock()
        # Goal and cancel requests are taken in the order in which they came, of all actions;
        # the parked execute callbacks are tasks of the executor, outside this group.
        group = MutuallyExclusiveCallbackGroup()
        self._servers = [self._serve(kind, group) for kind in ACTIONS]

    def _serve(self, kind: ActionKind, group: MutuallyExclusiveCallbackGroup) -> ActionServer:
        server: _GoalActionServer = _GoalActionServer(
            self._node,
            kind.type,
            kind.name,
            execute_callback=lambda handle: self._execute(kind, handle),
            goal_callback=lambda goal: self._on_goal(
                self._request(kind, goal), server.requested_id
            ),
            handle_accepted_callback=lambda handle: self._on_accepted(kind, handle),
            cancel_callback=lambda handle: self._on_cancel(kind, handle),
            callback_group=group,
            result_timeout=RESULT_TIMEOUT_S,
            goal_service_qos_profile=REQUEST_QOS,
            result_service_qos_profile=REQUEST_QOS,
            cancel_service_qos_profile=REQUEST_QOS,
        )
        server.on_known_id = self._on_known_id
        return server

    # --- executor threads --------------------------------------------------------------

    def _on_goal(self, request: Request, goal_id: str) -> GoalResponse:
        try:
            rejection = None if self._presence is None else self._presence.rejection()
            if rejection is not None:
                refusal = rejection
                self._driver.call(
                    lambda: self._bridge.goals.reject(refusal, goal_id), _CALL_TIMEOUT_S
                )
                return GoalResponse.REJECT
            rejection = self._driver.call(
                lambda: self._bridge.goals.check(request, self._clock.now(), goal_id),
                _CALL_TIMEOUT_S,
            )
        except DriverError as error:
            late = Rejection(OutcomeCode.SERVER_LATE, f"{error} {_LATE_ADVICE}")
            self._node.get_logger().error(f"Goal rejected: {late.code.value}: {late.message}")
            # Clients learn it from the driver's thread, when that gets a processor again.
            self._driver.post(lambda: self._bridge.goals.reject(late, goal_id))
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT if rejection is None else GoalResponse.REJECT

    def _on_known_id(self, goal_id: str) -> None:
        text = (
            f"Goal {goal_id[:8]} of this action is active or ended less than "
            f"{RESULT_TIMEOUT_S} s ago; give each goal an id of its own."
        )
        rejection = Rejection(OutcomeCode.BUSY, text)
        self._driver.post(lambda: self._bridge.goals.reject(rejection, goal_id))

    def _request(self, kind: ActionKind, goal: GoalMessage) -> Request:
        request = kind.request(goal)
        if isinstance(request, FollowRequest):
            types = topic_types(self._access, request.source.topic)
            return replace(request, topic_types=types)
        if isinstance(request, LandRequest):
            return replace(request, topic_types=topic_types(self._access, request.target_topic))
        if isinstance(request, TrajectoryRequest):
            return placed_in_time(request, goal.trajectory, self._access)
        if isinstance(request, NavigateRequest | OrbitRequest):
            return replace(request, frame_id=self._frames.plain(request.frame_id))
        return request

    def _on_accepted(self, kind: ActionKind, handle: ServerGoalHandle) -> None:
        goal_id = bytes(handle.goal_id.uuid).hex()
        with self._lock:
            feedback = _GoalFeedback(kind, handle)
            self._sessions[kind.name, goal_id] = _Session(kind, handle, feedback, self._clock.now())
        request = self._request(kind, handle.request)
        # EXECUTING before the bridge can end the goal: an end needs that state.
        handle.execute()
        self._driver.post(lambda: self._bridge.goals.start(goal_id, request, self._clock.now()))

    def _on_cancel(self, kind: ActionKind, handle: ServerGoalHandle) -> CancelResponse:
        goal_id = bytes(handle.goal_id.uuid).hex()
        try:
            accepted = self._driver.call(
                lambda: self._bridge.goals.cancel(goal_id, self._clock.now(), kind.name),
                _CALL_TIMEOUT_S,
            )
        except DriverError:
            accepted = False
        session = self._sessions.get((kind.name, goal_id))
        if session is not None and session.finished is not None:
            # The vehicle may have stopped before this request came around.
            accepted = accepted or session.finished.state is GoalState.CANCELED
        return CancelResponse.ACCEPT if accepted else CancelResponse.REJECT

    def _execute(self, kind: ActionKind, handle: ServerGoalHandle) -> ResultMessage:
        key = kind.name, bytes(handle.goal_id.uuid).hex()
        session = self._sessions[key]
        session.done.wait()
        finished = session.finished
        assert finished is not None
        if finished.state is GoalState.SUCCEEDED:
            handle.succeed()
        elif finished.state is GoalState.CANCELED:
            _wait_until_canceling(handle)
            handle.canceled()
        else:
            handle.abort()
        with self._lock:
            del self._sessions[key]
        result = session.kind.result(finished, self._node.get_clock().now().to_msg())
        result.final_pose.header.frame_id = self._frames.map
        return result

    # --- driver thread -----------------------------------------------------------------

    def publish_feedback(self, feedback: GoalFeedback) -> None:
        """Publish to the goal's clients; nothing once the goal has ended."""
        session = self._sessions.get((feedback.action, feedback.goal_id))
        if session is None or session.finished is not None:
            return
        stamp = self._node.get_clock().now().to_msg()
        session.feedback.publish(feedback, stamp, self._frames.map)

    def cancel(self, wanted: CancelWanted) -> None:
        """Show a goal's clients that it is being cancelled, by whomever."""
        session = self._sessions.get((wanted.action, wanted.goal_id))
        if session is not None and session.finished is None:
            _show_canceling(session.handle)

    def finish(self, finished: GoalFinished) -> None:
        """Let the goal's execute callback return its result."""
        session = self._sessions.get((finished.action, finished.goal_id))
        if session is None:
            return
        session.finished = finished
        session.done.set()

    # --- main thread --------------------------------------------------------------------

    def abandon(self, code: OutcomeCode, text: str) -> None:
        """End every open goal without the bridge, which no longer runs."""
        for (action, goal_id), session in list(self._sessions.items()):
            if not session.done.is_set():
                self.finish(
                    GoalFinished(
                        goal_id=goal_id,
                        state=GoalState.ABORTED,
                        code=code,
                        message=f"{code.value}: {text}",
                        pose=None,
                        elapsed_s=self._clock.now() - session.accepted_s,
                        final_error_m=None,
                        action=action,
                    )
                )

    def is_idle(self) -> bool:
        """True if every accepted goal has ended."""
        return not self._sessions


def _wait_until_canceling(handle: ServerGoalHandle) -> None:
    """Wait until rclpy has processed the cancel that the bridge has already executed.

    The bridge may end a goal before rclpy, in another thread, has put it into CANCELING, the
    only state that leads to CANCELED. A request that never comes is made up for.
    """
    deadline = time.monotonic() + _CANCEL_STATE_TIMEOUT_S
    pause = threading.Event()
    while not handle.is_cancel_requested and time.monotonic() < deadline:
        pause.wait(0.001)
    if not handle.is_cancel_requested:
        _show_canceling(handle)


def _show_canceling(handle: ServerGoalHandle) -> None:
    """Put a goal into CANCELING, and publish that; nothing if it is, or has ended."""
    with contextlib.suppress(rclpy_implementation.RCLError):
        handle._update_state(GoalEvent.CANCEL_GOAL)
