"""docs/sitl.md is complete, and its example runs."""

from __future__ import annotations

import re
from pathlib import Path

from mavlink_sitl.autopilot.personality.arducopter import ARDUCOPTER
from mavlink_sitl.command_line.options import make_parser, parse
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.messages.telemetry import BUILDERS

DOCS = Path(__file__).resolve().parents[3] / "docs"
TEXT = (DOCS / "sitl.md").read_text("utf-8")
LISTS = (DOCS / "sitl_ardupilot_lists.md").read_text("utf-8")


def test_the_example_runs() -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    # The second block is a test, which test_pytest_plugin.py runs as such.
    (example,) = (block for block in blocks if "def test_" not in block)
    exec(compile(example, "docs/sitl.md", "exec"), {})


def test_every_option_has_a_help_text() -> None:
    for action in make_parser()._actions:
        assert action.help, action.dest


def test_the_command_lines_are_right() -> None:
    lines = re.findall(r"^python -m mavlink_sitl([^#\n]*)", TEXT, re.MULTILINE)
    assert len(lines) >= 4
    for line in lines:
        parse(line.split())


def test_every_mode_and_message_is_documented() -> None:
    for number, mode in ARDUCOPTER.modes.items():
        row = rf"^\| {number} \| {mode.name} \| flown \|"
        assert re.search(row, LISTS, re.MULTILINE), mode.name
    for message_id in BUILDERS:
        name = dialect.mavlink_map[message_id].msgname
        assert re.search(rf"\b{name}\b", LISTS + TEXT), name
