"""Each file of the benchmarks runs in its short form, so that none fails unnoticed."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from drone_navigation.processes import Process
from tests.bench.run import COLUMNS

HERE = Path(__file__).resolve().parent
# One after the other: they are to measure, and most of them fly in real time.
pytestmark = [
    pytest.mark.wide,
    pytest.mark.by_day,
    pytest.mark.xdist_group("bench"),
    pytest.mark.timeout(900),
]


@pytest.mark.parametrize("name", sorted(path.stem for path in HERE.glob("bench_*.py")))
def test_it_runs_each_line_once(name: str, tmp_path: Path) -> None:
    output = tmp_path / "bench.json"
    command = ["python", str(HERE / "run.py"), "--short", "--only", name, "--output", str(output)]
    run = Process("bench", command)
    try:
        assert run.wait(800.0) == 0, run.text
    finally:
        run.stop()
    result = json.loads(output.read_text("utf-8"))
    assert result["short"] is True
    assert result["failed"] == {}
    assert result["measures"]
    for row in result["measures"]:
        assert tuple(row) == COLUMNS
        assert not math.isnan(row["value"]), row
        assert row["goal"], row
