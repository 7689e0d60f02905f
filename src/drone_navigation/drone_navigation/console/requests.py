"""Requests for a vehicle, sent to its server's services. One thread only."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import TypeAlias

from action_msgs.srv import CancelGoal
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
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
    PointGimbal,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.srv import ComputeSurvey, SeekReplay
from drone_navigation.console.goals.goal_messages import action_goal, landing
from drone_navigation.console.goals.interrupted_route import InterruptedRoute
from drone_navigation.console.messages import (
    PageCommand,
    PageFollow,
    PageGoal,
    PageWaypoint,
    Replay,
)
from drone_navigation.console.page_types import RouteValue
from navigation_bridge.names import (
    ACTION_NAME,
    FOLLOW_ACTION_NAME,
    LAND_ACTION_NAME,
    ORBIT_ACTION_NAME,
    POINT_GIMBAL_ACTION_NAME,
    RETURN_ACTION_NAME,
    SERVER_NODE_NAME,
    TAKEOFF_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)

__all__ = ["ACTIONS", "POINT_SERVICES", "Answer", "VehicleRequests"]

Answer: TypeAlias = Callable[[bool, str], None]
"""Called with whether a request succeeded, and a sentence."""

_Take: TypeAlias = Callable[..., None]
"""Called with the response of a service, of its generated class"""

ACTIONS = {
    ACTION_NAME: Navigate,
    WAYPOINTS_ACTION_NAME: NavigateWaypoints,
    FOLLOW_ACTION_NAME: Follow,
    ORBIT_ACTION_NAME: Orbit,
    TAKEOFF_ACTION_NAME: Takeoff,
    LAND_ACTION_NAME: Land,
    RETURN_ACTION_NAME: ReturnToLaunch,
}
"""Types of the actions, by name"""

POINT_SERVICES = {
    f"{POINT_GIMBAL_ACTION_NAME}/_action/send_goal": PointGimbal.Impl.SendGoalService,
    f"{POINT_GIMBAL_ACTION_NAME}/_action/get_result": PointGimbal.Impl.GetResultService,
}
"""The services of the action beside goals, which ends no flight: that begins, and its result"""

_COMMANDS = {
    ACTION_NAME: "The goal",
    WAYPOINTS_ACTION_NAME: "The route",
    FOLLOW_ACTION_NAME: "Following",
    ORBIT_ACTION_NAME: "The orbit",
    TAKEOFF_ACTION_NAME: "The take-off",
    LAND_ACTION_NAME: "The landing",
    RETURN_ACTION_NAME: "The return",
}
"""The actions, as a pilot calls them"""

# A goal is answered at once; a hold may take two mode changes
# (VehicleConfig.operation_timeout_s, 10 s each).
_ANSWER_TIMEOUT_S = 25.0
# A server that has been silent since does not answer any more.
_SILENT_TIMEOUT_S = 5.0
# The reason of a rejection comes on its own topic, usually before the answer.
_REASON_S = 1.0
_ROUTES_MAX = 50
_CALLS_MAX = 100
_TRIGGERS = ("start", "pause", "resume")


@dataclass
class _Call:
    """A request in progress, and what else it waits for."""

    future: Future
    deadline_s: float
    done: _Take
    late: Callable[[], None]


class VehicleRequests:
    """Requests for one vehicle.

    Attributes:
        routes: goals that pages sent, by their ids: by whom, which action, which waypoints.
        interrupted: the route that a page sent last.
    """

    def __init__(
        self, node: Node, namespace: str, is_alive: Callable[[], bool], now: float
    ) -> None:
        """Prepare.

        Args:
            node: the console's.
            namespace: the vehicle's, "/" without one.
            is_alive: returns whether its server has spoken lately.
            now: time, s.
        """
        self._node = node
        self._root = namespace.rstrip("/")
        self._is_alive = is_alive
        self._now = now
        self._clients: dict[str, Client] = {}
        self._calls: list[_Call] = []
        self._player = ""
        # Of the pages' goals: reasons of rejections, and rejected ones that wait for theirs.
        self._reasons: dict[str, str] = {}
        self._unexplained: list[tuple[float, str, Answer]] = []
        self.routes: dict[str, RouteValue] = {}
        self.interrupted = InterruptedRoute()

    def tick(self, now: float) -> None:
        """Take answers, at a time in s."""
        self._now = now
        self._give_reasons()
        for call in list(self._calls):
            if call.future.done():
                self._calls.remove(call)
                call.done(call.future.result())
            elif now > call.deadline_s or self._is_lost(call, now):
                self._calls.remove(call)
                call.future.cancel()
                call.late()

    def hear_rejection(self, goal_id: str, reason: str) -> None:
        """Take the reason of a rejection, which comes by a topic."""
        if goal_id in self.routes:
            self._reasons[goal_id] = reason

    def _give_reasons(self) -> None:
        """Answer what was rejected with its reason, or without one that does not come."""
        for each in list(self._unexplained):
            until_s, goal_id, answer = each
            reason = self._reasons.get(goal_id, "")
            if not reason and self._now <= until_s:
                continue
            self._unexplained.remove(each)
            self._forget(goal_id)
            why = f": {reason}" if reason else ", and the server published no reason."
            answer(False, f"Rejected{why}")

    def _forget(self, goal_id: str) -> None:
        self.routes.pop(goal_id, None)
        self._reasons.pop(goal_id, None)

    def _is_lost(self, call: _Call, now: float) -> bool:
        asked_s = call.deadline_s - _ANSWER_TIMEOUT_S
        return now > asked_s + _SILENT_TIMEOUT_S and not self._is_alive()

    # --- services ---------------------------------------------------------------------------

    def _service(self, name: str, kind: type[object] = Trigger, of_server: bool = False) -> Client:
        """Return the client of a service of the vehicle, by name, or of that of its server."""
        # A server of several vehicles has one namespace less.
        root = self._root.rpartition("/")[0] if of_server else self._root
        return self._client(f"{root}/{'' if '/' in name else SERVER_NODE_NAME + '/'}{name}", kind)

    def _sender(self, action: str) -> Client:
        kind = ACTIONS[action].Impl.SendGoalService
        return self._client(f"{self._root}/{action}/_action/send_goal", kind)

    def _result(self, action: str, goal_id: UUID) -> Future:
        """Ask for the result of a goal, which comes once that has ended."""
        kind = ACTIONS[action].Impl.GetResultService
        client = self._client(f"{self._root}/{action}/_action/get_result", kind)
        return client.call_async(kind.Request(goal_id=goal_id))

    def _canceller(self, action: str) -> Client:
        return self._client(f"{self._root}/{action}/_action/cancel_goal", CancelGoal)

    def _client(self, name: str, kind: type[object]) -> Client:
        """Return the client of a service, which finds its server in the next moments."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self._node.create_client(kind, name)
        return client

    def _call(self, future: Future, done: _Take, late: Callable[[], None]) -> None:
        self._calls.append(_Call(future, self._now + _ANSWER_TIMEOUT_S, done, late))

    def find_open(self) -> None:
        """Find what ends a flight, and what every page may ask, before it is needed."""
        self._service("hold")
        self._service("compute_survey", ComputeSurvey)
        for action in ACTIONS:
            self._canceller(action)

    def find_all(self) -> None:
        """Find all services: a page has taken control."""
        for name in ("pause", "resume"):
            self._service(name)
        self._service("trigger_camera")
        for name, kind in POINT_SERVICES.items():
            self._service(name, kind)
        for action in ACTIONS:
            self._sender(action)
        self._client(
            f"{self._root}/{WAYPOINTS_ACTION_NAME}/_action/get_result",
            NavigateWaypoints.Impl.GetResultService,
        )

    def ask(
        self,
        kind: type[object],
        name: str,
        request: object,
        done: _Take,
        of_server: bool = False,
        late: Callable[[], None] = lambda: None,
    ) -> bool:
        """Call one of the server's own services.

        Args:
            kind: its type.
            name: its name.
            request: what is asked.
            done: called with the answer.
            of_server: whether the node of the server is asked, not that of the vehicle.
            late: called without an answer.

        Returns:
            Whether it was there to be called.
        """
        client = self._service(name, kind, of_server)
        if not client.service_is_ready():
            return False
        self._call(client.call_async(request), done, late)
        return True

    # --- recordings -------------------------------------------------------------------------

    def find_replay(self, services: AbstractSet[str]) -> str:
        """Return the name of the node that plays a recording in the vehicle's place, "" if none.

        Args:
            services: names of all; a server of several vehicles has one namespace less.
        """
        self._player = ""
        for root in (self._root, self._root.rpartition("/")[0]):
            node = f"{root}/{SERVER_NODE_NAME}"
            if f"{node}/replay/pause" in services:
                self._player = node
                self._client(f"{node}/set_parameters", SetParameters)
                self._client(f"{node}/replay/seek", SeekReplay)
                for name in _TRIGGERS:
                    self._client(f"{node}/replay/{name}", Trigger)
        return self._player

    def replay(self, replay: Replay, answer: Answer) -> None:
        """Play the recording, or set where and how fast."""
        if not self._player:
            answer(False, "This is not a recording.")
            return
        request = Trigger.Request()
        client = self._clients[f"{self._player}/set_parameters"]
        if replay.name == "speed":
            value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=replay.value)
            speed = Parameter(name="replay_speed", value=value)
            request = SetParameters.Request(parameters=[speed])
        else:
            client = self._clients[f"{self._player}/replay/{replay.name}"]
        if replay.name == "seek":
            request = SeekReplay.Request(position=replay.value)

        def take(done: Trigger.Response | SeekReplay.Response | SetParameters.Response) -> None:
            if replay.name == "speed":
                (result,) = done.results
                answer(result.successful, result.reason or f"Replay speed: {replay.value:g} x.")
            else:
                answer(done.success, done.message)

        late = "The server did not answer the replay request."
        self._call(client.call_async(request), take, lambda: answer(False, late))

    # --- goals ------------------------------------------------------------------------------

    def is_silent(self, answer: Answer) -> bool:
        """Reject for a server that is silent: suspended, it would act on it much later."""
        if self._is_alive():
            return False
        answer(False, "Nothing was sent: the navigation server does not respond.")
        return True

    def trigger(self, name: str, answer: Answer) -> None:
        """Call one of the server's own services; a hold is tried even if the server is silent."""
        client = self._service(name)
        if name != "hold" and self.is_silent(answer):
            return
        if len(self._calls) > _CALLS_MAX:
            answer(False, "Too many requests are waiting for the server's answer.")
            return
        if not client.service_is_ready():
            answer(False, f"The server of this vehicle does not offer {name}.")
            return
        self._call(
            client.call_async(Trigger.Request()),
            lambda done: answer(done.success, done.message),
            lambda: answer(False, f"The server did not answer {name}."),
        )

    def cancel(self, answer: Answer) -> None:
        """Cancel all goals, whoever sent them: each action is asked."""
        ready = [
            client
            for client in (self._canceller(name) for name in ACTIONS)
            if client.service_is_ready()
        ]
        if not ready:
            answer(False, "The server of this vehicle does not take goals.")
            return
        left = [len(ready)]
        found: list[int] = []

        def take(done: CancelGoal.Response | None) -> None:
            left[0] -= 1
            if done is not None:
                found.append(len(done.goals_canceling))
            if not left[0]:
                if sum(found):
                    answer(True, "Cancelling; the vehicle stops and holds.")
                elif found:
                    answer(False, "There is no goal to cancel.")
                else:
                    answer(False, "The server did not answer the cancel request.")

        for client in ready:
            # A request of zeros means every goal.
            self._call(client.call_async(CancelGoal.Request()), take, lambda: take(None))

    def command(self, command: PageCommand, by: str, answer: Answer) -> None:
        """Execute a command of a page; `by` names the page."""
        if command.name in ("pause", "resume"):
            self.trigger(command.name, answer)
        elif command.name == "takeoff":
            goal = Takeoff.Goal(height=command.height_m)
            self._send(TAKEOFF_ACTION_NAME, goal, (), by, answer)
        elif command.name == "land":
            self._send(LAND_ACTION_NAME, landing(command), (), by, answer)
        elif command.name == "continue":
            rest = self.interrupted.rest()
            if rest is None:
                answer(False, "There is no interrupted route to continue.")
            else:
                self._send(WAYPOINTS_ACTION_NAME, *rest, by, answer)
        else:
            self._send(RETURN_ACTION_NAME, ReturnToLaunch.Goal(), (), by, answer)

    def fly(self, order: PageGoal | PageFollow, by: str, answer: Answer) -> None:
        """Send a goal, a route, a circle, or a target to follow."""
        self._send(*action_goal(order), by, answer)

    def _send(
        self, action: str, goal: object, waypoints: Sequence[PageWaypoint], by: str, answer: Answer
    ) -> None:
        """Send a goal by the action's service: feedback and end come by the topics, as for all."""
        if self.is_silent(answer):
            return
        client = self._sender(action)
        if not client.service_is_ready():
            answer(False, f"{_COMMANDS[action]} was not sent: the server does not take it.")
            return
        number = uuid.uuid4()
        request = ACTIONS[action].Impl.SendGoalService.Request(
            goal_id=UUID(uuid=list(number.bytes)), goal=goal
        )
        points = [[*w.position_enu_m, w.hold_time_s] for w in waypoints]
        while len(self.routes) >= _ROUTES_MAX:
            self._forget(next(iter(self.routes)))
        self.routes[number.hex] = {"by": by, "action": action, "waypoints": points}

        def take(response: Navigate.Impl.SendGoalService.Response) -> None:
            if response.accepted:
                answer(True, f"{_COMMANDS[action]} is accepted.")
                if isinstance(goal, NavigateWaypoints.Goal):
                    self.interrupted.begin(goal, waypoints, self._result(action, request.goal_id))
            else:
                self._unexplained.append((self._now + _REASON_S, number.hex, answer))

        def late() -> None:
            answer(False, f"{_COMMANDS[action]} was not answered; it may be active all the same.")

        self._call(client.call_async(request), take, late)
