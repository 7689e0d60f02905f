"""A run of the benchmarks reports missed goals, failures, and changes since an earlier run."""

from __future__ import annotations

import sys

import pytest
from rich.console import Console

from tests.bench.rows import row
from tests.bench.run import Rows, comparison, measured, shortfall


def test_a_missed_goal_is_printed_with_how_far_off_it_is() -> None:
    ratio = row("speed", (30.0, "1/s"), ("bare", 2.0), ">= 20 x", False)
    value = row("memory", (150.0, "MB"), ("empty", 50.0), "< 100 MB", False)
    words = row("hits", (3, "1"), ("flights", 8), "none", False)
    assert shortfall(ratio) == "speed: 30 1/s, 15 x bare; goal >= 20 x: off by 25 %"
    assert shortfall(value) == "memory: 150 MB, 3 x empty; goal < 100 MB: off by 50 %"
    assert shortfall(words).endswith("goal none")


def test_a_file_that_fails_leaves_the_others_their_rows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    one = row("speed", (10.0, "1/s"), ("bare", 2.0), "-", True)
    other = row("size", (10.0, "MB"), ("bare", 2.0), "-", True)

    def fails() -> Rows:
        raise RuntimeError("no vehicle flew [1]")

    def exits() -> Rows:
        sys.exit("no server")

    console = Console(width=160)
    files = {"a": lambda: [one], "b": fails, "c": exits, "d": lambda: [other]}
    rows, failed = measured(files, console)
    assert rows == [one, other]
    assert failed == {"b": "RuntimeError: no vehicle flew [1]", "c": "SystemExit: no server"}
    assert "in fails" in capsys.readouterr().err


def test_a_comparison_shows_changes_and_verdicts_and_what_is_in_one_run_only() -> None:
    old = [
        row("speed", (10.0, "1/s"), ("bare", 2.0), ">= 6 x", False),
        row("left", (1.0, "s"), ("bare", 2.0), "-", True),
    ]
    new = [
        row("speed", (30.0, "1/s"), ("bare", 4.0), ">= 6 x", True),
        row("added", (1.0, "s"), ("bare", 0.0), "-", True),
    ]
    console = Console(width=160)
    with console.capture() as printed:
        console.print(comparison(old, new))
    lines = printed.get().splitlines()
    for name, cells in (
        ("speed", ["30", "10", "+200.0 %", "7.5", "5", "+50.0 %", "yes, was NO"]),
        ("added", ["new"]),
        ("left", ["gone"]),
    ):
        (line,) = [line for line in lines if name in line]
        assert all(cell in line for cell in cells), line
