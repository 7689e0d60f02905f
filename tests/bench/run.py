"""Run the benchmarks: ``python tests/bench/run.py [--only WORD] [--short] [--docs]``.

Every ``bench_*.py`` beside this file has a function ``measures(short: bool)`` that returns or
yields rows. Each says what was measured, what stands beside it as the reference in the same run,
and whether the goal is met. A row is in ``out/bench.json`` as soon as it is measured, with the
rows that files which were not run had before. At the end all are printed as a table. A missed goal
is printed with how far off it is. A file that fails is named at the end; its earlier rows and those
of the others stay. The figures can be compared with those of an earlier run.
Machines differ and are noisy: read the ratios, not the absolute figures.

``--short`` runs every line of each file in a few seconds, with the smallest counts and windows.
Its figures say nothing, and no goal is judged. ``--docs`` writes the rows into docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.bench.page import PAGE, cell, with_figures  # noqa: E402 - the path comes first
from tests.bench.rows import bound_of  # noqa: E402

COLUMNS = ("name", "value", "unit", "reference", "reference_value", "ratio", "goal", "met")
_LOG_WIDTH = 200
EXIT_OK = 0
EXIT_MISSED = 1
EXIT_USAGE = 2
EXIT_FAILED = 3

Rows = list[dict[str, Any]]
Results = dict[str, dict[str, Any]]
"""Of each file: the load of the machine when it began, the rows, why it failed, if it did, and how
long it ran"""


def main() -> int:
    """Measure; 0 if every goal is met, 1 if one is missed, 3 if a file failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="WORD", help="files whose name has WORD")
    parser.add_argument("--short", action="store_true", help="run each line once; judge no goal")
    parser.add_argument("--docs", action="store_true", help="write docs/benchmarks.md")
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: out/bench.json")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="an earlier run's output")
    options = parser.parse_args()
    if options.short and options.docs:
        parser.error("--docs takes no figures of --short")
    name = "bench_short.json" if options.short else "bench.json"
    output: Path = options.output or ROOT / "out" / name
    names = sorted(path.stem for path in Path(__file__).parent.glob("bench_*.py"))
    chosen = [name for name in names if options.only in name]
    if not chosen:
        print(f"No benchmark has '{options.only}' in its name.", file=sys.stderr)
        return EXIT_USAGE
    try:
        earlier = rows_of(_read(options.compare)) if options.compare else []
        kept = _read(output) if output.exists() and chosen != names else {}
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"Cannot read an earlier run: {error}", file=sys.stderr)
        return EXIT_USAGE
    console = Console()
    if not console.is_terminal:
        console = Console(width=_LOG_WIDTH)
    results = {name: kept[name] for name in names if name in kept}
    files = {name: partial(_measures, name, options.short) for name in chosen}
    measured(files, console, results, partial(_write, output, options.short), options.short)
    results = {name: results[name] for name in names if name in results}
    rows = rows_of({name: results[name] for name in chosen})
    console.print(_table(rows))
    console.print(f"In all: {sum(results[name]['took_s'] for name in chosen)} s")
    if options.compare:
        console.print(comparison(earlier, rows))
    if options.docs:
        PAGE.write_text(with_figures(PAGE.read_text("utf-8"), results), encoding="utf-8")
    missed = [] if options.short else [row for row in rows if not row["met"]]
    for row in missed:
        console.print(f"Goal missed: {shortfall(row)}", style="bold red")
    failed = {name: results[name]["failed"] for name in chosen if results[name]["failed"]}
    for name, last_line in failed.items():
        console.print(f"Failed: {name}: {last_line}", style="bold red", markup=False)
    if failed:
        return EXIT_FAILED
    return EXIT_MISSED if missed else EXIT_OK


def _measures(name: str, short: bool) -> Iterable[dict[str, Any]]:
    rows: Iterable[dict[str, Any]] = importlib.import_module(f"tests.bench.{name}").measures(short)
    return rows


def _read(path: Path) -> Results:
    files: Results = json.loads(path.read_text("utf-8"))["files"]
    rows_of(files)
    return files


def _write(path: Path, short: bool, results: Results) -> None:
    machine = {"python": platform.python_version(), "machine": platform.machine()}
    written = {"machine": machine, "short": short, "files": results}
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".part")
    beside.write_text(json.dumps(written, indent=2) + "\n", encoding="utf-8")
    beside.replace(path)


def rows_of(results: Results) -> Rows:
    """Return the rows of all files."""
    return [row for result in results.values() for row in result["rows"]]


def measured(
    files: Mapping[str, Callable[[], Iterable[dict[str, Any]]]],
    console: Console,
    results: Results,
    write: Callable[[Results], None],
    short: bool = False,
) -> None:
    """Measure with one file after the other; one that fails leaves all that was measured.

    Args:
        files: what measures, by name.
        console: where progress is printed.
        results: gets what is measured; of a file that failed, the last line of its traceback.
        write: called with the results after each row.
        short: whether this is the short form.
    """
    for name, measures in files.items():
        started_s = time.monotonic()
        console.print(f"{name} ...", end=" ", highlight=False)
        load = round(os.getloadavg()[0], 1)
        result: dict[str, Any] = {
            "short": short,
            "load": load,
            "rows": [],
            "failed": "",
            "took_s": 0,
        }
        results[name] = result
        try:
            for row in measures():
                result["rows"].append(row)
                write(results)
        except (Exception, SystemExit) as error:
            result["failed"] = traceback.format_exception_only(error)[-1].strip()
            traceback.print_exc()
            console.print("failed after", end=" ", highlight=False)
        result["took_s"] = round(time.monotonic() - started_s)
        write(results)
        console.print(f"{result['took_s']} s", highlight=False)


def _table(rows: Rows) -> Table:
    table = Table(*COLUMNS)
    for row in rows:
        table.add_row(*(cell(row[column]) for column in COLUMNS))
    return table


def shortfall(row: dict[str, Any]) -> str:
    """Return what a row has and should have, and how far apart these are."""
    told = f"{row['name']}: {cell(row['value'])} {row['unit']}, {cell(row['ratio'])} x"
    told += f" {row['reference']}; goal {row['goal']}"
    bound = bound_of(row["goal"], row["unit"])
    if bound is None or bound[1] == 0.0:
        return told
    measured = row["value"] if bound[2] else row["ratio"]
    if measured is None:
        return told
    return f"{told}: off by {abs(_percent(measured, bound[1])):.3g} %"


def comparison(earlier: Rows, rows: Rows) -> Table:
    """Return what has changed since an earlier run; ratios depend less on the machine's load."""
    table = Table("name", "reference", "value", "was", "change", "ratio", "was", "change", "met")
    before = {(row["name"], row["reference"]): row for row in earlier}
    for row in rows:
        old = before.pop((row["name"], row["reference"]), None)
        cells = []
        for column in ("value", "ratio"):
            new, was = row[column], old and old[column]
            change = f"{_percent(new, was):+.1f} %" if was and new is not None else ""
            cells += [cell(new), cell(was), change]
        verdict = cell(row["met"])
        if old and old["met"] != row["met"]:
            verdict += f", was {cell(old['met'])}"
        table.add_row(row["name"], row["reference"], *cells, verdict if old else "new")
    for name, reference in before:
        table.add_row(name, reference, *[""] * 6, "gone")
    return table


def _percent(new: float, old: float) -> float:
    return 100.0 * (new - old) / abs(old)


if __name__ == "__main__":
    sys.exit(main())
