"""The progress bar appears on a terminal during long work, and nowhere else."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from flight_logs.progress import bytes_bar


@pytest.mark.parametrize(
    ("terminal", "patience_s", "shown"),
    [(True, 0.0, True), (True, 1e6, False), (False, 0.0, False)],
)
def test_a_bar_is_for_terminals_and_for_what_takes_long(
    terminal: bool, patience_s: float, shown: bool
) -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=terminal, width=100)
    with bytes_bar("Reading some.tlog", console, patience_s) as report:
        for done in (10, 20, 40):
            report(done, 40)
    assert ("Reading some.tlog" in screen.getvalue()) == shown
    if not shown:
        assert screen.getvalue() == ""
