"""The server is a managed node: each transition, also in flight, and those that do not exist."""

from __future__ import annotations

import math
import socket
from collections.abc import Iterator

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

from custom_interfaces.msg import GoalCode
from drone_navigation.process_control.stop_signals import STOP_LIMIT_S
from navigation_bridge.names import ACTION_NAME, SERVER_NODE_NAME
from tests.support.processes import Process
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal

pytestmark = pytest.mark.xdist_group("ros_lifecycle")

UNCONFIGURED, INACTIVE = State.PRIMARY_STATE_UNCONFIGURED, State.PRIMARY_STATE_INACTIVE
ACTIVE = State.PRIMARY_STATE_ACTIVE
CONFIGURE, CLEANUP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP
ACTIVATE, DEACTIVATE = Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE
CLEANED_UP_SHUTDOWN = Transition.TRANSITION_UNCONFIGURED_SHUTDOWN
_ENDED_S = STOP_LIMIT_S + 10.0
# Commands of Nav2's lifecycle manager, by what it calls for a single node without a bond
# (nav2_lifecycle_manager, August 2026): each transition and the state it asks for after it.
NAV2_STARTUP = ((CONFIGURE, INACTIVE), (ACTIVATE, ACTIVE))
NAV2_PAUSE = ((DEACTIVATE, INACTIVE),)
NAV2_RESUME = ((ACTIVATE, ACTIVE),)
NAV2_RESET = ((DEACTIVATE, INACTIVE), (CLEANUP, UNCONFIGURED))
NAV2_SHUTDOWN = (*NAV2_RESET, (CLEANED_UP_SHUTDOWN, State.PRIMARY_STATE_FINALIZED))


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    flight = Flight(tmp_path_factory.mktemp("lifecycle"))
    try:
        yield flight
    finally:
        flight.close()


@pytest.fixture
def flight(vehicle: Flight) -> Flight:
    """The vehicle with an active server."""
    if state(vehicle) == UNCONFIGURED:
        configure(vehicle)
    if state(vehicle) == INACTIVE:
        assert change(vehicle, ACTIVATE)
    return vehicle


def configure(flight: Flight) -> None:
    """Configure the server, and wait until it knows its vehicle again."""
    assert flight.server is not None
    seen = len(flight.server.lines)
    assert change(flight, CONFIGURE)
    flight.server.wait_for("Position valid", READY_TIMEOUT_S, after=seen)


def state(flight: Flight) -> int:
    client = flight.node.create_client(GetState, f"{SERVER_NODE_NAME}/get_state")
    assert client.wait_for_service(timeout_sec=READY_TIMEOUT_S)
    answer = client.call_async(GetState.Request())
    flight.wait(answer.done, 10.0, "the state")
    flight.node.destroy_client(client)
    return int(answer.result().current_state.id)


def change(flight: Flight, transition: int, label: str = "") -> bool:
    client = flight.node.create_client(ChangeState, f"{SERVER_NODE_NAME}/change_state")
    assert client.wait_for_service(timeout_sec=READY_TIMEOUT_S)
    wanted = Transition(id=transition, label=label)
    answer = client.call_async(ChangeState.Request(transition=wanted))
    flight.wait(answer.done, 20.0, f"an answer to transition {transition} {label}")
    flight.node.destroy_client(client)
    return bool(answer.result().success)


def speed_m_s(flight: Flight) -> float:
    position = flight.relay.from_vehicle("GLOBAL_POSITION_INT")[-1]
    return math.hypot(position.vx, position.vy) / 100.0


def offers_actions(flight: Flight) -> bool:
    return bool(flight.node.count_services(f"{ACTION_NAME}/_action/send_goal"))


def test_a_server_activates_itself(flight: Flight) -> None:
    assert state(flight) == ACTIVE


def test_a_server_that_is_deactivated_in_flight_leaves_a_vehicle_that_holds(
    flight: Flight,
) -> None:
    record = flight.send(navigate_goal(60.0, 0.0, 5.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.wait(lambda: speed_m_s(flight) > 1.0, 20.0, "flight")
    assert change(flight, DEACTIVATE)

    result = flight.wait_for_result(record)
    assert result.error_code == GoalCode.INACTIVE
    assert "deactivated" in result.message
    assert state(flight) == INACTIVE
    flight.wait(lambda: speed_m_s(flight) < 0.3, 20.0, "a hold")
    heard = len(flight.relay.from_vehicle("GLOBAL_POSITION_INT"))
    rejected = flight.send(navigate_goal(0.0, 0.0, 5.0))
    assert not rejected.accepted
    flight.wait(lambda: "INACTIVE: " in "".join(flight.rejections[-1:]), 5.0, "the reason")
    refused = flight.call("arm")
    assert not refused.success
    assert "activate it" in refused.message
    positions = flight.relay.from_vehicle
    flight.wait(lambda: len(positions("GLOBAL_POSITION_INT")) > heard, 5.0, "telemetry")

    assert change(flight, ACTIVATE)
    assert flight.wait_for_result(flight.send(navigate_goal(5.0, 0.0, 5.0))).success


@pytest.mark.parametrize(("transition", "label"), [(CONFIGURE, ""), (0, "configure"), (99, "")])
def test_a_transition_that_does_not_exist_is_rejected(
    flight: Flight, transition: int, label: str
) -> None:
    assert not change(flight, transition, label)
    assert state(flight) == ACTIVE
    assert flight.server is not None
    flight.server.wait_for("There is no transition", 10.0)


def test_a_cleaned_up_server_has_closed_its_link_and_can_be_configured_again(
    flight: Flight,
) -> None:
    assert change(flight, 0, "deactivate")
    assert change(flight, CLEANUP)
    assert state(flight) == UNCONFIGURED
    flight.wait(lambda: not offers_actions(flight), 10.0, "the end of the actions")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", flight.port))
        # Another program has the link: the server stays as it is, and says why.
        assert not change(flight, CONFIGURE)
        assert state(flight) == UNCONFIGURED
    assert flight.server is not None
    flight.server.wait_for(str(flight.port), 10.0)

    configure(flight)
    assert state(flight) == INACTIVE
    assert change(flight, ACTIVATE)
    flight.renew_client()
    assert flight.wait_for_result(flight.send(navigate_goal(0.0, 0.0, 5.0))).success


def test_a_recording_continues_when_a_server_is_configured_again(flight: Flight) -> None:
    (path,) = flight.folder.glob("flight-*.tlog")
    assert change(flight, DEACTIVATE)
    assert change(flight, CLEANUP)
    before = path.read_bytes()
    assert before
    configure(flight)
    flight.wait(lambda: path.stat().st_size > len(before), READY_TIMEOUT_S, "more of the recording")
    assert path.read_bytes().startswith(before)


def test_the_last_transition_ends_the_process(flight: Flight) -> None:
    record = flight.send(navigate_goal(60.0, 0.0, 5.0))
    flight.wait_for_status(record, "NAVIGATING")
    assert change(flight, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert flight.server is not None
    assert flight.server.wait(_ENDED_S) == 0
    assert "Traceback" not in flight.server.text
    assert flight.wait_for_result(record).error_code == GoalCode.SHUTTING_DOWN


def unconfigured_server(vehicle: Flight) -> Process:
    """A new server that waits for its manager."""
    if vehicle.server is not None:
        vehicle.server.stop(_ENDED_S)
    if "autostart:=false" not in vehicle._arguments:
        vehicle._arguments = (*vehicle._arguments, "--ros-args", "-p", "autostart:=false")
    vehicle.server = vehicle.start_server()
    vehicle.renew_node()
    assert state(vehicle) == UNCONFIGURED
    return vehicle.server


def command(flight: Flight, steps: tuple[tuple[int, int], ...]) -> None:
    """Execute a command of Nav2's manager, which gives it up at the first step that fails."""
    assert flight.server is not None
    for wanted, reached in steps:
        assert change(flight, wanted), flight.server.text[-2000:]
        assert state(flight) == reached


@pytest.mark.wide
def test_the_commands_of_nav2s_manager_succeed(vehicle: Flight) -> None:
    server = unconfigured_server(vehicle)
    command(vehicle, NAV2_STARTUP)
    server.wait_for("Position valid", READY_TIMEOUT_S)
    vehicle.renew_client()
    record = vehicle.send(navigate_goal(60.0, 0.0, 5.0))
    vehicle.wait_for_status(record, "NAVIGATING")
    command(vehicle, NAV2_PAUSE)
    assert vehicle.wait_for_result(record).error_code == GoalCode.INACTIVE
    command(vehicle, NAV2_RESUME)
    command(vehicle, NAV2_RESET)
    command(vehicle, NAV2_STARTUP)
    command(vehicle, NAV2_SHUTDOWN)
    assert server.wait(_ENDED_S) == 0


def test_without_autostart_it_waits_for_its_manager(vehicle: Flight) -> None:
    server = unconfigured_server(vehicle)
    assert not offers_actions(vehicle)
    assert change(vehicle, CONFIGURE)
    server.wait_for("Position valid", READY_TIMEOUT_S)
    vehicle.renew_client()
    assert not vehicle.send(navigate_goal(0.0, 0.0, 5.0)).accepted
    assert change(vehicle, ACTIVATE)
    assert vehicle.wait_for_result(vehicle.send(navigate_goal(2.0, 0.0, 5.0))).success
    assert change(vehicle, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert server.wait(_ENDED_S) == 0
