"""Run the benchmarks: ``python tests/bench/run.py [--only WORD]``.

Every ``bench_*.py`` beside this file has a function ``measures() -> list[dict]``. Each row
says what was measured, what stands beside it as the reference in the same run, and whether
the goal is met; all rows are printed as a table and written to ``out/bench.json``.
Machines differ and are noisy: read the ratios, not the absolute figures.
"""

from __future__ import annotations

import argparse
import importlib
import json
import platform
import sys
import time
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


def main() -> int:
    """Measure; 0 if every goal is met, 1 if one is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="WORD", help="files whose name has WORD")
    parser.add_argument("--output", type=Path, default=ROOT / "out" / "bench.json", metavar="FILE")
    options = parser.parse_args()
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
    rows: list[dict[str, Any]] = []
    for name in names:
        started_s = time.monotonic()
        console.print(f"{name} ...", end=" ", highlight=False)
        rows += importlib.import_module(f"tests.bench.{name}").measures()
        console.print(f"{time.monotonic() - started_s:.0f} s", highlight=False)
    console.print(_table(rows))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    machine = {"python": platform.python_version(), "machine": platform.machine()}
    options.output.write_text(
        json.dumps({"machine": machine, "measures": rows}, indent=2) + "\n", encoding="utf-8"
    )
    missed = [row["name"] for row in rows if not row["met"]]
    for name in missed:
        console.print(f"Goal missed: {name}", style="bold red")
    return EXIT_MISSED if missed else EXIT_OK


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(*COLUMNS)
    for row in rows:
        table.add_row(*(_cell(row[column]) for column in COLUMNS))
    return table


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"
    return "" if value is None else str(value)


if __name__ == "__main__":
    sys.exit(main())
