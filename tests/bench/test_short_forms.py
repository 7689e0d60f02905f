"""Each file of the benchmarks runs in its short form, so that none fails unnoticed.

Its rows have the names and goals that docs/benchmarks.md has. By day some run, by night the rest.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from drone_navigation.processes import Process
from tests.bench.page import PAGE, goals_in
from tests.bench.run import COLUMNS

HERE = Path(__file__).resolve().parent
BY_DAY = ("goals", "planner", "telemetry", "tlog", "traffic")
# One after the other: they are to measure, and most of them fly in real time.
pytestmark = [
    pytest.mark.wide,
    pytest.mark.by_day,
    pytest.mark.xdist_group("bench"),
    pytest.mark.timeout(900),
]


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.night] * (name[len("bench_") :] not in BY_DAY))
        for name in sorted(path.stem for path in HERE.glob("bench_*.py"))
    ],
)
def test_it_runs_each_line_once(name: str, tmp_path: Path) -> None:
    output = tmp_path / "bench.json"
    command = ["python", str(HERE / "run.py"), "--short", "--only", name, "--output", str(output)]
    run = Process("bench", command)
    try:
        assert run.wait(800.0) == 0, run.text
    finally:
        run.stop()
    written = json.loads(output.read_text("utf-8"))
    assert written["short"] is True
    result = written["files"][name]
    assert result["failed"] == ""
    assert result["rows"]
    for row in result["rows"]:
        assert tuple(row) == COLUMNS
        assert not math.isnan(row["value"]), row
    shown = goals_in(PAGE.read_text("utf-8"))[name]
    said = {row["name"]: row["goal"] for row in result["rows"]}
    assert said == {measure: shown.get(measure) for measure in said}
