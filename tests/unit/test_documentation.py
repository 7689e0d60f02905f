"""The documentation names only what exists, and names all of it.

The simulator's pages are its own; tests/ros/test_shown_commands.py starts it as other pages show.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
import shlex
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from typing import get_args

import pytest

from drone_navigation.agents.navigation_mcp import make_parser as mcp_parser
from drone_navigation.client import events as client_events
from drone_navigation.client import options as client_options
from drone_navigation.client.options import COMMANDS
from drone_navigation.client.options import make_parser as client_parser
from drone_navigation.client.terminal.keys import Key
from drone_navigation.console.options import make_parser as console_parser
from drone_navigation.demo import make_parser as demo_parser
from drone_navigation.navigation_nav2 import make_parser as nav2_parser
from drone_navigation.navigation_target import make_parser as target_parser
from drone_navigation.ros2_command import make_parser as ros2_parser
from drone_navigation.server.options import make_parser as server_parser
from drone_navigation.tlog2mcap import make_parser as bag_parser
from flight_logs.export_command import make_parser as export_parser
from flight_reports.flight_plot import make_parser as plot_parser
from flight_reports.flight_video import make_parser as video_parser
from flight_reports.navigation_report import make_parser as report_parser
from mavlink_vehicle import protocols
from mavlink_vehicle.protocols.machine import Machine
from navigation_bridge.configuration.parameter_table import PARAMETERS
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.progress import Status

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")])
NAVIGATE = (ROOT / "docs/navigate.md").read_text("utf-8")
INTERFACES = ROOT / "src/custom_interfaces"
ACTION = (INTERFACES / "action/Navigate.action").read_text("utf-8")
ACTIONS = "".join(path.read_text("utf-8") for path in sorted(INTERFACES.glob("action/*")))
NUMBERS = (INTERFACES / "msg/GoalCode.msg").read_text("utf-8")
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")


class ClientParser:
    """The client's command line, whose commands have parsers of their own."""

    def parse_args(self, arguments: list[str]) -> Namespace:
        """Return the options."""
        return client_options.parse_options(arguments)


PROGRAMS: dict[str, Callable[[], ArgumentParser | ClientParser]] = {
    "navigation_server": server_parser,
    "navigation_client": ClientParser,
    "navigation_console": console_parser,
    "navigation_mcp": mcp_parser,
    "navigation_nav2": nav2_parser,
    "navigation_target": target_parser,
    "navigation_report": report_parser,
    "tlog_export": export_parser,
    "tlog2mcap": bag_parser,
    "python -m drone_navigation.demo": demo_parser,
    "python -m flight_reports.flight_plot": plot_parser,
    "python -m flight_reports.flight_video": video_parser,
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text("utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if not target.startswith(("http://", "https://", "mailto:")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_make_targets_modules_and_files_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    targets = set(re.findall(r"^([a-z0-9-]+):", MAKEFILE, re.MULTILINE))
    for target in re.findall(r"(?:^|`)make ([a-z0-9-]+)", text, re.MULTILINE):
        assert target in targets, f"{page.name}: make {target}"
    for module in re.findall(r"python -m ((?:drone_navigation|flight_reports)[\w.]*)", text):
        base = ROOT / "src" / module.split(".")[0] / module.replace(".", "/")
        assert base.with_suffix(".py").exists() or (base / "__main__.py").exists(), module
    for path in re.findall(r"`((?:src|sitl|tests|docs|bridge_config|scripts)/[\w./-]*)`", text):
        assert (ROOT / path).exists(), f"{page.name}: {path}"


def block_lines(text: str) -> list[str]:
    """Return the lines in the code blocks of a page, continued ones as one."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]


def commands(page: Path) -> list[list[str]]:
    """Return the command lines of this project's programs that a page shows, as words."""
    text = page.read_text("utf-8")
    lines = block_lines(text)
    lines += re.findall(
        r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    )
    shown = [line for line in lines if re.match(rf"\s*({'|'.join(PROGRAMS)})(\s|$)", line)]
    return [shlex.split(line, comments=True) for line in shown]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_line_that_is_shown_can_be_given(page: Path) -> None:
    for words in commands(page):
        (name,) = [name for name in PROGRAMS if " ".join(words).startswith(name)]
        arguments = words[len(name.split()) :]
        if "--ros-args" in arguments:
            arguments = arguments[: arguments.index("--ros-args")]
        if {"--help", "--version", "..."} & set(arguments):
            continue
        try:
            PROGRAMS[name]().parse_args(arguments)
        except SystemExit:
            pytest.fail(f"{page.name} shows what is rejected: {' '.join(words)}")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_ros2_line_that_is_shown_can_be_given_without_a_ros_installation(page: Path) -> None:
    for line in block_lines(page.read_text("utf-8")):
        if line.startswith("ros2 ") and not line.startswith("ros2 launch "):
            ros2_parser().parse_args(shlex.split(line, comments=True)[1:])


def test_command_lines_are_found() -> None:
    assert len(commands(ROOT / "docs/getting_started.md")) >= 8
    assert ["navigation_server"] in commands(ROOT / "README.md")


def test_every_file_of_a_set_up_is_named_on_a_page() -> None:
    text = "".join(page.read_text("utf-8") for page in PAGES)
    for path in sorted((ROOT / "bridge_config").rglob("*.yaml")):
        name = path.relative_to(ROOT)
        assert f"`{name}`" in text, f"no page names {name}"


def test_the_commands_that_a_file_of_a_set_up_shows_can_be_given() -> None:
    for path in sorted((ROOT / "bridge_config").rglob("*.yaml")):
        for line in re.findall(r"navigation_server --config.*", path.read_text("utf-8")):
            options = server_parser().parse_args(line.split()[1:])
            assert ROOT / options.config == path


def test_the_page_of_the_architecture_leads_to_the_files_of_ten_changes() -> None:
    text = (ROOT / "docs/architecture.md").read_text("utf-8")
    rows = re.findall(r"^\| (?!To |---)(.*) \| (.*) \|$", text, re.MULTILINE)
    assert len(rows) >= 10
    there = [f"/{path.relative_to(ROOT).as_posix()}" for path in ROOT.glob("src/**/*.py")]
    there += [f"/{path.relative_to(ROOT).as_posix()}" for path in ROOT.glob("sitl/**/*.py")]
    there += [f"/{path.relative_to(ROOT).as_posix()}" for path in ROOT.glob("bridge_config/*")]
    there += [f"/{path.relative_to(ROOT).as_posix()}" for path in ROOT.glob("tests/explore/*.py")]
    for change, places in rows:
        named = re.findall(r"`([\w./]+)`", places)
        assert named, change
        for name in named:
            assert any(f"/{name}" in path for path in there), f"{change}: {name}"


def test_how_a_goal_ends_is_read_in_less_than_eight_hundred_lines() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    (part,) = re.findall(r"^## How a goal ends\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    named = re.findall(r"^\d\. `(\w+/[\w./]+)`", part, re.MULTILINE)
    assert 1 < len(named) <= 4
    lines = [
        len((ROOT / "src/navigation_bridge" / name).read_text().splitlines()) for name in named
    ]
    assert lines[0] <= 300
    assert sum(lines) < 800


def test_pictures_fetch_nothing() -> None:
    for path in (ROOT / "docs").glob("*.svg"):
        assert 'url("http' not in path.read_text("utf-8"), path


def test_every_option_key_exit_code_and_event_of_the_client_is_documented() -> None:
    page = (ROOT / "docs/client.md").read_text("utf-8")
    parsers = [client_parser(), *map(client_options.make_command_parser, COMMANDS)]
    for command in COMMANDS:
        assert f"`{command}`" in page or f"`{command} " in page, command
    for action in (action for parser in parsers for action in parser._actions):
        assert action.help, action.dest
    for key in Key:
        assert f"`{key.value}`" in page, key
    for name in (name for name in dir(client_options) if name.startswith("EXIT_")):
        assert f"\n  {getattr(client_options, name)}  " in client_parser().format_help(), name
    for kind in (*get_args(client_events.Event), client_events.Telemetry):
        (row,) = re.findall(rf"^\| `{kind.name}` \| (.*) \|$", page, re.MULTILINE)
        assert re.findall(r"`(\w+)`", row) == [field.name for field in fields(kind)]


def test_every_code_and_status_is_documented_and_a_constant_of_an_action() -> None:
    for code in OutcomeCode:
        assert f"`{code.value}`" in NAVIGATE, code
        assert f'\nstring CODE_{code.value}="{code.value}"\n' in ACTION, code
    for status in Status:
        assert f"`{status.value}`" in NAVIGATE, status
        assert f'\nstring STATUS_{status.value}="{status.value}"\n' in ACTIONS, status
    assert set(re.findall(r"string STATUS_(\w+)=", ACTIONS)) == {s.value for s in Status}


def test_every_code_has_its_own_number_and_zero_is_success() -> None:
    numbers = {name: int(value) for name, value in re.findall(r"uint16 (\w+)=(\d+)", NUMBERS)}
    assert set(numbers) == {code.value for code in OutcomeCode}
    assert len(set(numbers.values())) == len(numbers)
    assert numbers["SUCCESS"] == 0


def test_parameters_named_on_the_navigate_page_exist() -> None:
    names = {spec.name for spec in PARAMETERS}
    suffixes = ("_s", "_hz", "_m", "_m_s", "_url")
    for word in re.findall(r"`([a-z]+(?:_[a-z]+)+)`", NAVIGATE):
        if word.endswith(suffixes):
            assert word in names, word


def test_the_first_command_of_the_first_page_is_the_courses_which_make_setup_gives() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    (first, *_) = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    words = shlex.split(first.replace("\\\n", " "))
    assert words[:5] == [
        "ros2", "action", "send_goal", "/navigate_to_waypoint", "custom_interfaces/action/Navigate",
    ]  # fmt: skip
    assert words[-1] == "--feedback"


@pytest.fixture(scope="module")
def draw_states() -> ModuleType:
    spec = importlib.util.spec_from_file_location("draw_states", ROOT / "scripts/draw_states.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_state_diagrams_are_those_of_the_tables(draw_states: ModuleType) -> None:
    kept = (ROOT / "docs/states.md").read_text("utf-8")
    assert kept == draw_states.page(), "run: scripts/run python scripts/draw_states.py"


def test_every_protocol_has_a_state_diagram_with_all_its_transitions(
    draw_states: ModuleType,
) -> None:
    for module in pkgutil.walk_packages(protocols.__path__, f"{protocols.__name__}."):
        importlib.import_module(module.name)
    kinds: list[type] = [Machine]
    for kind in kinds:
        kinds += kind.__subclasses__()
    machines = {kind for kind in kinds if "table" in vars(kind)}
    assert {m for m in machines if m.__module__.startswith("mavlink_")} == set(
        draw_states.MACHINES.values()
    )
    for heading, machine in draw_states.MACHINES.items():
        _, arrows = draw_states.diagrams()[heading]
        drawn = {(before, event, after) for (before, after), es in arrows.items() for event in es}
        assert drawn == {(s.name, i.name, n.name) for (s, i), (n, _) in machine.table.items()}
