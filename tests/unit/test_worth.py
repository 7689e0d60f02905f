"""Checks when a wide test runs, and what tests find."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from tests.support.processes import HANGS_AFTER_S
from tests.worth import measure, table

CONFTEST = Path(__file__).resolve().parents[1] / "conftest.py"
MARKED = """
import pytest

FOUR = pytest.mark.parametrize("n", range(4))

@FOUR
def test_quick(n): ...
@FOUR
@pytest.mark.wide_but_first
def test_first(n): ...
@FOUR
@pytest.mark.wide_but_first
def test_first_too(n): ...
@FOUR
@pytest.mark.wide
def test_wide(n): ...
@FOUR
@pytest.mark.wide
def test_broad(n): ...
@FOUR
@pytest.mark.wide
@pytest.mark.night_but_first
def test_night_first(n): ...
@FOUR
@pytest.mark.wide
@pytest.mark.by_day
def test_by_day(n): ...
@pytest.mark.night
def test_night(): ...
"""


def test_marks_choose_between_now_by_day_and_by_night(tmp_path: Path) -> None:
    shutil.copy(CONFTEST, tmp_path)
    (tmp_path / "test_marked.py").write_text(MARKED, "utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]", "utf-8")
    assert chosen(tmp_path, "not wide") == {
        *(f"test_quick[{n}]" for n in range(4)), "test_first[0]", "test_first_too[0]",
    }  # fmt: skip
    assert chosen(tmp_path, "wide and not night") == {
        "test_first_too[3]", "test_wide[3]", "test_broad[0]", "test_night_first[0]",
        *(f"test_by_day[{n}]" for n in range(4)),
    }  # fmt: skip
    assert chosen(tmp_path, "night") == {
        *(f"test_first[{n}]" for n in range(1, 4)), *(f"test_first_too[{n}]" for n in (1, 2)),
        *(f"test_wide[{n}]" for n in range(3)), *(f"test_broad[{n}]" for n in range(1, 4)),
        *(f"test_night_first[{n}]" for n in range(1, 4)), "test_night",
    }  # fmt: skip


def chosen(folder: Path, marks: str) -> set[str]:
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, "-m", marks],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
        timeout=HANGS_AFTER_S,
    )
    return {line.partition("::")[2] for line in done.stdout.splitlines() if "::" in line}


def test_a_planted_defect_is_reached_and_found_by_the_tests_of_its_module() -> None:
    name = "nothing must brake"
    worth = measure("unit/core/test_braking.py", [name])
    assert worth.reached == (name,)
    assert worth.found == (name,)
    assert table([worth]).row_count == 1
