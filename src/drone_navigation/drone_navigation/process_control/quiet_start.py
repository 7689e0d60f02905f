"""Lets an interrupt end a program without a traceback until it takes the signals itself.

The programs import it first. A middleware that is not there ends them with a sentence here: rclpy
would end the process while it is imported.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from drone_navigation.process_control.middleware import middleware_problem

__all__ = ["PROGRAMS", "RosStartError", "run_program"]

_EXIT_NO_ROS = 2

PROGRAMS = frozenset(
    {
        "navigation_client",
        "navigation_console",
        "navigation_mcp",
        "navigation_nav2",
        "navigation_server",
        "navigation_target",
        "ros2",
    }
)


class RosStartError(Exception):
    """ROS cannot start in this process; the text is the reason."""


def run_program(
    name: str,
    args: list[str] | None,
    program: Callable[[list[str]], int],
    interrupted_code: int,
    interrupted_text: str = "",
) -> int:
    """Run a program, which may be interrupted until it takes the signals; return its exit code.

    A `RosStartError` ends it with 2 and the sentence.

    Args:
        name: of the program.
        args: its arguments; None for those of the process.
        program: takes name and arguments, and returns the exit code.
        interrupted_code: the exit code after an interrupt.
        interrupted_text: then shown on standard error, if not empty.
    """
    argv = list(sys.argv if args is None else [name, *args])
    try:
        if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return program(argv)
    except RosStartError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return _EXIT_NO_ROS
    except KeyboardInterrupt:
        if interrupted_text:
            print(interrupted_text, file=sys.stderr)
        return interrupted_code


# A test that imports a program keeps its own handler.
if Path(sys.argv[0]).stem in PROGRAMS:
    # NumPy's library would start a thread per processor, which costs a client a fifth of its time.
    # The programs' matrices are too small to share.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # A program that starts this one in its terminal holds an interrupt back until here.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT,))
    if problem := middleware_problem(os.environ):
        print(problem, file=sys.stderr)
        sys.exit(_EXIT_NO_ROS)
