"""Output of a check report: tables on a terminal, plain lines elsewhere, or JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from drone_navigation.check.report import CheckVerdict, Report
from drone_navigation.check.sections import CheckSection

_COLOURS = {
    CheckVerdict.READY: "green",
    CheckVerdict.NOT_READY: "red",
    CheckVerdict.NO_VEHICLE: "red",
}


def as_json(reports: Mapping[str, Report]) -> str:
    """Return reports as JSON, each with the exit code as ``verdict``.

    One of a vehicle without a name stands by itself; those of several are in an object, by name.
    """
    result = {
        name: {**asdict(report), "verdict": int(report.verdict)} for name, report in reports.items()
    }
    return json.dumps(result.get("", result), indent=2)


def show(report: Report, console: Console) -> None:
    """Print a report, as its console can show it."""
    if console.is_terminal:
        _show_tables(report, console)
        return
    for line in plain_lines(report):
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def plain_lines(report: Report) -> list[str]:
    """Return the report line by line."""
    lines = []
    for section in report.sections:
        lines.append(f"{section.title}:")
        shared = _shared_warnings(section)
        for line in section.lines:
            lines.append(f"  {line.name}: {line.value}")
            if line.warning is not None and line.warning not in shared:
                lines.append(f"    ! {line.warning}")
        lines += [f"  ! {', '.join(names)}: {warning}" for warning, names in shared.items()]
    for missing in report.missing:
        lines += [f"Missing: {missing.what}", f"  -> {missing.advice}"]
    lines += [f"Manual step: {step}" for step in report.yours]
    return [*lines, report.sentence]


def _shared_warnings(section: CheckSection) -> dict[str, list[str]]:
    """Return the warnings shared by several lines of a section, with the line names."""
    names: dict[str, list[str]] = {}
    for line in section.lines:
        if line.warning is not None:
            names.setdefault(line.warning, []).append(line.name)
    return {warning: those for warning, those in names.items() if len(those) > 1}


def _show_tables(report: Report, console: Console) -> None:
    for section in report.sections:
        table = Table(title=section.title, title_justify="left", show_header=False, box=None)
        table.add_column(style="cyan", no_wrap=True)
        table.add_column()
        shared = _shared_warnings(section)
        for line in section.lines:
            together = line.warning in shared
            table.add_row(line.name, Text(line.value, style="yellow" if together else ""))
            if line.warning is not None and not together:
                table.add_row("", Text(line.warning, style="yellow"))
        console.print(table)
        for warning, names in shared.items():
            text = Text(f"{', '.join(names)}: {warning}", style="yellow")
            console.print(Padding(text, (0, 0, 0, 1)))
        console.print()
    for missing in report.missing:
        console.print(Text(f"Missing: {missing.what}", style="bold red"))
        console.print(Text(f"  {missing.advice}"))
    for step in report.yours:
        console.print(Text(f"Manual step: {step}", style="bold yellow"))
    console.print(Text(report.sentence, style=f"bold {_COLOURS[report.verdict]}"))
