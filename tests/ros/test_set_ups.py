"""The set-ups in bridge_config/ as ROS takes them, and `--check` as a person runs it."""

from __future__ import annotations

import json
import re
import shlex
import signal
import socket
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
import rclpy
from rclpy.node import Node

from drone_navigation.navigation_server import main
from drone_navigation.processes import free_udp_port, ros_environment
from drone_navigation.server.parameters import declare_parameters
from navigation_bridge.configuration.make_config import make_config
from tests.support.processes import Process, patient_s
from tests.support.ros.ros_flight import new_domain

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_set_ups")]
CONFIG = Path(__file__).resolve().parents[2] / "bridge_config"
FILES = [
    path
    for path in sorted(CONFIG.rglob("*.yaml"))
    if path.parent.name not in ("worlds", "obstacles", "shadow_goals")
]


def start(stack: ExitStack, name: str, *command: str) -> Process:
    process = Process(name, ["python", "-m", *command], ros_environment(0))
    stack.callback(process.stop)
    return process


def free_tcp_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


def test_every_set_up_is_what_ros_declares() -> None:
    domain = new_domain()
    for path in FILES:
        context = rclpy.Context()
        arguments = ["--ros-args", "--params-file", str(path)]
        rclpy.init(context=context, args=arguments, domain_id=domain)
        try:
            node = Node("navigation_server", context=context)
            config = make_config(declare_parameters(node, simulator=False))
            assert config.bridge.goto.may_arm == (path.parent.name != "real"), path
            node.destroy_node()
        finally:
            rclpy.try_shutdown(context=context)


@pytest.mark.night
def test_a_vehicle_of_each_kind_is_checked_with_its_set_up() -> None:
    cases = [
        ("simulated/ardupilot_copter", "udpin", "udpout", free_udp_port()),
        ("simulated/px4_rover", "udpin", "udpout", free_udp_port()),
        ("simulated/ardupilot_plane", "udpin", "udpout", free_udp_port()),
        ("real/px4_boat", "tcp", "tcpin", free_tcp_port()),
    ]
    with ExitStack() as stack:
        looks: list[tuple[str, Process]] = []
        for name, ours, theirs, port in cases:
            firmware, kind = name.split("/")[1].split("_")
            start(
                stack, kind, "mavlink_sitl", "--vehicle", kind, "--autopilot", firmware,
                "--link", f"{theirs}://127.0.0.1:{port}", "--ready-after", "1", "--quiet",
            )  # fmt: skip
            look = start(
                stack, "check", "drone_navigation.navigation_server", "--check",
                "--config", str(CONFIG / f"{name}.yaml"), "--timeout", "40",
                "--link", f"{ours}://127.0.0.1:{port}",
                "--json" if name.startswith("real/") else "--no-computer",
            )  # fmt: skip
            looks.append((kind, look))
        for kind, look in looks:
            assert look.wait(80.0) == 0, look.text
            assert "\x1b[" not in look.text  # no colours where there is no terminal
            if kind != "boat":
                assert f"kind: {kind}" in look.text
                assert "Ready for goals." in look.text
        document = json.loads(look.text[look.text.index("{\n") :])
        assert document["verdict"] == 0
        assert "manually" in document["yours"][0]  # a real one is armed by its pilot
        computer = document["sections"][-1]
        assert computer["title"] == "This computer"
        assert computer["lines"][0]["name"] == "fast enough"
        assert computer["lines"][0]["value"] in {"yes", "marginal", "no"}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ("--link udpin://127.0.0.1:0 --timeout 0.3", "No vehicle was found"),
        ("--link serial:///dev/no-such-port:57600 --timeout 0.3", "No vehicle was found"),
        ("--link carrier-pigeon://coop", "carrier-pigeon"),
        ("--config no/such/file.yaml", "no/such/file.yaml"),
        ("--ros-args -p arming:=auto", "--ros-args"),
    ],
    ids=["silence", "no port", "link", "file", "ros"],
)
def test_no_vehicle_or_a_bad_set_up_is_exit_code_2(
    arguments: str, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--check", "--no-computer", *shlex.split(arguments)]) == 2
    printed = capsys.readouterr()
    assert sentence in printed.out + printed.err


def test_a_time_that_is_none_is_a_usage_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--check", "--timeout", "forever"])
    assert end.value.code == 2
    assert "'forever' is not a number of seconds" in capsys.readouterr().err


def test_a_check_that_is_interrupted_ends_without_a_traceback() -> None:
    with ExitStack() as stack:
        look = start(
            stack, "check", "drone_navigation.navigation_server", "--check",
            "--link", "udpin://127.0.0.1:0", "--timeout", "60",
        )  # fmt: skip
        look.wait_for("waiting for a HEARTBEAT", 30.0)
        look.signal(signal.SIGINT)
        assert look.wait(10.0) == 1
        assert "Traceback" not in look.text


@pytest.mark.parametrize(
    ("option", "number", "code"),
    [
        ("--check", signal.SIGINT, 1),
        ("--check", signal.SIGTERM, -15),
        ("--computer-row", signal.SIGINT, 1),
    ],
)
def test_a_trial_of_this_computer_ends_with_the_command(
    option: str, number: signal.Signals, code: int
) -> None:
    with ExitStack() as stack:
        words = ["--timeout", "0.2"] if option == "--check" else []
        look = start(stack, "check", "drone_navigation.navigation_server", option, *words)
        look.wait_for("s left, trying this computer", 60.0)
        (child,) = psutil.Process(look.pid).children()
        look.signal(number)
        assert look.wait(10.0) == code
        assert "Traceback" not in look.text
        assert psutil.wait_procs([child], patient_s(5.0))[1] == []


def test_a_check_without_a_vehicle_tries_this_computer() -> None:
    with ExitStack() as stack:
        look = start(
            stack, "check", "drone_navigation.navigation_server", "--check", "--timeout", "0.2"
        )
        assert look.wait(60.0) == 2
        assert "This computer:" in look.text
        assert re.search(r"fast enough: (yes|marginal|no)\n", look.text)
        assert "No vehicle was found" in look.text
