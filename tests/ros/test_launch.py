"""Each argument of the launch file does what its description says. Wheels of ROS have no launch."""

from __future__ import annotations

import os
import re
import runpy
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drone_navigation.processes import free_udp_port, ros_environment
from tests.support.processes import Process
from tests.support.ros.ros_flight import READY_TIMEOUT_S, new_domain

pytestmark = [pytest.mark.wide, pytest.mark.by_day]
pytest.importorskip("launch_ros", reason="launch comes with a ROS installation, not as a wheel")

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "src/drone_navigation/launch/navigation_server.launch.py"
LAUNCH = """
import sys
from launch import LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
source = PythonLaunchDescriptionSource(sys.argv[1])
arguments = [tuple(word.split(":=", 1)) for word in sys.argv[2:]]
service = LaunchService(argv=[])
service.include_launch_description(IncludeLaunchDescription(source, launch_arguments=arguments))
sys.exit(service.run())
"""
READY = "Navigation server ready on"
Launched = Callable[..., Process]


@pytest.fixture
def launched(tmp_path: Path) -> Iterator[Launched]:
    """Starts the launch file, as ``ros2 launch`` does, with arguments."""
    started: list[Process] = []

    def start(**arguments: str) -> Process:
        words = [f"{name}:={value}" for name, value in arguments.items()]
        variables = {**ros_environment(new_domain()), "ROS_LOG_DIR": str(tmp_path)}
        command = ["python", "-c", LAUNCH, str(FILE), *words]
        started.append(Process("launch", command, variables))
        return started[-1]

    yield start
    for process in started:
        process.stop(timeout_s=30.0)


@pytest.fixture
def link() -> str:
    return f"udpin://127.0.0.1:{free_udp_port()}"


def test_link_is_the_one_that_is_opened_and_all_ends_by_one_signal(
    launched: Launched, link: str
) -> None:
    process = launched(link=link)
    assert link in process.wait_for(READY, READY_TIMEOUT_S)
    assert process.stop(timeout_s=60.0) in (0, -signal.SIGINT)
    assert "process has finished cleanly" in process.text, process.text


def test_config_is_the_file_of_the_server(launched: Launched, link: str, tmp_path: Path) -> None:
    file = tmp_path / "my.yaml"
    file.write_text(f"navigation_server:\n  ros__parameters:\n    link_url: '{link}'\n", "utf-8")
    assert link in launched(config=str(file)).wait_for(READY, READY_TIMEOUT_S)


def test_namespace_is_that_of_the_nodes_and_a_file_for_another_is_rejected(
    launched: Launched, link: str, tmp_path: Path
) -> None:
    said = launched(namespace="north", link=link).wait_for(READY, READY_TIMEOUT_S)
    assert "[north.navigation_server]" in said
    file = tmp_path / "my.yaml"
    file.write_text(f"navigation_server:\n  ros__parameters:\n    link_url: '{link}'\n", "utf-8")
    other = launched(namespace="north", config=str(file))
    other.wait_for("sets no parameter of /north/navigation_server", READY_TIMEOUT_S)


def test_log_level_is_the_least_that_is_logged(launched: Launched, link: str) -> None:
    assert launched(link=link, log_level="debug").wait_for("[DEBUG]", READY_TIMEOUT_S)
    quiet = launched(link=link, log_level="error", console="true")
    quiet.wait_for("The console is at", READY_TIMEOUT_S)
    assert "[INFO] [1" not in quiet.text


def test_use_sim_time_is_a_parameter_of_the_server(launched: Launched, link: str) -> None:
    process = launched(link=link, use_sim_time="true")
    process.wait_for(READY, READY_TIMEOUT_S)
    assert "use_sim_time:=true" in command_line(process, "navigation_server")


def test_a_server_that_is_killed_is_started_again_only_with_respawn(
    launched: Launched, link: str
) -> None:
    process = launched(link=link, respawn="true")
    process.wait_for(READY, READY_TIMEOUT_S)
    killed, seen = pid_of(process, "navigation_server"), len(process.lines)
    os.kill(killed, signal.SIGKILL)
    process.wait_for(READY, READY_TIMEOUT_S, after=seen)
    process.stop(timeout_s=60.0)
    once = launched(link=link)
    once.wait_for(READY, READY_TIMEOUT_S)
    os.kill(pid_of(once, "navigation_server"), signal.SIGKILL)
    once.wait(30.0)
    assert once.text.count(READY) == 1


def test_without_autostart_the_server_waits(launched: Launched, link: str) -> None:
    process = launched(link=link, autostart="false")
    process.wait_for("waits to be configured", READY_TIMEOUT_S)


@pytest.mark.parametrize(
    ("argument", "said"),
    [("console", "The console is at http://"), ("nav2", "navigation_nav2")],
)
def test_a_node_is_started_beside_the_server(
    launched: Launched, link: str, argument: str, said: str
) -> None:
    process = launched(**{"link": link, argument: "true"})
    process.wait_for(READY, READY_TIMEOUT_S)
    process.wait_for(said, READY_TIMEOUT_S)
    assert pid_of(process, f"navigation_{argument}")


def test_each_vehicle_of_a_fleet_serves_clients_of_nav2(
    launched: Launched, link: str, tmp_path: Path
) -> None:
    pytest.importorskip("nav2_msgs", reason="make setup-nav2 builds it")
    file = tmp_path / "fleet.yaml"
    text = (ROOT / "bridge_config/fleet.yaml").read_text("utf-8")
    file.write_text(re.sub(r'"udpin://.*"', f'"{link}"', text), "utf-8")
    process = launched(config=str(file), nav2="true", console="true")
    process.wait_for("Navigation server ready", READY_TIMEOUT_S)
    for name in ("copter", "px4", "rover"):
        process.wait_for(f"[{name}.navigation_nav2]: ", READY_TIMEOUT_S)
    process.wait_for("The console is at http://", READY_TIMEOUT_S)


def test_a_switch_that_is_neither_is_rejected_in_a_sentence(launched: Launched) -> None:
    process = launched(nav2="maybe")
    assert process.wait(60.0) == 1
    assert 'Argument "nav2" provided value "maybe" is not valid' in process.text
    assert "process started" not in process.text


def test_every_argument_is_documented() -> None:
    names = [name for name, *_ in runpy.run_path(str(FILE))["ARGUMENTS"]]
    page = (ROOT / "docs/on_board.md").read_text("utf-8")
    assert re.findall(r"^\| `(\w+):=", page, re.MULTILINE) == names


def pid_of(process: Process, executable: str) -> int:
    """The newest process of an executable."""
    line = process.wait_for(f"[{executable}-", READY_TIMEOUT_S)
    found = re.findall(rf"\[{executable}-\d+\]: process started with pid \[(\d+)\]", process.text)
    assert found, line
    return int(found[-1])


def command_line(process: Process, executable: str) -> list[str]:
    """The arguments that a process was started with."""
    text = Path(f"/proc/{pid_of(process, executable)}/cmdline").read_text("utf-8")
    return text.split("\0")
