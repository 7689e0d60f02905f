"""`python -m tests.unused`, and the list of what stays in the simulator though nobody calls it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import yaml

from tests.unused import functions, kept, record, uncalled

SIMULATOR = Path(__file__).parents[2] / "sitl"


def write_package(folder: Path) -> None:
    """Write a package with a function that is called at its import, and others."""
    package = folder / "craft"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(
        '"""A craft."""\n\n\ndef fly():\n    """Fly."""\n    return land()\n\n\n'
        "def land():\n    return 1\n\n\nclass Wing:\n    def bend(self):\n        return 2\n",
        "utf-8",
    )


@pytest.mark.parametrize(
    ("program", "left"),
    [("craft.fly()", {"craft:Wing.bend"}), ("craft.land()", {"craft:fly", "craft:Wing.bend"})],
)
def test_a_run_marks_each_function_that_it_calls(
    program: str, left: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_package(tmp_path / "project")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "project"))
    code = record(
        tmp_path / "project",
        tmp_path / "records",
        [sys.executable, "-c", f"import craft; {program}"],
    )
    assert code == 0
    found = uncalled(tmp_path / "project", tmp_path / "records")
    assert {each.key for each in found} == left


def test_what_stays_uncalled_is_in_the_simulator_once_and_has_a_reason() -> None:
    groups = yaml.safe_load((SIMULATOR / "tests/data/kept_functions.yaml").read_text("utf-8"))
    named = [key for group in groups for key in group["functions"]]
    assert len(named) == len(set(named))
    assert set(named) == set(kept(SIMULATOR))
    assert set(named) <= {each.key for each in functions(SIMULATOR)}
    assert all(len(group["reason"].split()) > 3 for group in groups)
