"""Lets an interrupt end a program without a traceback while it is still being imported.

The programs import it first. From `main` on they take the signals themselves.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

__all__ = ["PROGRAMS", "take_interrupts"]

PROGRAMS = frozenset(
    {"navigation_client", "navigation_console", "navigation_nav2", "navigation_server"}
)


def take_interrupts() -> None:
    """Let an interrupt raise KeyboardInterrupt again."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)


# A test that imports a program keeps its own handler.
if Path(sys.argv[0]).stem in PROGRAMS:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
