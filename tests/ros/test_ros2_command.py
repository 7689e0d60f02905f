"""``ros2`` for those without ros2cli: the course's commands against a server that flies."""

from __future__ import annotations

import re
import shlex
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from drone_navigation.ros2_command import make_parser
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import FLIGHT_TIMEOUT_S, Flight

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros2_command")]

README = (Path(__file__).resolve().parents[2] / "README.md").read_text("utf-8")
ROS2 = ["python", "-m", "drone_navigation.ros2_command"]
NAVIGATE = ("action", "send_goal", "/navigate_to_waypoint", "custom_interfaces/action/Navigate")
FAR = "{target_pose: {pose: {position: {x: 60.0, y: 0.0, z: 3.0}}}}"
INTERRUPTED = 130


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    made = Flight(tmp_path_factory.mktemp("ros2_command"))
    yield made
    made.close()


def run(flight: Flight, *words: str) -> tuple[int, str]:
    """Run a command to its end; return its exit code and what it printed."""
    done = subprocess.run(
        [*ROS2, *words], env=flight.environment, capture_output=True, text=True, check=False,
        timeout=patient_s(FLIGHT_TIMEOUT_S),
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout + done.stderr


def lines(flight: Flight, *words: str) -> list[str]:
    code, text = run(flight, *words)
    assert code == 0, text
    return text.splitlines()


def listed(flight: Flight, wanted: str, *words: str, also: str = "") -> list[str]:
    """Return what a list has as soon as names are in it: a busy machine discovers slowly."""
    for _ in range(4):
        found = lines(flight, *words)
        if {wanted, also or wanted} <= set(found):
            return found
    raise AssertionError(f"{wanted} is not in {found}")


def test_what_is_there_is_listed_as_ros2_lists_it(flight: Flight) -> None:
    listed(flight, "/navigate_to_waypoint", "action", "list")
    listed(flight, "/navigate_to_waypoint [custom_interfaces/action/Navigate]",
           "action", "list", "-t")  # fmt: skip
    # The client is the test's own.
    info = listed(flight, "    /test_client", "action", "info", "/navigate_to_waypoint",
                  also="    /navigation_server")  # fmt: skip
    assert info == [
        "Action: /navigate_to_waypoint",
        "Action clients: 1",
        "    /test_client",
        "Action servers: 1",
        "    /navigation_server",
    ]
    nodes = listed(flight, "/navigation_server", "node", "list")
    assert set(nodes) <= {"/navigation_server", "/test_client"}
    served = "    /navigate_to_waypoint: custom_interfaces/action/Navigate"
    info = listed(flight, served, "node", "info", "/navigation_server")
    assert info.index("  Publishers:") < info.index("  Action Servers:") < info.index(served)
    topics = listed(flight, "/navigation_server/odometry", "topic", "list")
    assert not any("/_" in name for name in topics)
    listed(flight, "/navigate_to_waypoint/_action/feedback", "topic", "list", "-a")
    listed(flight, "/navigation_server/hold", "service", "list")
    info = lines(flight, "topic", "info", "/navigation_server/home")
    assert info[:2] == ["Type: custom_interfaces/msg/HomePosition", "Publisher count: 1"]


def test_messages_are_echoed_measured_and_published(flight: Flight) -> None:
    home = lines(flight, "topic", "echo", "--once", "/navigation_server/home")
    assert home[0] == "header:"
    assert home[-1] == "---"
    assert any(line.startswith("latitude: -35.36") for line in home)
    field = ("--field", "pose.pose.position")
    assert lines(flight, "topic", "echo", "--once", "/navigation_server/odometry", *field)[
        0
    ].startswith("x: ")
    rate = Process("hz", [*ROS2, "topic", "hz", "/navigation_server/odometry"], flight.environment)
    try:
        rate.wait_for("average rate: ", FLIGHT_TIMEOUT_S)
        rate.wait_for("std dev: ", FLIGHT_TIMEOUT_S)
        rate.signal(signal.SIGINT)
        assert rate.wait(patient_s(5.0)) == INTERRUPTED
        assert "Traceback" not in rate.text
    finally:
        rate.stop()
    twist = ("geometry_msgs/msg/TwistStamped", "{header: auto, twist: {linear: {x: 1}}}")
    publisher = Process("pub", [*ROS2, "topic", "pub", "-r", "5", "/spoken", *twist],
                        flight.environment)  # fmt: skip
    try:
        publisher.wait_for("publishing #1: geometry_msgs.msg.TwistStamped(", FLIGHT_TIMEOUT_S)
        text = "\n".join(lines(flight, "topic", "echo", "--once", "/spoken"))
        assert re.search(r"sec: [1-9]", text), text
        assert "    x: 1.0" in text
    finally:
        publisher.stop()


def test_parameters_are_read_set_and_rejected(flight: Flight) -> None:
    node = "/navigation_server"
    assert "  obstacle_margin_m" in lines(flight, "param", "list", node)
    assert lines(flight, "param", "set", node, "obstacle_margin_m", "1.25") == [
        "Set parameter successful"
    ]
    assert lines(flight, "param", "get", node, "obstacle_margin_m") == ["Double value is: 1.25"]
    assert lines(flight, "param", "get", node, "obstacle_margin_m", "--hide-type") == ["1.25"]
    described = lines(flight, "param", "describe", node, "obstacle_margin_m")
    assert described[:2] == ["Parameter name: obstacle_margin_m", "  Type: double"]
    assert "    Max value: 20.0" in described
    code, text = run(flight, "param", "set", node, "obstacle_margin_m", "-1.0")
    assert code == 1
    assert text.startswith("Setting parameter failed: ")
    assert run(flight, "param", "get", node, "nothing_m")[0] == 1
    assert run(flight, "param", "get", "/nobody", "x") == (
        1,
        "Node not found: '/nobody' (`ros2 node list` lists all)\n",
    )


def test_a_service_is_called(flight: Flight) -> None:
    text = "\n".join(
        lines(flight, "service", "call", "/navigation_server/hold", "std_srvs/srv/Trigger")
    )
    assert "requester: making request: std_srvs.srv.Trigger_Request()" in text
    assert "response:\nstd_srvs.srv.Trigger_Response(success=True, message='Hold" in text


def test_the_command_of_the_readme_flies_the_courses_goal(flight: Flight) -> None:
    (command,) = re.findall(r"^ros2 action send_goal (?:.*\\\n)*.*$", README, re.MULTILINE)
    _, *words = shlex.split(command.replace("\\\n", " "))
    code, text = run(flight, *words)
    assert code == 0, text
    order = (
        "Waiting for an action server to become available...", "Sending goal:",
        "Goal accepted with ID: ", "Feedback:\n    current_pose:\n", "Result:\n    success: true",
        "Goal finished with status: SUCCEEDED",
    )  # fmt: skip
    places = [text.find(each) for each in order]
    assert places == sorted(places)
    assert places[0] == 0
    assert "current_status: NAVIGATING" in text


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_goal_whose_command_is_ended_is_cancelled(flight: Flight, number: signal.Signals) -> None:
    command = Process("send_goal", [*ROS2, *NAVIGATE, FAR, "-f"], flight.environment)
    try:
        command.wait_for("current_status: NAVIGATING", FLIGHT_TIMEOUT_S)
        command.signal(number)
        assert command.wait(patient_s(5.0)) == INTERRUPTED
    finally:
        command.stop()
    assert "Canceling goal...\n" in command.text
    assert command.text.splitlines()[-1] == "Goal canceled."
    assert "Traceback" not in command.text
    assert flight.server is not None
    (identity,) = re.findall(r"Goal accepted with ID: (\w+)", command.text)
    flight.server.wait_for(f"Goal {identity[:8]} ended: CANCELED", FLIGHT_TIMEOUT_S)


def test_a_rejected_goal_and_one_without_a_server_end_with_an_error(flight: Flight) -> None:
    high = "{target_pose: {pose: {position: {z: 900.0}}}}"
    code, text = run(flight, *NAVIGATE, high)
    assert code == 1
    assert text.endswith("Goal was rejected.\n")
    waiting = Process("send_goal", [*ROS2, "action", "send_goal", "/nothing", NAVIGATE[3]],
                      flight.environment)  # fmt: skip
    try:
        waiting.wait_for("Waiting for an action server", FLIGHT_TIMEOUT_S)
        waiting.signal(signal.SIGINT)
        assert waiting.wait(patient_s(5.0)) == INTERRUPTED
        assert "Traceback" not in waiting.text
    finally:
        waiting.stop()


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((*NAVIGATE, "{target: 1}"), 1, "target: there is no such field, but target_pose, "),
        ((*NAVIGATE, "{max_speed: fast}"), 1, "max_speed: The 'max_speed' field must be of type"),
        ((*NAVIGATE, "{target_pose: {pose: 3}}"), 1, "target_pose.pose: it needs fields such as"),
        ((*NAVIGATE, "{avoid_obstacles: 1}"), 1, "field must be of type 'bool'"),
        ((*NAVIGATE, "10 5 2"), 1, "needs to be a dictionary in YAML format"),
        ((*NAVIGATE, "{a: "), 1, "is not valid YAML"),
        (("action", "send_goal", "/x", "custom_interfaces/action/Fly"), 1, "type is invalid"),
        (("service", "call", "/x", "std_srvs/msg/Trigger"), 1, "type is invalid"),
        (("topic", "pub", "/x", "std_msgs/String", "{data: [1]}"), 1, "must be of type 'str'"),
        (("topic", "echo", "/nothing"), 1, "Could not determine the type"),
        (("topic", "info", "/nothing"), 1, "Unknown topic '/nothing'"),
        (("node", "info", "/nobody"), 1, "Unable to find node '/nobody'"),
        (("interface", "show", "custom_interfaces/action/Fly"), 1, "Could not find the interface"),
        (("interface", "show", "nothing/msg/Fly"), 1, "Unknown package"),
        (("run", "drone_navigation", "nothing"), 1, "No executable found"),
        (("run", "nothing", "nothing"), 1, "Package 'nothing' not found"),
        (("launch", "drone_navigation", "x"), 2, "needs a full ROS 2 installation"),
        (("topic", "pub", "-r", "0", "/x", "std_msgs/String"), 2, "is above 0"),
        (("action",), 2, "the following arguments are required: VERB"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_is_wrong_is_one_clear_sentence(
    flight: Flight, words: tuple[str, ...], code: int, said: str
) -> None:
    got, text = run(flight, *words)
    assert (got, said in text) == (code, True), text


def test_what_is_installed_is_listed_shown_and_run(flight: Flight) -> None:
    assert "    custom_interfaces/action/Navigate" in lines(flight, "interface", "list")
    shown = lines(flight, "interface", "show", "custom_interfaces/action/Navigate", "--no-comments")
    assert shown.count("---") == 2
    begin = shown.index("geometry_msgs/PoseStamped target_pose")
    assert shown[begin + 1 : begin + 4] == [
        "\tstd_msgs/Header header", "\t\tbuiltin_interfaces/Time stamp", "\t\t\tint32 sec",
    ]  # fmt: skip
    assert {"custom_interfaces", "drone_navigation"} <= set(lines(flight, "pkg", "list"))
    (line,) = lines(flight, "run", "drone_navigation", "navigation_client", "--version")
    assert line.startswith("navigation_client ")
    assert lines(flight)[0] == make_parser().format_help().splitlines()[0]


def test_a_ros2_that_is_installed_is_used_instead(flight: Flight, tmp_path: Path) -> None:
    package = tmp_path / "ros2cli"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "cli.py").write_text(
        "def main(*, argv):\n    print('its own', argv)\n    return 7\n"
    )
    path = f"{tmp_path}:{flight.environment['PYTHONPATH']}"
    done = subprocess.run(
        [*ROS2, "action", "list"], env={**flight.environment, "PYTHONPATH": path},
        capture_output=True, text=True, check=False, timeout=patient_s(30.0),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (7, "its own ['action', 'list']\n")
