"""The figures in docs/benchmarks.md: written from a run's rows, and their goals read again."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md"
BEGIN = "<!-- Written by `make bench ARGS=--docs`. -->\n"
END = "<!-- End of what is written. -->\n"
_HEAD = "| Measure | Value | Reference | Goal |\n|---|---|---|---|\n"
_FOLDER = Path(__file__).parent


def with_figures(page: str, results: dict[str, dict[str, Any]]) -> str:
    """Return the page with the rows of all files, a section each, in place of those it has."""
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    sections = [_section(name, result) for name, result in results.items()]
    return "\n".join([before + BEGIN, *sections, END + after])


def goals_in(page: str) -> dict[str, dict[str, str]]:
    """Return the goals that a page has, by file and measure."""
    _, _, rest = page.partition(BEGIN)
    goals: dict[str, dict[str, str]] = {}
    for section in rest.partition(END)[0].split("\n### ")[1:]:
        lines = section.splitlines()
        rows = [line[2:-2].split(" | ") for line in lines if line.startswith("| ")]
        found = {cells[0]: cells[3].removesuffix(_MISSED) for cells in rows[1:]}
        goals[lines[0].strip("`").removesuffix(".py")] = found
    return goals


def cell(value: object) -> str:
    """Return a value as the tables have it."""
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 1000.0 else f"{value:,.0f}"
    return "" if value is None else str(value)


_MISSED = " (**missed**)"


def _section(name: str, result: dict[str, Any]) -> str:
    said = ast.get_docstring(ast.parse((_FOLDER / f"{name}.py").read_text("utf-8"))) or name
    first = said.partition("\n\n")[0].replace("\n", " ").partition(": ``")[0].rstrip(".")
    when = f"Load of the machine: {result['load']:g}."
    if result["short"]:
        when = "Not measured since it was last changed."
    lines = [f"### `{name}.py`\n", f"{first}. {when}\n"]
    if result["failed"]:
        lines.append(f"It failed: {result['failed']}\n")
    table = _HEAD + "".join(_line(row, result["short"]) for row in result["rows"])
    return "\n".join([*lines, table])


def _line(row: dict[str, Any], short: bool) -> str:
    if short:
        return f"| {row['name']} | not measured | {row['reference']} | {row['goal']} |\n"
    unit = "" if row["unit"] in ("", "1") else f" {row['unit']}"
    value = f"{cell(row['value'])}{unit}"
    reference = f"{cell(row['reference_value'])}{unit}, {row['reference']}"
    goal = row["goal"] + ("" if row["met"] else _MISSED)
    cells = (str(text).replace("|", "/") for text in (row["name"], value, reference, goal))
    return f"| {' | '.join(cells)} |\n"
