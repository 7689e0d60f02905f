"""The commands of navigation_client on a vehicle in flight, with their exit codes."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight, navigate_goal

# Each command is a process of its own, and a process may take 10 s to start on a busy machine.
pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_client_commands")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]


def run(flight: Flight, *arguments: str) -> tuple[int | None, str]:
    shown = Process("client", [*CLIENT, *arguments], flight.environment)
    return shown.wait(90.0), shown.text


def told(flight: Flight, *arguments: str) -> tuple[int | None, dict[str, Any]]:
    code, text = run(flight, *arguments, "--json")
    (line,) = text.splitlines()
    return code, json.loads(line)


def test_a_flight_by_commands_alone(flight: Flight) -> None:
    code, seen = told(flight, "status")
    assert (code, seen["event"], seen["armed"]) == (0, "status", False)

    code, text = run(flight, "takeoff", "--height", "3")
    assert code == 0, text
    assert "SUCCESS: " in text
    code, seen = told(flight, "status")
    assert code == 0
    assert (seen["armed"], seen["landed_state"], seen["active_goal"]) == (True, "in air", None)
    assert seen["position_enu_m"][2] == pytest.approx(3.0, abs=1.0)
    assert 50.0 < seen["battery_percent"] <= 100.0

    code, text = run(flight, "return", "--cancel-after", "0")
    assert code == 4, text
    code, answer = told(flight, "mode", "brake")
    assert (code, answer["event"], answer["success"]) == (0, "mode", True), answer
    code, answer = told(flight, "mode", "HOVER")
    assert (code, answer["success"]) == (3, False)
    assert "has no mode 'HOVER'" in answer["message"]

    record = flight.send(navigate_goal(80.0, 0.0, 3.0, speed=0.5))  # longer than the clients take
    flight.wait_for_status(record, "NAVIGATING")
    code, text = run(flight, "status")
    assert code == 0
    assert "armed, in air" in text
    code, answer = told(flight, "mode", "LOITER")
    assert code == 3  # not while a goal is active
    code, text = run(flight, "hold")
    assert code == 0, text
    assert flight.wait_for_result(record).message.startswith("PREEMPTED: ")

    code, text = run(flight, "land")
    assert code == 0, text
    assert run(flight, "arm")[0] == 0  # from LAND, in which an ArduCopter is not armed
    assert run(flight, "disarm")[0] == 0


def test_a_vehicle_that_does_not_exist_is_answered_with_those_that_do(flight: Flight) -> None:
    for command in (["land"], ["status"], ["--goal", "1", "2", "3"]):
        given = ["--vehicle", "coptr", "--server-timeout", "5"]
        code, text = run(flight, *command, *given)
        assert code == 5, text
        assert "one vehicle without a name: omit --vehicle." in text
