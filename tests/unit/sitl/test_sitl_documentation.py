"""docs/sitl.md is complete, and its example runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.arducopter import ARDUCOPTER
from mavlink_sitl.autopilot.personality.arduplane import ARDUPLANE
from mavlink_sitl.autopilot.personality.ardurover import ARDUROVER
from mavlink_sitl.autopilot.personality.shared import COMMON
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.messages.telemetry import BUILDERS
from mavlink_sitl.options import make_parser, parse

DOCS = Path(__file__).resolve().parents[3] / "docs"
TEXT = (DOCS / "sitl.md").read_text("utf-8")
VEHICLES = (DOCS / "sitl_vehicles.md").read_text("utf-8")


def test_the_example_runs() -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    # The other one is a test, which test_pytest_plugin.py runs as such.
    (example,) = (block for block in blocks if "def test_" not in block)
    exec(compile(example, "docs/sitl.md", "exec"), {})


def test_every_option_is_documented_and_every_documented_one_exists() -> None:
    documented = set(re.findall(r"^\| `(--[a-z-]+)`", TEXT, re.MULTILINE))
    existing = {
        word
        for action in make_parser()._actions
        for word in action.option_strings
        if word.startswith("--") and word != "--help"
    }
    assert documented == existing


def test_the_command_lines_are_right() -> None:
    lines = re.findall(r"^python -m mavlink_sitl([^#\n]*)", TEXT, re.MULTILINE)
    assert len(lines) >= 4
    for line in lines:
        parse(line.split())


def test_every_parameter_is_documented() -> None:
    section = TEXT[TEXT.index("**Parameters**") : TEXT.index("## What is not, yet")]
    documented = re.findall(r"`([A-Z][A-Z0-9_]+)`", section)
    assert documented == sorted(spec.name for spec in ARDUCOPTER.parameters)


@pytest.mark.parametrize(
    ("title", "personality"), [("Rover and boat", ARDUROVER), ("Plane", ARDUPLANE)]
)
def test_every_parameter_of_the_other_vehicles_is_documented(
    title: str, personality: Personality
) -> None:
    paragraph = VEHICLES.split(f"**{title}:**")[1].split("\n\n")[0]
    own = {spec.name for spec in personality.parameters} - {spec.name for spec in COMMON}
    assert re.findall(r"`([A-Z][A-Z0-9_]+)`", paragraph) == sorted(own)


def test_every_mode_and_message_is_documented() -> None:
    for mode in ARDUCOPTER.modes.values():
        assert re.search(rf"\b{mode.name}\b", TEXT), mode.name
    for message_id in BUILDERS:
        name = dialect.mavlink_map[message_id].msgname
        assert re.search(rf"\b{name}\b", TEXT), name
