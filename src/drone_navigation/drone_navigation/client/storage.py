"""Commands of ``navigation_client`` on what the autopilot stores: fence, rally, parameters."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from rclpy.action import ActionClient

from custom_interfaces.action import ListVehicleParameters, LoadVehicleParameters
from custom_interfaces.msg import FenceArea, RallyPoint, VehicleParameter
from custom_interfaces.srv import (
    GetFence,
    GetRallyPoints,
    GetVehicleParameter,
    SetFence,
    SetRallyPoints,
    SetVehicleParameter,
)
from drone_navigation.client.commands import ClientCommand, run_command
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
    make_command_parser,
)
from drone_navigation.client.terminal.progress import counting_bar
from drone_navigation.message_forms.storage_messages import area_message, rally_message
from mavlink_vehicle.events import Parameter, parameter_text
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_bridge.plan_files.items import PlanError
from navigation_bridge.storage import parameter_files as files
from navigation_bridge.storage.point_files import read_fence, read_rally

__all__ = ["StorageCommand", "prepare", "run_storage_command"]

# The server ends each request itself before (ListServers, ParameterServers).
_ANSWER_TIMEOUT_S = 180.0
_ACCEPT_TIMEOUT_S = 10.0
_STOP_TIMEOUT_S = 10.0
_SILENCE_S = 90.0
_ABOVE = {
    RallyPoint.ABOVE_HOME: "above home",
    RallyPoint.ABOVE_MEAN_SEA_LEVEL: "above mean sea level",
    RallyPoint.ABOVE_GROUND: "above ground",
}
_Kind: TypeAlias = type[
    GetFence
    | GetRallyPoints
    | GetVehicleParameter
    | SetFence
    | SetRallyPoints
    | SetVehicleParameter
    | ListVehicleParameters
    | LoadVehicleParameters
]
_Response: TypeAlias = (
    GetFence.Response
    | GetRallyPoints.Response
    | GetVehicleParameter.Response
    | SetFence.Response
    | SetRallyPoints.Response
    | SetVehicleParameter.Response
    | ListVehicleParameters.Result
    | LoadVehicleParameters.Result
)
_Feedback: TypeAlias = (
    ListVehicleParameters.Impl.FeedbackMessage | LoadVehicleParameters.Impl.FeedbackMessage
)


@dataclass(frozen=True)
class StorageRequest:
    """A request: its type, the name of its service or action, and its fields.

    Attributes:
        kind: generated type.
        name: below the server's name.
        fields: of the request or goal.
        notes: sentences to show before.
    """

    kind: _Kind
    name: str
    fields: Mapping[str, object]
    notes: tuple[str, ...] = ()


def run_storage_command(options: argparse.Namespace, argv: list[str]) -> int:
    """Run a command and return the exit code; the program ends if its file cannot be used."""
    try:
        options.task = prepare(options)
    except (PlanError, files.ParameterFileError) as error:
        make_command_parser(options.command).error(str(error))
    return run_command(options, argv, StorageCommand)


def prepare(options: argparse.Namespace) -> StorageRequest:
    """Return the request of the command line; files are read and checked here.

    Raises:
        PlanError: the file has no fence or rally points that can be sent.
        ParameterFileError: the file holds no parameters, or cannot be written.
    """
    if options.command == "fence":
        return _fence(options)
    if options.command == "rally":
        return _rally(options)
    name = f"vehicle_parameters/{'list' if options.verb == 'save' else options.verb}"
    if options.verb == "get":
        return StorageRequest(GetVehicleParameter, name, {"name": options.name})
    if options.verb == "set":
        fields = {"name": options.name, "value": options.value}
        return StorageRequest(
            SetVehicleParameter, name, {**fields, "while_armed": options.while_armed}
        )
    if options.verb == "load":
        read = files.read_parameters(options.file)
        wanted = [VehicleParameter(name=n, value=value) for n, value in read.values.items()]
        fields = {"parameters": wanted, "while_armed": options.while_armed}
        return StorageRequest(LoadVehicleParameters, name, fields, read.notes)
    if options.verb == "save":
        files.format_of(options.file)
        if not options.file.parent.is_dir():
            text = f"{options.file}: the folder {options.file.parent} does not exist."
            raise files.ParameterFileError(text)
        if options.file.exists() and not options.force:
            text = f"{options.file}: already exists; give --force to replace it."
            raise files.ParameterFileError(text)
    return StorageRequest(ListVehicleParameters, name, {})


def _fence(options: argparse.Namespace) -> StorageRequest:
    if options.plan is None:
        return (
            StorageRequest(SetFence, "set_fence", {})
            if options.clear
            else StorageRequest(GetFence, "get_fence", {})
        )
    file = read_fence(options.plan)
    fence = file.fence
    fields = {
        "areas": [area_message(area) for area in fence.areas],
        "return_point": list(fence.return_point_deg or ()),
    }
    return StorageRequest(SetFence, "set_fence", fields, file.notes)


def _rally(options: argparse.Namespace) -> StorageRequest:
    if options.plan is not None:
        file = read_rally(options.plan)
        fields = {"points": [rally_message(point) for point in file.points]}
        return StorageRequest(SetRallyPoints, "set_rally_points", fields, file.notes)
    if options.clear:
        return StorageRequest(SetRallyPoints, "set_rally_points", {})
    return StorageRequest(GetRallyPoints, "get_rally_points", {})


class StorageCommand(ClientCommand):
    """One of these commands, from finding the server to the answer."""

    def run(self) -> int:
        """Send the request and show the answer."""
        task: StorageRequest = self._options.task
        for note in task.notes:
            print(note, file=sys.stderr)
        name = f"{SERVER_NODE_NAME}/{task.name}"
        if task.kind in (ListVehicleParameters, LoadVehicleParameters):
            result = self._act(task, name)
        else:
            result = self._ask(task, name)
        if isinstance(result, int):
            return result
        facts, text = _shown(result)
        exit_code = _exit_code(result)
        if self._options.command == "parameters" and self._options.verb == "save":
            exit_code, text = self._save(result, exit_code)
            facts = {"file": str(self._options.file), "parameters": len(result.parameters)}
        message = {"success": exit_code == EXIT_SUCCESS, "message": result.message}
        self._tell({**message, **facts}, text)
        return EXIT_CANCELED if self._cancelled else exit_code

    _cancelled = False

    def _ask(self, task: StorageRequest, name: str) -> _Response | int:
        """Return the response of a service, or an exit code."""
        client = self._node.create_client(task.kind, name)
        if not self._wait(client.service_is_ready, self._options.server_timeout):
            return self._without_server()
        answer = client.call_async(task.kind.Request(**task.fields))
        if not self._wait_for_answer(answer.done, _ANSWER_TIMEOUT_S, client.service_is_ready):
            return EXIT_NO_SERVER
        return answer.result()

    def _act(self, task: StorageRequest, name: str) -> _Response | int:
        """Return the result of an action, or an exit code; Ctrl-C cancels it."""
        client = ActionClient(self._node, task.kind, name)
        if not self._wait(client.server_is_ready, self._options.server_timeout):
            return self._without_server()
        heard = [True]
        with counting_bar(not (self._options.plain or self._options.json)) as tell:

            def take(message: _Feedback) -> None:
                heard.append(True)
                feedback = message.feedback
                if isinstance(feedback, LoadVehicleParameters.Feedback):
                    what = "changing parameters" if feedback.changing else "reading parameters"
                    tell(what, feedback.done, feedback.total)
                else:
                    tell("reading parameters", feedback.received, feedback.total)

            sent = client.send_goal_async(task.kind.Goal(**task.fields), take)
            is_ready = client.server_is_ready
            if not self._wait_for_answer(sent.done, _ACCEPT_TIMEOUT_S, is_ready):
                return EXIT_NO_SERVER
            handle = sent.result()
            result = handle.get_result_async()
            answered = True
            try:
                # Until the result, or a silence.
                while answered and not result.done():
                    heard.clear()
                    answered = self._wait_for_answer(
                        lambda: bool(result.done() or heard), _SILENCE_S, is_ready
                    )
            except KeyboardInterrupt:
                self._cancelled = True
                handle.cancel_goal_async()
                answered = self._wait_for_answer(result.done, _STOP_TIMEOUT_S, is_ready)
        if answered:
            return result.result().result
        return EXIT_CANCELED if self._cancelled else EXIT_NO_SERVER

    def _without_server(self) -> int:
        return self._no_server(self._options.task.name)

    def _save(self, result: ListVehicleParameters.Result, exit_code: int) -> tuple[int, str]:
        """Write the file; an incomplete list is not saved."""
        path = self._options.file
        if not result.success:
            return exit_code, f"{result.message} Nothing was saved."
        parameters = [Parameter(p.name, p.value, p.type) for p in result.parameters]
        kind = files.format_of(path)
        title = f"Parameters of vehicle {result.system_id}, saved by navigation_client"
        try:
            text = files.text_of(parameters, kind, result.system_id, title)
            files.write_parameters(path, text)
        except files.ParameterFileError as error:
            return EXIT_REJECTED, str(error)
        return EXIT_SUCCESS, f"{len(parameters)} parameters are saved in {path}."


def _exit_code(result: _Response) -> int:
    if result.success:
        return EXIT_SUCCESS
    if isinstance(result, LoadVehicleParameters.Result) and (result.changed or result.unchanged):
        return EXIT_ABORTED
    return EXIT_REJECTED


def _shown(result: _Response) -> tuple[Mapping[str, object], str]:
    """Return a response as facts and as text."""
    if isinstance(result, GetFence.Response):
        facts = {"areas": [_area_facts(area) for area in result.areas]}
        lines = [_area_line(area) for area in result.areas]
        if result.return_point:
            facts["return_point_deg"] = list(result.return_point)
            lines.append(f"return point at {_place(*result.return_point)}")
        return facts, "\n".join([*lines, result.message])
    if isinstance(result, GetRallyPoints.Response):
        points = [_rally_facts(point) for point in result.points]
        lines = [
            f"{_place(p.latitude, p.longitude)}, {p.altitude:g} m {_ABOVE[p.altitude_reference]}"
            for p in result.points
        ]
        return {"points": points}, "\n".join([*lines, result.message])
    if isinstance(result, GetVehicleParameter.Response):
        return {"value": _value(result.parameter.value) if result.success else None}, result.message
    if isinstance(result, ListVehicleParameters.Result):
        values = {p.name: _value(p.value) for p in result.parameters}
        lines = [f"{p.name:<16} {parameter_text(p.value)}" for p in result.parameters]
        return {"parameters": values}, "\n".join([*lines, result.message])
    if isinstance(result, LoadVehicleParameters.Result):
        return _load_shown(result)
    return {}, result.message


def _value(value: float) -> float | None:
    """Return a value for JSON: an integer as one, null for what is not a number."""
    if not math.isfinite(value):
        return None
    return int(value) if value.is_integer() and abs(value) < 2.0**53 else value


def _load_shown(result: LoadVehicleParameters.Result) -> tuple[Mapping[str, object], str]:
    facts = {
        "changed": list(result.changed),
        "unchanged": list(result.unchanged),
        "unknown": list(result.unknown),
        "failed": dict(zip(result.failed, result.reasons, strict=True)),
    }
    lines = [f"changed  {name}" for name in result.changed]
    lines += [f"unknown  {name}" for name in result.unknown]
    lines += [f"failed   {reason}" for reason in result.reasons]
    return facts, "\n".join([*lines, result.message])


def _area_facts(area: FenceArea) -> dict[str, object]:
    return {
        "inclusion": area.inclusion,
        "in_force": area.in_force,
        "points_deg": [list(p) for p in zip(area.latitudes, area.longitudes, strict=True)],
        "radius_m": area.radius if area.shape == FenceArea.CIRCLE else None,
    }


def _area_line(area: FenceArea) -> str:
    kind = "inclusion" if area.inclusion else "exclusion"
    places = [_place(*p) for p in zip(area.latitudes, area.longitudes, strict=True)]
    if area.shape == FenceArea.CIRCLE:
        return f"{kind}  circle of {area.radius:g} m about {places[0]}"
    return f"{kind}  polygon of {len(places)} corners: {'; '.join(places)}"


def _rally_facts(point: RallyPoint) -> dict[str, object]:
    return {
        "position_deg": [point.latitude, point.longitude],
        "altitude_m": point.altitude,
        "reference": _ABOVE[point.altitude_reference],
    }


def _place(latitude_deg: float, longitude_deg: float) -> str:
    return f"{latitude_deg:.7f}, {longitude_deg:.7f}"
