"""The documentation names only what exists, and names all of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from drone_navigation.configuration import PARAMETERS
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import Status

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")])
NAVIGATE = (ROOT / "docs/navigate.md").read_text("utf-8")
INTERFACES = ROOT / "src/custom_interfaces"
ACTION = (INTERFACES / "action/Navigate.action").read_text("utf-8")
ACTIONS = "".join(path.read_text("utf-8") for path in sorted(INTERFACES.glob("action/*")))
NUMBERS = (INTERFACES / "msg/GoalCode.msg").read_text("utf-8")
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text("utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if not target.startswith(("http://", "https://", "mailto:")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_make_targets_modules_and_files_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    targets = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))
    for target in re.findall(r"(?:^|`)make ([a-z-]+)", text, re.MULTILINE):
        assert target in targets, f"{page.name}: make {target}"
    for module in re.findall(r"python -m ((?:drone_navigation|mavlink_sitl)[\w.]*)", text):
        package = {"drone_navigation": "src/drone_navigation", "mavlink_sitl": "sitl"}
        base = ROOT / package[module.split(".")[0]] / module.replace(".", "/")
        assert base.with_suffix(".py").exists() or (base / "__main__.py").exists(), module
    for path in re.findall(r"`((?:src|sitl|tests|docs|bridge_config|scripts)/[\w./-]*)`", text):
        assert (ROOT / path).exists(), f"{page.name}: {path}"


def test_every_parameter_is_documented_with_its_default() -> None:
    text = (ROOT / "docs/parameters.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| `([^`]*)` \|", text, re.MULTILINE))
    expected = {
        spec.name: f"{spec.default:g}"
        if isinstance(spec.default, (int, float))
        else f'"{spec.default}"'
        for spec in PARAMETERS
    }
    assert rows == expected


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
