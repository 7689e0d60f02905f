"""Services and actions on the parameters of the autopilot."""

from __future__ import annotations

import math
from collections.abc import Callable

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from custom_interfaces.action import ListVehicleParameters, LoadVehicleParameters
from custom_interfaces.msg import VehicleParameter
from custom_interfaces.srv import GetVehicleParameter, SetVehicleParameter
from drone_navigation.qos import RESULT_TIMEOUT_S
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.waiting import STOPPED, Waiting
from mavlink_vehicle.events import Parameter, ParameterChange
from navigation_bridge.storage.parameter_files import NAME
from navigation_bridge.storage.storage_requests import (
    ParametersAnswer,
    StorageRequests,
    TakeParameters,
)

# Each step of the protocol ends by itself before.
_TIMEOUT_S = 60.0
_PARAMETERS_MAX = 5000
_NAME = "~/vehicle_parameters"

Request = Callable[[StorageRequests, TakeParameters, float], object]


class ParameterServers:
    """Offers ``~/vehicle_parameters/get``, ``set``, ``list`` and ``load``.

    A callback waits in its own thread of the executor. The bridge has one request at a time and
    rejects others at once, so that there is one such thread.
    """

    def __init__(self, access: BridgeAccess) -> None:
        """Offer them."""
        node, bridge = access.node, access.bridge
        self._node = node
        self._bridge, self._driver, self._clock = bridge, access.driver, access.clock
        self._closed = access.is_closed
        group = ReentrantCallbackGroup()
        node.create_service(GetVehicleParameter, f"{_NAME}/get", self._get, callback_group=group)
        node.create_service(SetVehicleParameter, f"{_NAME}/set", self._set, callback_group=group)
        self._actions = [
            ActionServer(
                node,
                kind,
                f"{_NAME}/{verb}",
                execute_callback=execute,
                cancel_callback=lambda _handle: CancelResponse.ACCEPT,
                callback_group=group,
                result_timeout=RESULT_TIMEOUT_S,
            )
            for kind, verb, execute in (
                (ListVehicleParameters, "list", self._list),
                (LoadVehicleParameters, "load", self._load),
            )
        ]

    # --- executor threads --------------------------------------------------------------

    def _get(
        self, request: GetVehicleParameter.Request, response: GetVehicleParameter.Response
    ) -> GetVehicleParameter.Response:
        problem = _problem([request.name])
        if problem is not None:
            response.message = problem
            return response
        answer = self._ask(
            lambda requests, take, now: requests.read_parameter(request.name, take, now)
        )
        response.success, response.message = answer.success, answer.message
        for outcome in answer.outcomes:
            if outcome.new is not None:
                response.parameter = _message(outcome.new)
        return response

    def _set(
        self, request: SetVehicleParameter.Request, response: SetVehicleParameter.Response
    ) -> SetVehicleParameter.Response:
        response.old_value = response.new_value = math.nan
        problem = _problem([request.name], [request.value])
        if problem is not None:
            response.message = problem
            return response
        answer = self._ask(
            lambda requests, take, now: requests.change_parameters(
                {request.name: request.value}, request.while_armed, take, now
            )
        )
        response.success, response.message = answer.success, answer.message
        for outcome in answer.outcomes:
            response.old_value = math.nan if outcome.old is None else outcome.old.value
            response.new_value = math.nan if outcome.new is None else outcome.new.value
        return response

    def _list(self, handle: ServerGoalHandle) -> ListVehicleParameters.Result:
        def look(_changing: bool, done: int, total: int) -> None:
            handle.publish_feedback(ListVehicleParameters.Feedback(received=done, total=total))

        answer = self._act(handle, f"{_NAME}/list", StorageRequests.list_parameters, look)
        result = ListVehicleParameters.Result(success=answer.success, message=answer.message)
        result.system_id = self._bridge.vehicle.state.system_id
        result.parameters = [_message(parameter) for parameter in answer.parameters]
        return result

    def _load(self, handle: ServerGoalHandle) -> LoadVehicleParameters.Result:
        def look(changing: bool, done: int, total: int) -> None:
            feedback = LoadVehicleParameters.Feedback(changing=changing, done=done, total=total)
            handle.publish_feedback(feedback)

        goal, result = handle.request, LoadVehicleParameters.Result()
        wanted = {parameter.name: parameter.value for parameter in goal.parameters}
        problem = _problem([p.name for p in goal.parameters], list(wanted.values()))
        if problem is not None:
            handle.abort()
            result.message = problem
            return result

        def change(requests: StorageRequests, take: TakeParameters, now: float) -> None:
            requests.change_parameters(wanted, goal.while_armed, take, now)

        answer = self._act(handle, f"{_NAME}/load", change, look)
        result.success, result.message = answer.success, answer.message
        lists = {
            ParameterChange.CHANGED: result.changed,
            ParameterChange.UNCHANGED: result.unchanged,
            ParameterChange.UNKNOWN: result.unknown,
            ParameterChange.FAILED: result.failed,
        }
        for outcome in answer.outcomes:
            lists[outcome.change].append(outcome.name)
            if outcome.change is ParameterChange.FAILED:
                result.reasons.append(outcome.reason)
        return result

    def _act(
        self,
        handle: ServerGoalHandle,
        name: str,
        request: Request,
        tell: Callable[[bool, int, int], None],
    ) -> ParametersAnswer:
        """Do what an action asks for, report its progress, and put it into its terminal state."""
        reported: tuple[bool, int, int] = (False, 0, 0)
        stops = False
        waiting: Waiting[ParametersAnswer] = Waiting()
        client = _ClientWatch(self._node, name)

        def look() -> bool:
            nonlocal reported, stops
            if not stops and (handle.is_cancel_requested or client.is_gone()):
                stops = True
                reason = "it was cancelled" if handle.is_cancel_requested else "its client is gone"
                self._stop(waiting.take, reason)
            progress = self._requests.parameter_progress
            if progress == reported:
                return False
            reported = progress
            tell(*reported)
            return True

        answer = self._ask(request, waiting, look)
        if handle.is_cancel_requested:
            handle.canceled()
        elif answer.success:
            handle.succeed()
        else:
            handle.abort()
        return answer

    def _ask(
        self,
        request: Request,
        waiting: Waiting[ParametersAnswer] | None = None,
        look: Callable[[], bool] = lambda: False,
    ) -> ParametersAnswer:
        waiting = waiting or Waiting()
        take = waiting.take
        self._driver.post(lambda: request(self._requests, take, self._clock.now()))
        answer = waiting.wait(_TIMEOUT_S, self._closed, look)
        if answer is None:
            self._stop(take, "there was no progress")
            text = STOPPED if self._closed() else f"No answer within {_TIMEOUT_S:g} s."
            return ParametersAnswer(False, f"{text} What was changed is unknown.")
        return answer

    @property
    def _requests(self) -> StorageRequests:
        return self._bridge.feature(StorageRequests)

    def _stop(self, take: TakeParameters, reason: str) -> None:
        self._driver.post(lambda: self._requests.stop_parameters(take, reason, self._clock.now()))


class _ClientWatch:
    """Watches whether an action still has a client: each subscribes to its feedback.

    A client that was killed stays in the graph for 20 s, the lease of its DDS participant.
    """

    def __init__(self, node: Node, action: str) -> None:
        self._node = node
        self._topic = node.resolve_topic_name(f"{action}/_action/feedback")
        self._seen = False

    def is_gone(self) -> bool:
        """Return whether there was a client, and is none any more."""
        count: int = self._node.count_subscribers(self._topic)
        self._seen = self._seen or count > 0
        return self._seen and count == 0


def _problem(names: list[str], values: list[float] | None = None) -> str | None:
    """Return why a request is not passed on, a sentence, or None."""
    if not names:
        return "The request names no parameter."
    if len(names) > _PARAMETERS_MAX:
        return f"The request names {len(names)} parameters; at most {_PARAMETERS_MAX} are set."
    for name in names:
        if NAME.fullmatch(name) is None:
            return f"{name[:40]!r} is not a parameter's name: 1 to 16 letters, digits and _."
    if len(set(names)) < len(names):
        return "The request names a parameter twice."
    for name, value in zip(names, values or (), strict=False):
        if not math.isfinite(value):
            return f"{name}: {value} is not a finite number."
    return None


def _message(parameter: Parameter) -> VehicleParameter:
    return VehicleParameter(name=parameter.name, value=parameter.value, type=parameter.type)
