"""A run of the benchmarks reports missed goals, failures, and changes since an earlier run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

import pytest
from rich.console import Console

from tests.bench.page import BEGIN, END, PAGE, goals_in, with_figures
from tests.bench.rows import row
from tests.bench.run import Results, Rows, comparison, measured, rows_of, shortfall


def test_a_missed_goal_is_printed_with_how_far_off_it_is() -> None:
    ratio = row("speed", (30.0, "1/s"), ("bare", 2.0), ">= 20 x", False)
    value = row("memory", (150.0, "MB"), ("empty", 50.0), "< 100 MB", False)
    words = row("hits", (3, "1"), ("flights", 8), "none", False)
    assert shortfall(ratio) == "speed: 30 1/s, 15 x bare; goal >= 20 x: off by 25 %"
    assert shortfall(value) == "memory: 150 MB, 3 x empty; goal < 100 MB: off by 50 %"
    assert shortfall(words).endswith("goal none")


def test_a_goal_is_judged_as_its_text_reads() -> None:
    assert row("speed", (30.0, "1/s"), ("bare", 2.0), ">= 15 x")["met"]
    assert not row("speed", (30.0, "1/s"), ("bare", 2.0), "> 15 x")["met"]
    assert not row("memory", (150.0, "MB"), ("empty", 150.0), "< 100 MB")["met"]
    assert row("rate", (1500.0, "1/s"), ("empty", 2.0), ">= 1,500 1/s")["met"]
    assert row("speed", (1.0, "x"), ("empty", 200.0), "< 2 x")["met"]  # its unit is x, too
    assert row("seen", (1.0, "s"), ("bare", 0.0), "-")["met"]
    with pytest.raises(ValueError, match="judged differently"):
        row("memory", (150.0, "MB"), ("empty", 50.0), "< 100 MB", True)
    with pytest.raises(ValueError, match="cannot be read"):
        row("hits", (3, "1"), ("flights", 8), "none")


def test_each_row_is_kept_as_soon_as_it_is_measured_whatever_fails_after_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    one = row("speed", (10.0, "1/s"), ("bare", 2.0), "-")
    other = row("size", (10.0, "MB"), ("bare", 2.0), "-")

    def fails() -> Iterator[dict[str, Any]]:
        yield one
        raise RuntimeError("no vehicle flew [1]")

    def exits() -> Rows:
        sys.exit("no server")

    results: Results = {}
    written: list[int] = []
    files = {"a": lambda: [one], "b": fails, "c": exits, "d": lambda: [other]}
    measured(files, Console(width=160), results, lambda now: written.append(len(rows_of(now))))
    assert rows_of(results) == [one, one, other]
    assert {name: result["failed"] for name, result in results.items()} == {
        "a": "",
        "b": "RuntimeError: no vehicle flew [1]",
        "c": "SystemExit: no server",
        "d": "",
    }
    assert written == [1, 1, 2, 2, 2, 3, 3]
    assert "in fails" in capsys.readouterr().err


def test_the_page_gets_the_rows_and_gives_their_goals_again() -> None:
    missed = row("size", (10_000.0, "MB"), ("bare", 2.0), "< 3 MB")
    met = row("hits | hits", (0, "1"), ("flights", 8), "none", True)
    results = {"bench_start": {"short": False, "load": 0.5, "rows": [missed, met], "failed": ""}}
    page = with_figures(f"# Head\n\n{BEGIN}old\n{END}\nTail\n", results)
    assert page.startswith("# Head\n")
    assert page.endswith("Tail\n")
    assert "old" not in page
    assert "| size | 10,000 MB | 2 MB, bare | < 3 MB (**missed**) |" in page
    assert "Load of the machine: 0.5." in page
    assert goals_in(page) == {"bench_start": {"size": "< 3 MB", "hits / hits": "none"}}
    assert with_figures(page, results) == page
    results["bench_start"]["short"] = True
    page = with_figures(page, results)
    assert "| size | not measured | bare | < 3 MB |" in page
    assert goals_in(page)["bench_start"]["size"] == "< 3 MB"


def test_the_page_has_a_section_for_each_file() -> None:
    assert sorted(goals_in(PAGE.read_text("utf-8"))) == sorted(
        path.stem for path in (PAGE.parents[1] / "tests/bench").glob("bench_*.py")
    )


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
