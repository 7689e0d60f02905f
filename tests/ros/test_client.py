"""The navigation client in flight: other goals, keys on a terminal, scripts that read it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight, navigate_goal
from tests.support.ros.terminal import Terminal

pytestmark = pytest.mark.xdist_group("ros_client")
CLIENT = ["-m", "drone_navigation.navigation_client"]
FAR = ["--goal", "60", "0", "3", "--speed", "2"]
_LATE = "Goal rejected: NO_POSITION"


@pytest.fixture(scope="module", autouse=True)
def in_the_air(flight: Flight) -> None:
    """So that no test waits for a take-off of its own."""
    record = flight.send(navigate_goal(0.0, 0.0, 3.0))
    flight.wait_for_status(record, "NAVIGATING")
    flight.cancel(record)
    flight.wait_for_result(record)


def client(flight: Flight, *arguments: str) -> Process:
    return Process("client", ["python", *CLIENT, *arguments], flight.environment)


def objects(shown: Process) -> list[dict[str, Any]]:
    return [json.loads(line) for line in shown.lines]


def test_updates_replace_the_goal_in_flight_and_the_last_end_counts(flight: Flight) -> None:
    ahead = ["--frame", "base_link", "--goal", "60", "0", "0", "--speed", "2"]
    shown = client(flight, *ahead, "--json", "--update", "t=1.5: 0 0 0", "--update", "t=1: 60 5 0")
    assert shown.wait(50.0) == 0, shown.text
    told = objects(shown)
    sent = [each["description"] for each in told if each["event"] == "sending"]
    assert [text.split(" m ")[0] for text in sent] == [
        "goal (60, 0, 0)",
        "goal (60, 5, 0)",
        "goal (0, 0, 0)",
    ]
    ends = {each["goal"]: each for each in told if each["event"] == "ended"}
    assert [ends[goal]["code"] for goal in (1, 2, 3)] == ["PREEMPTED", "PREEMPTED", "SUCCESS"]
    assert [ends[goal]["replaced"] for goal in (1, 2, 3)] == [True, True, False]
    assert told[-1] == {"event": "exit", "t_s": told[-1]["t_s"], "code": 0}
    # A goal that was replaced is not heard of again, but for its end.
    goals = [each["goal"] for each in told if each["event"] == "feedback"]
    assert goals == sorted(goals)
    assert set(goals) == {1, 2, 3}
    feedback = next(each for each in told if each["event"] == "feedback")
    assert len(feedback["position_enu_m"]) == 3
    assert feedback["replans"] == 0


@pytest.mark.wide
def test_an_update_after_the_arrival_continues_from_there(flight: Flight) -> None:
    # Each lets the vehicle settle where it is; the second is due long after the first has ended.
    here = ["--frame", "base_link", "--goal", "0", "0", "0"]
    shown = client(flight, *here, "--update", "t=6: 0 0 0")
    assert shown.wait(40.0) == 0, shown.text
    assert shown.text.count("SUCCESS: ") == 2
    assert "Goal 2 accepted" in shown.text


def test_an_update_that_is_rejected_leaves_the_goal_and_is_not_forgotten(flight: Flight) -> None:
    here = ["--frame", "base_link", "--goal", "0", "0", "0"]
    shown = client(flight, *here, "--update", "t=0: 0 0 -50")
    assert shown.wait(30.0) == 3, shown.text
    assert "Goal rejected: BELOW_GROUND: " in shown.text
    assert "SUCCESS: " in shown.text


def test_json_holds_a_rejection_and_nothing_else(flight: Flight) -> None:
    shown = client(flight, "--goal", "0", "0", "-5", "--json")
    assert shown.wait(30.0) == 3
    told = objects(shown)
    events = [each["event"] for each in told if each["event"] != "said"]
    assert events == ["sending", "rejected", "exit"]
    assert told[-2]["code"] == "BELOW_GROUND"


def test_updates_that_are_not_due_yet_are_dropped_by_a_cancel(flight: Flight) -> None:
    shown = client(flight, *FAR, "--cancel-after", "1", "--update", "t=600: 0 0 3")
    assert shown.wait(30.0) == 4, shown.text
    assert "Not sent: goal (0, 0, 3) at 600 s" in shown.text


def test_a_reader_that_goes_away_does_not_end_the_flight(flight: Flight) -> None:
    here = ["--frame", "base_link", "--goal", "0", "0", "0"]
    child = subprocess.Popen(
        [sys.executable, *CLIENT, *here, "--json"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=flight.environment,
    )
    try:
        assert child.stdout is not None
        assert child.stderr is not None
        with child.stdout, child.stderr:
            assert child.stdout.readline().startswith("{")
            child.stdout.close()
            assert child.wait(30.0) == 0
            assert child.stderr.read() == ""
    finally:
        child.kill()
        child.wait(10.0)


def assert_cursor_is_back(terminal: Terminal) -> None:
    assert terminal.raw.rindex("\x1b[?25h") > terminal.raw.rindex("\x1b[?25l")


@pytest.fixture
def terminal(flight: Flight) -> Iterator[Terminal]:
    shown = Terminal([*CLIENT, *FAR], flight.environment)
    yield shown
    shown.close()


def test_the_keys_pause_resume_send_and_cancel(terminal: Terminal) -> None:
    terminal.wait_for("NAVIGATING", 45.0)
    assert terminal.modes != terminal.modes_before
    terminal.type("p")
    terminal.wait_for("is paused.", 10.0)
    terminal.wait_for(" PAUSED ", 10.0)
    terminal.type("r")
    terminal.wait_for("is resumed.", 10.0)
    terminal.wait_for(" NAVIGATING ", 10.0)
    terminal.type("?")
    terminal.wait_for("second Ctrl-C stops waiting.", 10.0)
    terminal.type("g0 0\r")
    terminal.wait_for("'0 0' is not a point; give three numbers: x y z.", 10.0)
    terminal.type(" 3")
    terminal.wait_for("0 0 3", 10.0)  # continues from what was typed
    terminal.type("\r")
    number = 2
    # A machine that stood still for a second has no position to accept a goal with.
    while (
        terminal.wait_for_any((f" {number}: goal (0, 0, 3) m in frame map", _LATE), 10.0) == _LATE
    ):
        number += 1
        terminal.type("g0 0 3\r")
    # The end of the first comes before the second is accepted, or after.
    for line in ("Goal 1 ended: PREEMPTED", f"Goal {number} accepted"):
        if line not in terminal.text:
            terminal.wait_for(line, 10.0)
    terminal.type("g1 2\x1b")  # thought better of
    terminal.type("c")
    assert terminal.wait(30.0) == 4, terminal.text
    assert "CANCELED: " in terminal.text
    assert f"Goal {number + 1}" not in terminal.text
    assert terminal.modes == terminal.modes_before
    assert_cursor_is_back(terminal)


def test_ctrl_c_cancels_waits_for_the_stop_and_gives_the_terminal_back(terminal: Terminal) -> None:
    terminal.wait_for("NAVIGATING", 45.0)
    terminal.type("g1 2")  # Ctrl-C cancels even while something is being typed
    terminal.type("\x03")
    terminal.wait_for("Cancelling; waiting for the vehicle to stop", 10.0)
    assert terminal.wait(30.0) == 4, terminal.text
    assert "CANCELED: " in terminal.text
    assert terminal.modes == terminal.modes_before


def test_a_second_ctrl_c_stops_waiting_for_a_server_that_hangs(
    flight: Flight, terminal: Terminal
) -> None:
    terminal.wait_for("NAVIGATING", 45.0)
    assert flight.server is not None
    flight.server.signal(signal.SIGSTOP)
    try:
        terminal.type("\x03")
        terminal.wait_for("Cancelling; ", 10.0)
        terminal.type("\x03")
        assert terminal.wait(10.0) == 1, terminal.text
    finally:
        flight.server.signal(signal.SIGCONT)
    # The cancel may have got lost; away from where the next test sends the vehicle. The server
    # rejects goals until it has heard a position since it was stopped.
    record = flight.send(navigate_goal(0.0, 0.0, 3.0))
    while not record.accepted:
        record = flight.send(navigate_goal(0.0, 0.0, 3.0))
    flight.wait_for_result(record)
    assert "No longer waiting" in terminal.text
    assert terminal.modes == terminal.modes_before


def test_ctrl_z_lends_the_terminal_to_the_shell(terminal: Terminal) -> None:
    terminal.wait_for("NAVIGATING", 45.0)
    terminal.type("\x1a")
    terminal.wait_for_stop(10.0)
    assert terminal.modes == terminal.modes_before
    assert_cursor_is_back(terminal)
    terminal.signal(signal.SIGCONT)
    terminal.wait_for("p pause", 10.0)
    terminal.type("c")
    assert terminal.wait(30.0) == 4, terminal.text
    assert terminal.modes == terminal.modes_before


@pytest.mark.wide
def test_a_killed_client_gives_the_terminal_back(flight: Flight, terminal: Terminal) -> None:
    terminal.wait_for("NAVIGATING", 45.0)
    terminal.type("\x1c")  # Ctrl-\
    assert terminal.wait(10.0) == -signal.SIGQUIT
    assert terminal.modes == terminal.modes_before
    assert_cursor_is_back(terminal)
    flight.call("hold")  # the goal that nobody follows any longer
