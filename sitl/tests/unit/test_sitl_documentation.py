"""The pages name only what is in this folder; docs/sitl.md is complete, and its example runs."""

from __future__ import annotations

import re
from pathlib import Path

import mavlink_sitl
from mavlink_sitl.autopilot.personality.ardupilot import ARDUCOPTER
from mavlink_sitl.command_line.options import make_parser, parse
from mavlink_sitl.mavlink.codec import dialect
from mavlink_sitl.mavlink.messages.telemetry import BUILDERS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.glob("*.md"))]
TEXT = (DOCS / "sitl.md").read_text("utf-8")
LISTS = (DOCS / "ardupilot_lists.md").read_text("utf-8")


def test_the_example_runs() -> None:
    blocks = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    # The second block is a test, which test_pytest_plugin.py runs as such.
    (example,) = (block for block in blocks if "def test_" not in block)
    exec(compile(example, "docs/sitl.md", "exec"), {})


def test_every_option_has_a_help_text() -> None:
    for action in make_parser()._actions:
        assert action.help, action.dest


def test_the_command_lines_are_right() -> None:
    texts = [page.read_text("utf-8") for page in PAGES]
    pattern = r"^(?:python -m mavlink_sitl|mavlink-sitl)(?: ([^#\n]*))?(?: *#.*)?$"
    lines = [line for text in texts for line in re.findall(pattern, text, re.MULTILINE)]
    assert len(lines) >= 7
    for line in lines:
        parse(line.split())


def test_links_lead_somewhere_in_this_folder() -> None:
    links = 0
    for page in PAGES:
        for target, part in re.findall(r"\]\(([^)#\s]*)(#[^)]*)?\)", page.read_text("utf-8")):
            if not target.startswith(("http://", "https://")):
                links += 1
                there = (page.parent / target).resolve() if target else page
                assert there.is_relative_to(ROOT), f"{page.name} links to {target}"
                assert there.exists(), f"{page.name} links to {target}"
                assert not part or part[1:] in headings(there), f"{page.name}: {target}{part}"
    assert links > 15


def headings(page: Path) -> list[str]:
    """Return the anchors of a page."""
    found = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in found]


def test_files_and_make_targets_that_are_named_exist() -> None:
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    files = 0
    for page in PAGES:
        text = page.read_text("utf-8")
        for name in re.findall(r"`((?:mavlink_sitl|tests|docs|scripts|worlds)/[\w./-]*)`", text):
            files += 1
            assert (ROOT / name).exists(), f"{page.name}: {name}"
        for target in re.findall(r"(?:^|`)make ([a-z-]+)", text, re.MULTILINE):
            assert target in targets, f"{page.name}: make {target}"
    assert files > 10


def test_all_public_names_are_listed() -> None:
    (section,) = re.findall(r"^## Public names\n(.*?)^## ", TEXT, re.MULTILINE | re.DOTALL)
    listed = re.findall(r"`(\w+)`", section)
    public = {*mavlink_sitl.__all__, "geodesy", "pytest_mavlink_sitl"}
    assert sorted(name for name in listed if name not in public) == []
    assert public - set(listed) == set()


def test_the_version_is_the_same_in_all_files() -> None:
    (version,) = re.findall(r'^version = "(.*)"$', text_of("pyproject.toml"), re.MULTILINE)
    assert f"<version>{version}</version>" in text_of("package.xml")
    newest = re.findall(r"^## \[(.*?)\]", text_of("CHANGELOG.md"), re.MULTILINE)
    assert newest[:2] == ["Unreleased", version]


def text_of(name: str) -> str:
    return (ROOT / name).read_text("utf-8")


def test_every_mode_and_message_is_documented() -> None:
    for number, mode in ARDUCOPTER.modes.items():
        row = rf"^\| {number} \| {mode.name} \| flown \|"
        assert re.search(row, LISTS, re.MULTILINE), mode.name
    for message_id in BUILDERS["copter"]:
        name = dialect.mavlink_map[message_id].msgname
        assert re.search(rf"\b{name}\b", LISTS + TEXT), name
