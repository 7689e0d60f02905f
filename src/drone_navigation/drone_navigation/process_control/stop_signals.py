"""SIGINT and SIGTERM as a request to stop, and a limit on how long the stop takes."""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
from types import FrameType

__all__ = ["EXIT_HUNG", "STOP_LIMIT_S", "StopSignals", "leave"]

STOP_LIMIT_S = 5.0
"""The longest time from the request to the end of the process."""

EXIT_HUNG = 3
"""The process had to be ended: a part of it hung."""

_BY_ITSELF = 0
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopSignals:
    """Takes the signals, and ends the process when its stop takes too long.

    The interpreter's own handler writes each signal to a pipe, from which a thread takes it. That
    works whatever the main thread does, also inside a C library. A Python handler that sets an
    event would not: it runs in the main thread, which may just hold that event's lock.

    """

    def __init__(self, program: str) -> None:
        """Take the signals from now on; called once, by the main thread.

        Args:
            program: its name, for the sentence before it is ended.
        """
        self._exit_code = EXIT_HUNG
        self._program = program
        self._requested = threading.Event()
        self._read, self._write = os.pipe()
        os.set_blocking(self._write, False)
        threading.Thread(target=self._watch, name="stop-signals", daemon=True).start()
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)
        for number in _SIGNALS:
            signal.signal(number, _take)

    @property
    def is_requested(self) -> bool:
        """Whether there is a request to stop."""
        return self._requested.is_set()

    def wait(self, timeout_s: float) -> bool:
        """Wait for a request to stop; return whether there is one."""
        return self._requested.wait(timeout_s)

    def request(self) -> None:
        """Stop without a signal."""
        os.write(self._write, bytes([_BY_ITSELF]))
        self._requested.wait(STOP_LIMIT_S)

    def close(self, exit_code: int) -> None:
        """Let the process end with a code, whatever is left of the middleware to be destroyed.

        To be called once the program has closed all that is its own.
        """
        self._exit_code = exit_code

    def finish(self, exit_code: int) -> None:
        """End the process with a code once the program has returned.

        The interpreter's own end is left out: it stops the thread of this class first, and then
        runs the destructors of the middleware, which may take seconds on a busy machine.
        """
        self.close(exit_code)
        atexit.register(leave, exit_code)

    def _watch(self) -> None:
        while os.read(self._read, 1)[0] not in (_BY_ITSELF, *_SIGNALS):
            pass
        self._requested.set()
        threading.Event().wait(STOP_LIMIT_S)
        if self._exit_code == EXIT_HUNG:
            text = f"{self._program}: did not stop within {STOP_LIMIT_S:g} s and was ended.\n"
            os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, text.encode())
        os._exit(self._exit_code)


def leave(exit_code: int) -> None:
    """End the process here and now, once what it has written is out."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(exit_code)


def _take(_number: int, _frame: FrameType | None) -> None:
    """Keep the signal from its default action."""
