"""A progress bar on a terminal, for work of more than two seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

PATIENCE_S = 2.0


@contextmanager
def bytes_bar(
    what: str, console: Console | None = None, patience_s: float = PATIENCE_S
) -> Iterator[Callable[[int, int], None]]:
    """Give a function to call with the bytes done and the bytes there are.

    A bar appears on a terminal when the work has taken `patience_s`, and goes away at the end.
    Elsewhere nothing is shown.

    Args:
        what: what is being done, shown beside the bar.
        console: where to, standard error if not given.
        patience_s: for how long nothing is shown.
    """
    columns = (TextColumn(what), BarColumn(), DownloadColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console or Console(stderr=True), transient=True)
    task = bar.add_task(what)
    started_s = time.monotonic()

    def report(done: int, total: int) -> None:
        if not bar.live.is_started:
            if not bar.console.is_terminal or time.monotonic() - started_s < patience_s:
                return
            bar.start()
        bar.update(task, completed=done, total=total)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()
