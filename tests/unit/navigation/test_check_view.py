"""The report of ``navigation_server --check`` is shown."""

from __future__ import annotations

import io

from rich.console import Console

from drone_navigation.check.report import CheckVerdict, Report
from drone_navigation.check.report_output import plain_lines, show
from drone_navigation.check.sections import CheckSection, Line


def test_a_shared_warning_is_shown_once() -> None:
    lines = tuple(Line(name, "0 (nothing)", "Off.") for name in ("A", "B"))
    alone = Line("C", "1", "Look here.")
    report = Report(CheckVerdict.READY, "Ready.", (CheckSection("Itself", (*lines, alone)),))
    assert plain_lines(report).count("    ! Off.") == 0
    assert "  ! A, B: Off." in plain_lines(report)
    assert "    ! Look here." in plain_lines(report)
    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    show(report, console)
    told = console.file.getvalue()
    assert told.count("Off.") == 1
