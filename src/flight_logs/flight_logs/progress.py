"""A bar for what takes more than two seconds, on a terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

_PATIENCE_S = 2.0


@contextmanager
def bytes_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Give a function to call with the bytes done and the bytes there are.

    On a terminal (standard error), a bar appears when the work has taken two seconds; it
    goes away at the end. Elsewhere nothing is shown.
    """
    columns = (TextColumn(what), BarColumn(), DownloadColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task(what)
    started_s = time.monotonic()

    def report(done: int, total: int) -> None:
        if not bar.live.is_started:
            if not bar.console.is_terminal or time.monotonic() - started_s < _PATIENCE_S:
                return
            bar.start()
        bar.update(task, completed=done, total=total)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()
