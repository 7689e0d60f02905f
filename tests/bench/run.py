"""Run the benchmarks: ``python tests/bench/run.py [--only WORD] [--short] [--compare OLD.json]``.

Every ``bench_*.py`` beside this file has a function ``measures(short: bool) -> list[dict]``. Each
row says what was measured, what stands beside it as the reference in the same run, and whether
the goal is met; all rows are printed as a table and written to ``out/bench.json``. A missed goal is
printed with how far off it is. A file that fails is named at the end; the others keep their rows.
The figures can be compared with those of an earlier run.
Machines differ and are noisy: read the ratios, not the absolute figures.

``--short`` runs every line of each file in a few seconds, with the smallest counts and windows.
Its figures say nothing, and no goal is judged.
"""

from __future__ import annotations

import argparse
import importlib
import json
import platform
import re
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = ("name", "value", "unit", "reference", "reference_value", "ratio", "goal", "met")
_LOG_WIDTH = 200
EXIT_OK = 0
EXIT_MISSED = 1
EXIT_USAGE = 2
EXIT_FAILED = 3

Rows = list[dict[str, Any]]


def main() -> int:
    """Measure; 0 if every goal is met, 1 if one is missed, 3 if a file failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="WORD", help="files whose name has WORD")
    parser.add_argument("--short", action="store_true", help="run each line once; judge no goal")
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: out/bench.json")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="an earlier run's output")
    options = parser.parse_args()
    try:
        earlier = json.loads(options.compare.read_text())["measures"] if options.compare else []
    except (OSError, ValueError, KeyError) as error:
        print(f"Cannot compare with {options.compare}: {error}", file=sys.stderr)
        return EXIT_USAGE
    sys.path.insert(0, str(ROOT))
    names = sorted(
        path.stem for path in Path(__file__).parent.glob("bench_*.py") if options.only in path.stem
    )
    if not names:
        print(f"No benchmark has '{options.only}' in its name.", file=sys.stderr)
        return EXIT_USAGE
    console = Console()
    if not console.is_terminal:
        console = Console(width=_LOG_WIDTH)
    files = {name: partial(_measures, name, options.short) for name in names}
    rows, failed = measured(files, console)
    console.print(_table(rows))
    if options.compare:
        console.print(comparison(earlier, rows))
    name = "bench_short.json" if options.short else "bench.json"
    output: Path = options.output or ROOT / "out" / name
    output.parent.mkdir(parents=True, exist_ok=True)
    machine = {"python": platform.python_version(), "machine": platform.machine()}
    result = {"machine": machine, "short": options.short, "measures": rows, "failed": failed}
    output.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    missed = [] if options.short else [row for row in rows if not row["met"]]
    for row in missed:
        console.print(f"Goal missed: {shortfall(row)}", style="bold red")
    for name, last_line in failed.items():
        console.print(f"Failed: {name}: {last_line}", style="bold red", markup=False)
    if failed:
        return EXIT_FAILED
    return EXIT_MISSED if missed else EXIT_OK


def _measures(name: str, short: bool) -> Rows:
    rows: Rows = importlib.import_module(f"tests.bench.{name}").measures(short)
    return rows


def measured(
    files: Mapping[str, Callable[[], Rows]], console: Console
) -> tuple[Rows, dict[str, str]]:
    """Measure with one file after the other; one that fails leaves the others their rows.

    Returns:
        The rows of all, and for each file that failed the last line of its traceback.
    """
    rows: Rows = []
    failed: dict[str, str] = {}
    for name, measures in files.items():
        started_s = time.monotonic()
        console.print(f"{name} ...", end=" ", highlight=False)
        try:
            rows += measures()
        except (Exception, SystemExit) as error:
            failed[name] = traceback.format_exception_only(error)[-1].strip()
            traceback.print_exc()
            console.print("failed after", end=" ", highlight=False)
        console.print(f"{time.monotonic() - started_s:.0f} s", highlight=False)
    return rows, failed


def _table(rows: Rows) -> Table:
    table = Table(*COLUMNS)
    for row in rows:
        table.add_row(*(_cell(row[column]) for column in COLUMNS))
    return table


def shortfall(row: dict[str, Any]) -> str:
    """Return what a row has and should have, and how far apart these are."""
    told = f"{row['name']}: {_cell(row['value'])} {row['unit']}, {_cell(row['ratio'])} x"
    told += f" {row['reference']}; goal {row['goal']}"
    parts = re.match(r"[<>]=? *([\d.]+) *(\S*)", row["goal"])
    if parts is None or float(parts[1]) == 0.0:
        return told
    measured = row["value"] if parts[2] in ("", row["unit"]) else row["ratio"]
    if measured is None:
        return told
    return f"{told}: off by {abs(_percent(measured, float(parts[1]))):.3g} %"


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
            cells += [_cell(new), _cell(was), change]
        verdict = _cell(row["met"])
        if old and old["met"] != row["met"]:
            verdict += f", was {_cell(old['met'])}"
        table.add_row(row["name"], row["reference"], *cells, verdict if old else "new")
    for name, reference in before:
        table.add_row(name, reference, *[""] * 6, "gone")
    return table


def _percent(new: float, old: float) -> float:
    return 100.0 * (new - old) / abs(old)


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"
    return "" if value is None else str(value)


if __name__ == "__main__":
    sys.exit(main())
