"""The files for a computer that flies: systemd unit, udev rules, Dockerfile, and their page."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

from drone_navigation.navigation_server import EXIT_FAILED, EXIT_USAGE
from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.stop_signals import EXIT_HUNG, STOP_LIMIT_S
from drone_navigation.server.options import make_parser
from navigation_bridge.configuration.parameter_table import SPECS

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "bridge_config/on_board"
UNIT = FOLDER / "mavbridge.service"
RULES = FOLDER / "70-mavbridge-autopilot.rules"
DOCKERFILE = FOLDER / "Dockerfile"
PAGE = (ROOT / "docs/on_board.md").read_text("utf-8")
INSTALLED = "/opt/mavbridge"

# --- the unit ---------------------------------------------------------------------------------

KEYS = {
    "Unit": {"Description", "After", "StartLimitIntervalSec"},
    "Service": {
        "Type", "User", "SupplementaryGroups", "StateDirectory", "WorkingDirectory", "Environment",
        "ExecStart", "KillSignal", "KillMode", "TimeoutStopSec", "Restart", "RestartSec",
        "RestartPreventExitStatus", "Nice", "CPUWeight", "OOMScoreAdjust", "NoNewPrivileges",
        "ProtectSystem", "ProtectHome",
    },
    "Install": {"WantedBy"},
}  # fmt: skip
"""Those in use; systemd.directives(7) names the pages that describe them."""


def unit() -> dict[tuple[str, str], list[str]]:
    """Return the values of the unit by section and key."""
    found: dict[tuple[str, str], list[str]] = {}
    section = ""
    for line in UNIT.read_text("utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            section = line.strip("[]")
            assert section in KEYS, line
            continue
        key, equals, value = line.partition("=")
        assert equals, line
        assert key in KEYS[section], line
        found.setdefault((section, key), []).append(value)
    return found


def the(key: str, section: str = "Service") -> str:
    (value,) = unit()[(section, key)]
    return value


def server_words(script: str) -> list[str]:
    """Return the server's arguments in a script that enters the environment and starts it."""
    entering, _, command = script.partition(" && exec ")
    assert entering == f". {INSTALLED}/setup.bash"
    name, *words = shlex.split(command)
    assert name == "navigation_server"
    return words


def check_server_words(words: list[str]) -> None:
    options = make_parser().parse_args(own_arguments(["navigation_server", *words]))
    assert options.config == "/etc/mavbridge/vehicle.yaml"
    assert options.tlog == "flight.tlog"
    of_ros = words[words.index("--ros-args") + 1 :]
    set_names = [each.partition(":=")[0] for before, each in pairwise(of_ros) if before == "-p"]
    assert {"record_tlog_file_mb", "record_tlog_files"} <= set(set_names)
    assert set(set_names) <= set(SPECS)


def test_the_unit_starts_what_exists_with_arguments_that_can_be_given() -> None:
    shell, option, script = shlex.split(the("ExecStart"))
    assert (shell, option) == ("/bin/bash", "-c")
    assert Path(shell).exists()
    assert (ROOT / "setup.bash").exists()
    check_server_words(server_words(script))


def test_a_failed_server_is_started_again_and_one_with_a_bad_setting_is_not() -> None:
    assert the("Restart") == "on-failure"
    assert the("StartLimitIntervalSec", "Unit") == "0"
    not_again = {int(code) for code in the("RestartPreventExitStatus").split()}
    assert not_again == {EXIT_USAGE}
    assert not not_again & {EXIT_FAILED, EXIT_HUNG}


def test_a_stop_is_given_more_time_than_the_server_takes() -> None:
    assert the("KillSignal") == "SIGTERM"
    assert float(the("TimeoutStopSec")) > STOP_LIMIT_S


def test_recordings_are_kept_where_the_user_may_write() -> None:
    state = f"/var/lib/{the('StateDirectory')}"
    assert the("WorkingDirectory") == state
    assert f"HOME={state}" in unit()[("Service", "Environment")]
    assert f"useradd --system --home-dir {state} --groups dialout {the('User')}" in PAGE


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")
def test_systemd_accepts_the_unit() -> None:
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(UNIT)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


# --- the udev rules ---------------------------------------------------------------------------

TOKEN = re.compile(r'([A-Z_]+)(?:\{([^}]+)\})?(==|!=|\+=|:=|=)"([^"]*)"')
MATCHES = {"SUBSYSTEM", "KERNEL", "ATTRS", "ENV"}
ASSIGNS = {"ENV", "GROUP", "MODE", "SYMLINK", "GOTO", "LABEL"}


class Token(NamedTuple):
    """One match or assignment of a rule."""

    key: str
    attribute: str
    operator: str
    value: str

    @property
    def is_match(self) -> bool:
        """Whether it decides if the rule applies."""
        return self.operator in {"==", "!="}


def rules() -> Iterator[list[Token]]:
    """Yield the tokens of each rule, by the syntax of udev(7)."""
    for line in RULES.read_text("utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        tokens = [Token(*found) for found in TOKEN.findall(line)]
        written = [f"{t.key}{'{' + t.attribute + '}' if t.attribute else ''}" for t in tokens]
        parts = [f'{name}{t.operator}"{t.value}"' for name, t in zip(written, tokens, strict=True)]
        assert ", ".join(parts) == line
        yield tokens


def test_each_rule_has_keys_and_operators_of_udev() -> None:
    labels, jumps = set(), set()
    for tokens in rules():
        for token in tokens:
            assert token.key in (MATCHES if token.is_match else ASSIGNS), token
            assert bool(token.attribute) is (token.key in {"ATTRS", "ENV"}), token
            if token.key == "ATTRS":
                assert re.fullmatch(r"[0-9a-f]{4}(\|[0-9a-f]{4})*", token.value), token
            labels |= {token.value} if token.key == "LABEL" else set()
            jumps |= {token.value} if token.key == "GOTO" else set()
    assert jumps <= labels


def applied(kernel: str, usb: Mapping[str, str], interface: str) -> dict[str, str]:
    """Return what the rules assign to a serial device.

    Args:
        kernel: its name.
        usb: attributes of its parent on the bus.
        interface: ID_USB_INTERFACE_NUM, set before.
    """
    known = {("SUBSYSTEM", ""): "tty", ("KERNEL", ""): kernel}
    known |= {("ATTRS", name): value for name, value in usb.items()}
    known["ENV", "ID_USB_INTERFACE_NUM"] = interface
    skip_to = ""
    for tokens in rules():
        is_reached = not skip_to or ("LABEL", "", "=", skip_to) in tokens
        if not is_reached or not all(holds(t, known) for t in tokens if t.is_match):
            continue
        skip_to = ""
        for token in tokens:
            if token.key == "GOTO":
                skip_to = token.value
            elif not token.is_match:
                known[token.key, token.attribute] = token.value
    names = [("GROUP", ""), ("MODE", ""), ("SYMLINK", ""), ("ENV", "ID_MM_DEVICE_IGNORE")]
    return {key: known[key, attribute] for key, attribute in names if (key, attribute) in known}


def holds(token: Token, known: Mapping[tuple[str, str], str]) -> bool:
    """Return whether a match does."""
    value = known.get((token.key, token.attribute), "")
    fits = any(fnmatchcase(value, each) for each in token.value.split("|"))
    return fits is (token.operator == "==")


@pytest.mark.parametrize(
    "usb",
    [
        {"idVendor": "26ac", "idProduct": "0032"},
        {"idVendor": "2dae", "idProduct": "1058"},
        {"idVendor": "3162", "idProduct": "0050"},
        {"idVendor": "3163", "idProduct": "004c"},
        {"idVendor": "3185", "idProduct": "0035"},
        {"idVendor": "3643", "idProduct": "001d"},
        {"idVendor": "1209", "idProduct": "5741"},
        {"idVendor": "1b8c", "idProduct": "0036"},
        {"idVendor": "1fc9", "idProduct": "001c"},
    ],
    ids=lambda usb: "-".join(usb.values()),
)
def test_an_autopilot_may_be_opened_and_has_a_name(usb: dict[str, str]) -> None:
    found = {"GROUP": "dialout", "MODE": "0660", "ENV": "1"}
    assert applied("ttyACM1", usb, "00") == {**found, "SYMLINK": "autopilot"}
    # The second port, for CAN.
    assert applied("ttyACM2", usb, "02") == found


@pytest.mark.parametrize(
    ("kernel", "usb"),
    [
        ("ttyACM0", {"idVendor": "2341", "idProduct": "0043"}),  # an Arduino
        ("ttyACM0", {"idVendor": "1209", "idProduct": "0001"}),  # of the same vendor as ArduPilot
        ("ttyACM0", {"idVendor": "1546", "idProduct": "01a9"}),  # a GPS receiver
        ("ttyUSB0", {"idVendor": "0403", "idProduct": "6015"}),  # a radio
        ("ttyS0", {}),
    ],
)
def test_another_device_is_left_alone(kernel: str, usb: dict[str, str]) -> None:
    assert applied(kernel, usb, "00") == {}


def test_the_rules_come_after_those_that_they_depend_on() -> None:
    assert int(RULES.name.split("-")[0]) > 60  # 60-serial.rules


@pytest.mark.skipif(shutil.which("udevadm") is None, reason="no udevadm here")
def test_udev_accepts_the_rules() -> None:
    offers = subprocess.run(
        ["udevadm", "verify", "--help"], capture_output=True, timeout=60, check=False
    )
    if offers.returncode != 0:
        pytest.skip("this udevadm cannot verify")
    done = subprocess.run(
        ["udevadm", "verify", str(RULES)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr + done.stdout


# --- the Dockerfile ---------------------------------------------------------------------------

INSTRUCTIONS = {
    "FROM", "RUN", "COPY", "WORKDIR", "SHELL", "USER", "VOLUME", "ENV", "STOPSIGNAL", "ENTRYPOINT",
    "CMD",
}  # fmt: skip


def steps() -> list[tuple[str, str]]:
    """Return the instructions of the Dockerfile, continued lines as one."""
    text = re.sub(r"^#.*\n", "", DOCKERFILE.read_text("utf-8"), flags=re.MULTILINE)
    lines = re.sub(r"\\\n\s*", "", text).splitlines()
    found = [(line.split(" ", 1)[0], line.split(" ", 1)[1]) for line in lines if line]
    assert {name for name, _ in found} <= INSTRUCTIONS
    return found


def step(name: str) -> str:
    return next(value for each, value in steps() if each == name)


def packages(command: str) -> set[str]:
    (words,) = re.findall(r"apt(?:-get)? install ((?:[^&\n]|&(?!&))*)", command)
    return {word for word in words.split() if not word.startswith("-")}


def test_the_image_has_what_the_set_up_takes() -> None:
    assert steps()[0] == ("FROM", "ros:jazzy-ros-base")
    shown = next(line for line in PAGE.splitlines() if line.strip().startswith("sudo apt install"))
    assert packages(step("RUN")) == packages(shown) - {"ros-jazzy-ros-base"}


def test_each_step_of_the_image_is_a_command_that_a_shell_reads() -> None:
    for name, value in steps():
        if name == "RUN":
            done = subprocess.run(
                ["bash", "-n", "-c", value], capture_output=True, text=True, timeout=60, check=False
            )
            assert done.returncode == 0, done.stderr
    assert ("COPY", f". {INSTALLED}") in steps()
    assert any("make setup" in value for name, value in steps() if name == "RUN")


def test_the_image_stops_as_the_server_does_and_does_not_run_as_root() -> None:
    assert step("STOPSIGNAL") == "SIGTERM"
    assert step("USER") == "mavbridge"
    names = [name for name, _ in steps()]
    assert names.index("USER") < names.index("ENTRYPOINT")


def test_the_image_starts_the_server_as_the_unit_does() -> None:
    shell, option, script = json.loads(step("ENTRYPOINT"))
    name, *words = json.loads(step("CMD"))
    assert (shell, option, name) == ("/bin/bash", "-c", "navigation_server")
    assert script == f'. {INSTALLED}/setup.bash && exec "$0" "$@"'
    check_server_words(words)
    assert words == server_words(shlex.split(the("ExecStart"))[2])


def test_nothing_that_the_set_up_makes_goes_into_the_image() -> None:
    ignored = (FOLDER / "Dockerfile.dockerignore").read_text("utf-8").splitlines()
    assert {".git", ".venv", "build", "install"} <= set(ignored)


# --- the page ---------------------------------------------------------------------------------


def test_the_page_installs_each_file() -> None:
    for path in (UNIT, RULES, DOCKERFILE):
        assert str(path.relative_to(ROOT)) in PAGE


def test_the_page_has_ten_steps_from_an_empty_card() -> None:
    section = PAGE.split("## From an empty SD card to the first flight\n", 1)[1].split("\n## ")[0]
    assert re.findall(r"^(\d+)\. ", section, re.MULTILINE) == [str(n) for n in range(1, 11)]
    assert section.count("```") >= 2 * 9
