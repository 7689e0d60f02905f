"""A bar on a terminal for requests that take more than two seconds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

_PATIENCE_S = 2.0


class Tell(Protocol):
    """Shows how far something has come."""

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show it; total is 0 while it is unknown."""


@contextmanager
def counting_bar(shown: bool) -> Iterator[Tell]:
    """Give a function to call with what is done.

    The bar appears on standard error, if that is a terminal, after two seconds, and goes away at
    the end.

    Args:
        shown: whether it may appear at all.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    task = bar.add_task("", total=None)
    started_s = time.monotonic()

    def tell(what: str, done: int, total: int) -> None:
        if not bar.live.is_started:
            late = time.monotonic() - started_s >= _PATIENCE_S
            if not (shown and late and bar.console.is_terminal):
                return
            bar.start()
        bar.update(task, description=what, completed=done, total=total or None)

    try:
        yield tell
    finally:
        if bar.live.is_started:
            bar.stop()
