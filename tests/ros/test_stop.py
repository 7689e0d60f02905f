"""A server ends within its limit, without a traceback, whatever is pending when it is stopped."""

from __future__ import annotations

import fcntl
import math
import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from std_srvs.srv import Trigger
from unique_identifier_msgs.msg import UUID

from custom_interfaces.action import (
    DownloadLog,
    FollowVelocity,
    Land,
    ListVehicleParameters,
    LoadVehicleParameters,
    Navigate,
    NavigateWaypoints,
    ReturnToLaunch,
    Takeoff,
)
from custom_interfaces.msg import FenceArea, GoalCode, VehicleParameter, Waypoint
from custom_interfaces.srv import GetFence, ListLogs, SetFence
from drone_navigation.process_control.stop_signals import EXIT_HUNG, STOP_LIMIT_S
from drone_navigation.processes import Process
from tests.support.processes import STARVED
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal

pytestmark = pytest.mark.xdist_group("ros_stop")

SIGNALS = (signal.SIGINT, signal.SIGTERM)
# The limit holds from the signal on; a busy machine delivers it late, and reaps the process late.
_ENDED_S = STOP_LIMIT_S + 10.0
_WORDS = ("Traceback", "RCLError", "Exception", "was never retrieved", "terminate called")
# The recording fills an unread pipe of this size in a moment.
_PIPE_BYTES = 4096
_FULL_S = 4.0


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """A vehicle with a log of its own; each test starts a server for it."""
    folder = tmp_path_factory.mktemp("stop")
    flight = Flight(folder)
    try:
        assert flight.call("arm").success
        flight.spin_for(2.0)
        assert flight.call("disarm").success
        yield flight
    finally:
        flight.close()


@pytest.fixture
def flight(vehicle: Flight) -> Iterator[Flight]:
    """The vehicle with a running server, and a client that knows it."""
    server = vehicle.server
    if server is None or server.returncode is not None:
        vehicle.server = vehicle.start_server()
        vehicle.server.wait_for("Position valid", READY_TIMEOUT_S)
        vehicle.renew_client()
    yield vehicle
    vehicle.relay.join()
    vehicle.relay.withheld = frozenset()
    vehicle.relay.loss = 0.0
    assert vehicle.server is not None
    vehicle.server.stop(_ENDED_S)


def ended(server: Process, number: signal.Signals) -> int:
    """Send a signal and return the exit code; nothing that it printed is a defect's."""
    server.signal(number)
    code = server.wait(_ENDED_S)
    assert not any(word in server.text for word in _WORDS), server.text
    return code


def stopped(server: Process, number: signal.Signals) -> None:
    """Send a signal and check the end."""
    in_time(server, ended(server, number))


def in_time(server: Process, code: int) -> None:
    """Check that it ended by itself, or by the limit on a machine that starves it."""
    starved = any(words in server.text for words in STARVED)
    assert code == 0 or (code == EXIT_HUNG and starved), server.text


def action(flight: Flight, goal: Any, kind: Any, name: str) -> Any:
    """Send a goal of an action besides those that fly; return its accepted handle."""
    client = ActionClient(flight.node, kind, name)
    assert client.wait_for_server(timeout_sec=READY_TIMEOUT_S)
    sent = client.send_goal_async(goal)
    flight.wait(sent.done, 10.0, "an answer to the goal")
    assert sent.result().accepted
    return sent.result()


def ask(flight: Flight, kind: Any, name: str, **fields: Any) -> Any:
    """Call a service; return the future of its answer, once the server has it."""
    client = flight.node.create_client(kind, f"navigation_server/{name}")
    assert client.wait_for_service(timeout_sec=READY_TIMEOUT_S)
    answer = client.call_async(kind.Request(**fields))
    flight.spin_for(0.4)
    return answer


def speed_m_s(flight: Flight) -> float:
    """Return the vehicle's ground speed."""
    position = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    return math.hypot(position.vx, position.vy) / 100.0


def airborne(flight: Flight) -> None:
    """Have the vehicle in the air."""
    record = flight.send(Takeoff.Goal(height=5.0))
    if record.accepted:
        assert flight.wait_for_result(record).success


# --- what is pending ------------------------------------------------------------------------


def idle(_flight: Flight) -> None:
    """Nothing."""


def checked(flight: Flight) -> None:
    """A goal is on its way."""
    flight._client(Navigate.Goal()).send_goal_async(navigate_goal(10.0, 5.0, 4.0))


def accepted(flight: Flight) -> None:
    """A goal has just been accepted."""
    assert flight.send(navigate_goal(12.0, 5.0, 4.0)).accepted


def taking_off(flight: Flight) -> None:
    """The vehicle takes off."""
    record = flight.send(Takeoff.Goal(height=6.0))
    if record.accepted:  # it is on the ground
        flight.wait_for_status(record, "TAKING_OFF")


def navigating(flight: Flight) -> None:
    """The vehicle flies as fast as it may."""
    record = flight.send(navigate_goal(200.0, 0.0, 6.0, 10.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(4.0)


def cancelling(flight: Flight) -> None:
    """A goal is being cancelled."""
    record = flight.send(navigate_goal(-150.0, 0.0, 6.0, 8.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.spin_for(3.0)
    flight.cancel(record)


def paused(flight: Flight) -> None:
    """A goal is paused."""
    record = flight.send(navigate_goal(150.0, 0.0, 6.0, 3.0))
    flight.wait_for_status(record, "NAVIGATING")
    assert flight.call("pause").success


def unasked(flight: Flight) -> None:
    """No client asks for the goal's result, and nobody spins any more."""
    sent = flight._client(Navigate.Goal()).send_goal_async(navigate_goal(5.0, 0.0, 5.0))
    flight.wait(sent.done, 10.0, "an answer to the goal")
    flight.spin_for(1.0)


def mission(flight: Flight) -> None:
    """A mission is being uploaded."""
    goal = NavigateWaypoints.Goal(execution=NavigateWaypoints.Goal.EXECUTION_MISSION)
    for x in (20.0, 40.0, 60.0):
        goal.waypoints.append(Waypoint())
        goal.waypoints[-1].position.x, goal.waypoints[-1].position.z = x, 6.0
    flight.relay.withheld = frozenset({"MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"})
    assert flight.send(goal).accepted
    flight.spin_for(0.5)


def returning(flight: Flight) -> None:
    """The vehicle returns by itself."""
    airborne(flight)
    assert flight.send(ReturnToLaunch.Goal()).accepted
    flight.spin_for(1.0)


def landing(flight: Flight) -> None:
    """The vehicle lands by itself."""
    airborne(flight)
    assert flight.send(Land.Goal()).accepted
    flight.spin_for(0.5)


def following(flight: Flight) -> None:
    """A goal waits for velocity commands."""
    assert flight.send(FollowVelocity.Goal()).accepted
    flight.spin_for(0.5)


def silent(flight: Flight) -> None:
    """The vehicle of a goal is silent."""
    record = flight.send(navigate_goal(100.0, 0.0, 6.0, 3.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.relay.cut()
    flight.wait_for_status(record, "LINK_LOST")


def one_id_on_two_actions(flight: Flight) -> None:
    """Goals of two actions have one id, of zeros."""
    airborne(flight)
    for goal in (navigate_goal(100.0, 0.0, 6.0, 3.0), Land.Goal()):
        sent = flight._client(goal).send_goal_async(goal, goal_uuid=UUID())
        flight.wait(sent.done, 10.0, "an answer to the goal")
        assert sent.result().accepted
        sent.result().get_result_async()
        flight.spin_for(0.5)


def listing_logs(flight: Flight) -> None:
    """Logs are being listed."""
    flight.relay.withheld = frozenset({"LOG_ENTRY", "FILE_TRANSFER_PROTOCOL"})
    ask(flight, ListLogs, "list_logs")


def downloading(flight: Flight) -> None:
    """A log is being downloaded."""
    flight.relay.withheld = frozenset({"LOG_DATA", "FILE_TRANSFER_PROTOCOL"})
    handle = action(flight, DownloadLog.Goal(log_id=1), DownloadLog, "download_log")
    handle.get_result_async()
    flight.spin_for(1.0)


def arming(flight: Flight) -> None:
    """A service waits for the vehicle."""
    flight.relay.withheld = frozenset({"COMMAND_ACK"})
    ask(flight, Trigger, "arm")


def reading_fence(flight: Flight) -> None:
    """The fence is being read."""
    flight.relay.withheld = frozenset({"MISSION_COUNT"})
    ask(flight, GetFence, "get_fence")


def writing_fence(flight: Flight) -> None:
    """A fence is being written."""
    flight.relay.withheld = frozenset({"MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"})
    area = FenceArea(shape=FenceArea.CIRCLE, inclusion=True, radius=300.0)
    area.latitudes, area.longitudes = [-35.3632621], [149.1652374]
    ask(flight, SetFence, "set_fence", areas=[area])


def listing_parameters(flight: Flight) -> None:
    """Parameters are being listed."""
    flight.relay.withheld = frozenset({"PARAM_VALUE"})
    name, kind = "navigation_server/vehicle_parameters/list", ListVehicleParameters
    action(flight, kind.Goal(), kind, name).get_result_async()
    flight.spin_for(0.5)


def loading_parameters(flight: Flight) -> None:
    """Parameters are being loaded."""
    flight.relay.withheld = frozenset({"PARAM_VALUE"})
    name, kind = "navigation_server/vehicle_parameters/load", LoadVehicleParameters
    goal = kind.Goal(parameters=[VehicleParameter(name="WPNAV_SPEED", value=400.0)])
    goal.while_armed = True
    action(flight, goal, kind, name).get_result_async()
    flight.spin_for(0.5)


STATES: tuple[Callable[[Flight], None], ...] = (
    idle, listing_logs, downloading, arming, reading_fence, writing_fence, listing_parameters,
    loading_parameters, checked, accepted, taking_off, navigating, cancelling, paused, unasked,
    mission, following, one_id_on_two_actions, returning, silent, landing,
)  # fmt: skip


def test_a_download_that_is_stopped_with_the_server_ends_and_says_so(flight: Flight) -> None:
    flight.relay.withheld = frozenset({"LOG_DATA", "FILE_TRANSFER_PROTOCOL"})
    handle = action(flight, DownloadLog.Goal(log_id=1), DownloadLog, "download_log")
    answer = handle.get_result_async()
    flight.spin_for(1.0)
    assert flight.server is not None
    flight.server.signal(signal.SIGINT)
    flight.wait(answer.done, _ENDED_S, "the end of the download")
    assert answer.result().result.message.startswith("SHUTTING_DOWN: ")
    in_time(flight.server, flight.server.wait(_ENDED_S))
    assert not any(word in flight.server.text for word in _WORDS), flight.server.text


@pytest.mark.wide
@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
def test_a_stop_ends_the_process_whatever_is_pending(
    flight: Flight, state: Callable[[Flight], None]
) -> None:
    state(flight)
    assert flight.server is not None
    number = SIGNALS[STATES.index(state) % len(SIGNALS)]
    stopped(flight.server, number)


def test_one_id_on_two_actions_gives_two_results_and_a_stop_ends_the_server(
    flight: Flight,
) -> None:
    airborne(flight)
    results: list[Any] = []
    for goal in (navigate_goal(30.0, 0.0, 4.0, 1.0), Land.Goal()):
        sent = flight._client(goal).send_goal_async(goal, goal_uuid=UUID(uuid=[7] * 16))
        flight.wait(sent.done, 10.0, "an answer to the goal")
        assert sent.result().accepted
        results.append(sent.result().get_result_async())
        flight.spin_for(1.0)
    flight.wait(lambda: all(r.done() for r in results), 60.0, "the end of all goals")
    first, last = results[0].result(), results[-1].result()
    assert first.status == GoalStatus.STATUS_ABORTED
    assert first.result.message.startswith("PREEMPTED: "), first.result.message
    assert last.status == GoalStatus.STATUS_SUCCEEDED, last.result.message

    # The action still knows the id: rejected, with the reason.
    known = len(flight.rejections)
    again = flight._client(Land.Goal()).send_goal_async(Land.Goal(), goal_uuid=UUID(uuid=[7] * 16))
    flight.wait(again.done, 10.0, "an answer to the goal")
    assert not again.result().accepted
    flight.wait(lambda: len(flight.rejections) > known, 5.0, "a reason")
    assert flight.rejections[-1].startswith("BUSY: Goal 0707"), flight.rejections[-1]

    assert flight.server is not None
    stopped(flight.server, signal.SIGTERM)


@pytest.mark.wide
def test_a_goal_that_is_stopped_with_the_server_ends_and_says_so(flight: Flight) -> None:
    record = flight.send(navigate_goal(80.0, 0.0, 5.0, 3.0))
    flight.wait_for_status(record, "NAVIGATING")
    assert flight.server is not None
    flight.server.signal(signal.SIGINT)
    result = flight.wait_for_result(record, _ENDED_S)
    assert result.error_code == GoalCode.SHUTTING_DOWN, result.message
    in_time(flight.server, flight.server.wait(_ENDED_S))


@pytest.mark.wide
def test_a_vehicle_too_fast_to_stop_in_time_is_left_holding(flight: Flight) -> None:
    """From 10 m/s it brakes for 5 s and more, which the server does not have."""
    record = flight.send(navigate_goal(-250.0, 0.0, 5.0, 10.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.wait(lambda: speed_m_s(flight) > 9.0, 30.0, "its speed")
    assert flight.server is not None
    flight.server.signal(signal.SIGTERM)
    result = flight.wait_for_result(record, _ENDED_S)
    assert result.error_code == GoalCode.SHUTTING_DOWN, result.message
    assert "unknown" in result.message
    in_time(flight.server, flight.server.wait(_ENDED_S))
    # Later than its GUID_TIMEOUT of 3 s it has stopped, too; and it does not move again.
    flight.wait(lambda: speed_m_s(flight) < 0.3, 10.0, "the stop")
    flight.spin_for(5.0)
    assert speed_m_s(flight) < 0.3


@pytest.mark.wide
@pytest.mark.parametrize("after_s", [0.3, 0.8, 1.2, 1.6, 2.0, 2.6, 3.4])
def test_a_stop_during_the_start_ends_the_process(vehicle: Flight, after_s: float) -> None:
    server = vehicle.start_server()
    time.sleep(after_s)
    server.signal(signal.SIGINT)
    # Before its own code runs, the signal has its default action.
    assert server.wait(_ENDED_S) in (0, 1, -signal.SIGINT, 130), server.text
    assert not any(word in server.text for word in _WORDS), server.text


def _record_to_pipe(flight: Flight, pipe: Path) -> Process:
    os.mkfifo(pipe)
    link = f"udpin://127.0.0.1:{flight.port}"
    words = ["python", "-m", "drone_navigation.navigation_server", "--link", link]
    return Process("navigation_server", [*words, "--tlog", str(pipe)], flight.environment)


def _takes(server: Process, number: signal.Signals) -> bool:
    """Return whether a process has a handler of its own for a signal."""
    status = Path(f"/proc/{server.pid}/status").read_text("utf-8")
    (mask,) = re.findall(r"^SigCgt:\s*(\w+)", status, re.MULTILINE)
    return bool(int(mask, 16) >> (number - 1) & 1)


@pytest.mark.wide
@pytest.mark.parametrize("number", SIGNALS)
def test_a_driver_that_hangs_is_ended_with_a_code_of_its_own(
    vehicle: Flight, tmp_path: Path, number: signal.Signals
) -> None:
    """The recording's disk takes nothing more: the driver's thread waits in a write."""
    assert vehicle.server is not None
    vehicle.server.stop(_ENDED_S)
    server = _record_to_pipe(vehicle, tmp_path / "recording.tlog")
    reader = os.open(tmp_path / "recording.tlog", os.O_RDONLY | os.O_NONBLOCK)
    fcntl.fcntl(reader, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
    try:
        server.wait_for("Navigation server ready", READY_TIMEOUT_S)
        time.sleep(_FULL_S)
        assert ended(server, number) == EXIT_HUNG, server.text
    finally:
        os.close(reader)
        server.stop()


@pytest.mark.wide
def test_a_start_that_hangs_is_ended_with_a_code_of_its_own(
    vehicle: Flight, tmp_path: Path
) -> None:
    """The recording's file is a pipe that nobody opens: the main thread waits in an open."""
    assert vehicle.server is not None
    vehicle.server.stop(_ENDED_S)
    server = _record_to_pipe(vehicle, tmp_path / "recording.tlog")
    try:
        vehicle.wait(lambda: _takes(server, signal.SIGTERM), READY_TIMEOUT_S, "its own handlers")
        assert ended(server, signal.SIGTERM) == EXIT_HUNG, server.text
    finally:
        server.stop()
