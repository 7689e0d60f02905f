"""The navigation client reports a server that dies, or is stopped, before its answer."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from custom_interfaces.action import Land
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
)
from mavlink_vehicle.codec import mavlink
from tests.support.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, Flight

# Each waits for a take-off and then for a silence, which busy machines draw out.
pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_client")]


def fly(flight: Flight, *options: str) -> Process:
    words = ["python", "-m", "drone_navigation.navigation_client", "--goal", "60", "0", "3"]
    client = Process("client", [*words, "--speed", "1", *options], flight.environment)
    client.wait_for("NAVIGATING", FLIGHT_TIMEOUT_S)
    return client


def kill_server(flight: Flight) -> None:
    assert flight.server is not None
    flight.server.signal(signal.SIGKILL)
    flight.server.stop()


def start_server(flight: Flight) -> None:
    flight.server = flight.start_server()
    flight.server.wait_for("Position valid", READY_TIMEOUT_S)
    flight.renew_client()


def test_a_server_that_is_killed_is_given_up_after_the_lost_timeout(flight: Flight) -> None:
    client = fly(flight, "--lost-timeout", "6")
    kill_server(flight)
    assert client.wait(FLIGHT_TIMEOUT_S) == 5, client.text
    assert "Server silent for 5 s: it has ended, hangs, or the network" in client.text
    assert "Server lost: silent for 6 s." in client.text
    start_server(flight)


def test_a_server_started_again_does_not_know_the_goal(flight: Flight) -> None:
    # A busy machine takes its time to start one.
    client = fly(flight, "--lost-timeout", "90")
    kill_server(flight)
    start_server(flight)
    assert client.wait(FLIGHT_TIMEOUT_S) == 5, client.text
    assert "The server no longer knows goal 1: it was restarted" in client.text
    assert "Server lost" not in client.text


@pytest.mark.night
def test_a_client_that_was_suspended_for_more_than_a_minute_learns_the_end(flight: Flight) -> None:
    assert flight.server is not None
    line = len(flight.server.lines)
    words = ["python", "-m", "drone_navigation.navigation_client", "--goal", "2", "0", "3"]
    client = Process("client", [*words, "--lost-timeout", "300"], flight.environment)
    client.wait_for("NAVIGATING", FLIGHT_TIMEOUT_S)
    client.signal(signal.SIGSTOP)
    try:
        flight.server.wait_for("ended: SUCCESS", FLIGHT_TIMEOUT_S, after=line)
        flight.spin_for(64.0)
    finally:
        client.signal(signal.SIGCONT)
    assert client.wait(FLIGHT_TIMEOUT_S) == 0, client.text
    assert "The server responds again" in client.text


# Each with the answer that is lost, and what the server sends for it.
COMMANDS = {
    "logs": (("logs",), "LOG_ENTRY", "LOG_REQUEST_LIST"),
    "download": (("download", "1"), "LOG_DATA", "LOG_REQUEST_DATA"),
    "fence": (("fence",), "MISSION_COUNT", "MISSION_REQUEST_LIST"),
    "rally": (("rally",), "MISSION_COUNT", "MISSION_REQUEST_LIST"),
    "get": (("parameters", "get", "WPNAV_SPEED"), "PARAM_VALUE", "PARAM_REQUEST_READ"),
    "list": (("parameters", "list"), "PARAM_VALUE", "PARAM_REQUEST_LIST"),
    "arm": (("arm",), "HEARTBEAT", "COMMAND_LONG"),
}


def _asks(flight: Flight, name: str) -> int:
    """Return how often the server has asked the vehicle what a command waits for."""
    asked = flight.relay.from_server(COMMANDS[name][2])
    if name == "arm":  # it commands other things, too
        asked = [each for each in asked if each.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM]
    return len(asked)


def _catches_signals(process: Process) -> bool:
    """Whether a process has come so far that it handles SIGTERM."""
    status = Path(f"/proc/{process.pid}/status")
    text = status.read_text("ascii") if status.exists() else ""
    caught = re.search(r"^SigCgt:\s*(\w+)", text, re.MULTILINE)
    return caught is not None and bool(int(caught[1], 16) >> (signal.SIGTERM - 1) & 1)


# 8 s without a status, and the time that a busy machine adds to each of its steps.
NOTICED_S = 60.0


@pytest.fixture
def waiting(flight: Flight) -> Iterator[Callable[[str], Process]]:
    """Start a command whose answer does not come: the vehicle's is lost."""
    if flight.server is None or flight.server.returncode is not None:
        start_server(flight)
        flight.spin_for(3.0)  # it reads the lists for itself
    down = flight.send(Land.Goal())  # from a test before
    if down.accepted:
        flight.wait_for_result(down)
    flight.call("arm")  # so that there is a log
    flight.call("disarm")
    clients: list[Process] = []

    def start(name: str) -> Process:
        words, lost, _ = COMMANDS[name]
        before = _asks(flight, name)
        flight.relay.withheld = frozenset({lost, "FILE_TRANSFER_PROTOCOL", "COMMAND_ACK"})
        command = ["python", "-m", "drone_navigation.navigation_client", *words]
        clients.append(Process("client", command, flight.environment))
        # A busy machine takes its time to start one, and the server itself asks now and then.
        flight.wait(lambda: _catches_signals(clients[-1]), READY_TIMEOUT_S, "the client's start")
        flight.spin_for(2.0)
        flight.wait(lambda: _asks(flight, name) > before, READY_TIMEOUT_S, "the request")
        flight.spin_for(0.5)
        return clients[-1]

    yield start
    flight.relay.withheld = frozenset()
    for client in clients:
        client.stop()


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_whose_server_is_killed_ends(
    flight: Flight, waiting: Callable[[str], Process], name: str
) -> None:
    client = waiting(name)
    assert client.returncode is None, client.text
    kill_server(flight)
    assert client.wait(NOTICED_S) == EXIT_NO_SERVER, client.text
    assert "Server lost: silent for 8 s." in client.text
    assert "Traceback" not in client.text


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_whose_server_is_stopped_ends(
    flight: Flight, waiting: Callable[[str], Process], name: str
) -> None:
    client = waiting(name)
    assert flight.server is not None
    flight.server.signal(signal.SIGTERM)
    assert client.wait(NOTICED_S) in (EXIT_ABORTED, EXIT_REJECTED, EXIT_NO_SERVER), client.text
    assert "server" in client.text
    assert flight.server.wait(NOTICED_S) == 0
    assert "Traceback" not in client.text + flight.server.text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_that_is_stopped_ends(
    waiting: Callable[[str], Process], name: str, number: signal.Signals
) -> None:
    client = waiting(name)
    client.signal(number)
    assert client.wait(NOTICED_S) == EXIT_CANCELED, client.text
    assert "Traceback" not in client.text
