"""The navigation client reports a server that dies during a goal."""

from __future__ import annotations

import signal

import pytest

from drone_navigation.processes import Process
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, READY_TIMEOUT_S, Flight

# Each waits for a take-off and then for a silence, which busy machines draw out.
pytestmark = pytest.mark.xdist_group("ros_client")


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
