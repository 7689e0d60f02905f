"""The two executables as a person uses them."""

from __future__ import annotations

import signal
import socket
from pathlib import Path

import pytest

from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight, new_domain
from tests.support.ros.terminal import Terminal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_command_line")]
CLIENT = ["python", "-m", "drone_navigation.navigation_client"]
HOME = ["--goal", "0", "0", "3"]
SERVER = ["python", "-m", "drone_navigation.navigation_server"]


def client(flight: Flight, *arguments: str) -> Process:
    return Process("navigation_client", [*CLIENT, *arguments], flight.environment)


@pytest.mark.parametrize("command", [CLIENT, SERVER], ids=["client", "server"])
def test_help_and_usage(command: list[str]) -> None:
    environment = ros_environment(new_domain())
    helped = Process("help", [*command, "--help"], environment)
    assert helped.wait(30.0) == 0
    assert "usage:" in helped.text
    wrong = Process("wrong", [*command, "--no-such-option"], environment)
    assert wrong.wait(30.0) == 2
    assert "no-such-option" in wrong.text
    assert "Traceback" not in wrong.text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--link", "carrier-pigeon://coop"], "carrier-pigeon"),
        (["--ros-args", "-p", "no_such_parameter:=1"], "no_such_parameter"),
        (["--ros-args", "-p", "setpoint_rate_hz:=0.1"], "setpoint_rate_hz"),
        (["--ros-args", "-p", "on_new_goal:=maybe"], "on_new_goal"),
        (["--ros-args", "-p", "obstacles_file:=no/such/obstacles.yaml"], "no/such/obstacles.yaml"),
        (["--ros-args", "-p", "sensor_pose:=there"], "x y z roll pitch yaw"),
        (["--config", "no/such/file.yaml"], "no/such/file.yaml"),
        (["--ros-args", "--params-file", "no/such/file.yaml"], "no/such/file.yaml: No such file"),
        (["--ros-args", "-p", "armin:=never"], "did you mean 'arming'?"),
        (["--ros-args", "-p", "setpoint_rate_hz:=fast"], "setpoint_rate_hz"),
        (["--tlog", "no/such/a.tlog"], "the folder no/such does not exist; create it first."),
        (["--timeout", "3"], "--timeout is for --check"),
        (["--no-computer"], "--no-computer is for --check"),
        (["--check", "--computer-row"], "one of --check, --computer-row and --shadow-goals"),
    ],
    ids=[
        "link",
        "unknown",
        "range",
        "choice",
        "obstacles",
        "sensor pose",
        "file",
        "params file",
        "misspelt",
        "type",
        "folder",
        "timeout",
        "no computer",
        "two commands",
    ],
)
def test_a_bad_set_up_is_one_sentence_and_exit_code_2(arguments: list[str], sentence: str) -> None:
    server = Process("server", [*SERVER, *arguments], ros_environment(new_domain()))
    try:
        assert server.wait(30.0) == 2
    finally:
        server.stop()
    assert sentence in server.text
    assert "Traceback" not in server.text


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("navigation_sever:\n  ros__parameters:\n    arming: never\n", "navigation_server"),
        ("navigation_server:\n  arming: never\n", "ros__parameters"),
        ("just words", "ros__parameters"),
        ("", "ros__parameters"),
        ("a: [1, 2", "mine.yaml:1: "),
        ("navigation_server:\n  ros__parameters:\n    armin: never\n", "'armin'"),
        ("navigation_server:\n  ros__parameters:\n    arming: 3\n", "arming"),
    ],
    ids=["other node", "no level", "text", "empty", "broken", "unknown", "type"],
)
def test_a_bad_parameter_file_is_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    config = tmp_path / "mine.yaml"
    config.write_text(text, encoding="utf-8")
    server = Process("server", [*SERVER, "--config", str(config)], ros_environment(new_domain()))
    try:
        assert server.wait(30.0) == 2, server.text
    finally:
        server.stop()
    assert sentence in server.text
    assert "Traceback" not in server.text


@pytest.mark.parametrize("program", ["client", "console", "server"])
@pytest.mark.parametrize("arguments", [["--check"], ["-p"]], ids=["unknown", "incomplete"])
def test_a_bad_ros_argument_is_one_sentence(program: str, arguments: list[str]) -> None:
    module = f"drone_navigation.navigation_{program}"
    command = ["python", "-m", module, "--ros-args", *arguments]
    wrong = Process(program, command, ros_environment(new_domain()))
    assert wrong.wait(30.0) == 2
    assert wrong.text.startswith(f"navigation_{program}: invalid ROS arguments: ")
    assert "Traceback" not in wrong.text


def test_a_port_that_is_none_is_one_sentence() -> None:
    command = ["python", "-m", "drone_navigation.navigation_console", "--port", "abc"]
    wrong = Process("console", command, ros_environment(new_domain()))
    assert wrong.wait(30.0) == 2
    assert "'abc' is not a port from 0 to 65535" in wrong.text


def test_the_client_says_when_there_is_no_server() -> None:
    lonely = Process(
        "client", [*CLIENT, *HOME, "--server-timeout", "1"], ros_environment(new_domain())
    )
    assert lonely.wait(30.0) == 5
    assert "start navigation_server" in lonely.text


def test_ctrl_c_ends_the_wait_for_a_server() -> None:
    lonely = Process(
        "client", [*CLIENT, *HOME, "--server-timeout", "60"], ros_environment(new_domain())
    )
    try:
        lonely.wait_for("Waiting for a server", 30.0)
        lonely.signal(signal.SIGINT)
        assert lonely.wait(10.0) == 4
    finally:
        lonely.stop()
    assert "Interrupted; no goal was sent." in lonely.text


def test_without_a_target_the_vehicle_is_shown_and_nothing_is_sent(flight: Flight) -> None:
    shown = client(flight)
    assert shown.wait(30.0) == 2
    assert "usage: navigation_client" in shown.text
    assert "ArduCopter" in shown.text
    assert shown.lines[-1] == "No target was given, and nothing was sent."
    assert flight.server is not None
    assert "accepted" not in flight.server.text


def test_on_a_terminal_the_goal_of_the_course_is_offered(flight: Flight) -> None:
    declined = Terminal(CLIENT[1:], flight.environment)
    declined.wait_for("Fly to the goal of the course, (10, 5, 2) m? [y/N]", 30.0)
    declined.type("\r")
    assert declined.wait(30.0) == 2
    taken = Terminal([*CLIENT[1:], "--cancel-after", "0.5"], flight.environment)
    taken.wait_for("[y/N]", 30.0)
    taken.type("y\r")
    taken.wait_for("goal (10, 5, 2) m in frame map", 30.0)
    assert taken.wait(60.0) == 4


def test_the_client_shows_a_flight_and_exits_with_0(flight: Flight) -> None:
    shown = client(flight, "--goal", "3", "2", "2", "--speed", "2")
    assert shown.wait(60.0) == 0, shown.text
    for words in ("Goal accepted", "TAKING_OFF", "NAVIGATING", "battery", "SUCCESS: "):
        assert words in shown.text
    assert "\x1b[" not in shown.text  # no colours where there is no terminal


def test_a_rejected_goal_gives_the_reason_and_exit_code_3(flight: Flight) -> None:
    shown = client(flight, "--goal", "3", "2", "-5")
    assert shown.wait(30.0) == 3
    assert "BELOW_GROUND: " in shown.text


def test_ctrl_c_cancels_and_waits_for_the_stop(flight: Flight) -> None:
    shown = client(flight, "--goal", "40", "0", "3", "--yaw", "90")
    shown.wait_for("NAVIGATING", 40.0)
    shown.signal(signal.SIGINT)
    assert shown.wait(30.0) == 4, shown.text
    assert "CANCELED: " in shown.text


def test_cancel_after_is_a_cancel(flight: Flight) -> None:
    shown = client(flight, "--goal", "40", "30", "3", "--cancel-after", "2")
    assert shown.wait(60.0) == 4, shown.text


def test_a_parameter_file_is_a_set_up(tmp_path: Path) -> None:
    port = free_udp_port()
    config = tmp_path / "mine.yaml"
    config.write_text(
        "navigation_server:\n  ros__parameters:\n"
        f"    link_url: 'udpin://127.0.0.1:{port}'\n    speed_default_m_s: 2\n",
        encoding="utf-8",
    )
    server = Process("server", [*SERVER, "--config", str(config)], ros_environment(new_domain()))
    try:
        line = server.wait_for("Navigation server ready", 30.0)
        assert str(port) in line
        assert "never arms" in line  # a link was named, so nobody may arm unless told
    finally:
        assert server.stop() == 0


PLAN = """
{"fileType": "Plan", "version": 1, "mission": {"version": 2, "firmwareType": 3, "items": [
  {"type": "SimpleItem", "command": 22, "frame": 3, "autoContinue": true,
   "params": [0, 0, 0, null, 0, 0, 3]},
  {"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": true,
   "params": [0, 2, 0, null, -35.363200, 149.165230, 3]},
  {"type": "SimpleItem", "command": 16, "frame": 3, "autoContinue": true,
   "params": [0, 2, 0, null, -35.363200, 149.165300, 4]}]}}
"""


@pytest.mark.parametrize("how", [[], ["--mission"]], ids=["setpoints", "mission"])
def test_the_client_flies_a_plan_file(flight: Flight, tmp_path: Path, how: list[str]) -> None:
    plan = tmp_path / "small.plan"
    plan.write_text(PLAN, encoding="utf-8")
    shown = client(flight, "--plan", str(plan), *how)
    assert shown.wait(90.0) == 0, shown.text
    for words in (
        "item 1: take-off to 3 m skipped",
        "a route of 2 waypoints",
        "SUCCESS: ",
        "2 of 2",
    ):
        assert words in shown.text
    assert ("as a mission" in shown.text) == bool(how)


def test_a_bad_plan_file_is_one_sentence_and_exit_code_2(tmp_path: Path) -> None:
    environment = ros_environment(new_domain())
    plan = tmp_path / "bad.plan"
    plan.write_text("{", encoding="utf-8")
    for arguments, sentence in (
        (["--plan", str(plan)], "bad.plan: line 1: not valid JSON."),
        (["--waypoints", str(plan)], "bad.plan: line 1: not valid JSON."),
        (["--mission"], "--mission needs a route"),
        (["--plan", str(plan), "--laps", "-1"], "--laps is -1"),
    ):
        wrong = Process("client", [*CLIENT, *arguments], environment)
        assert wrong.wait(30.0) == 2
        assert sentence in wrong.text
        assert "Traceback" not in wrong.text


@pytest.mark.parametrize(
    ("link", "reason"),
    [
        ("tcpout://127.0.0.1:1", "Connection refused; retrying."),
        ("serial:///dev/no_such_device:57600", "retrying."),
    ],
)
def test_a_link_that_is_not_there_is_a_warning_and_not_ready(link: str, reason: str) -> None:
    server = Process("server", [*SERVER, "--link", link], ros_environment(new_domain()))
    try:
        line = server.wait_for("waiting for link", 30.0)
        assert "[WARN]" in line
        assert "[WARN]" in server.wait_for(reason, 10.0)
    finally:
        server.stop()
    assert "ready on" not in server.text
    assert "Server stopped. No vehicle was found." in server.lines[-1]


def test_a_link_that_comes_later_makes_the_server_ready() -> None:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        link = f"tcpout://127.0.0.1:{listener.getsockname()[1]}"
        server = Process("server", [*SERVER, "--link", link], ros_environment(new_domain()))
        try:
            server.wait_for("waiting for link", 30.0)
            listener.listen()
            server.wait_for("Navigation server ready on", 20.0)
        finally:
            server.stop()


def test_where_the_server_listens_is_said() -> None:
    port = free_udp_port()
    server = Process("server", [*SERVER, "--link", f"udp://:{port}"], ros_environment(new_domain()))
    try:
        server.wait_for(f"udpin://127.0.0.1:{port} listens on this machine only.", 30.0)
        assert f"write udpin://0.0.0.0:{port}." in server.text
        server.wait_for("ready on", 30.0)
    finally:
        server.stop()
    check = ["--link", f"udp://:{port}", "--check", "--no-computer", "--timeout", "0.5"]
    looked = Process("check", [*SERVER, *check], ros_environment(new_domain()))
    assert looked.wait(30.0) == 2
    assert f"write udpin://0.0.0.0:{port}." in " ".join(looked.text.split())
    assert "firewall" not in looked.text
