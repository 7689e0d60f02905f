"""A terminal of a test's own, with a program that is its foreground."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Mapping, Sequence
from typing import Any

import psutil

from tests.support.processes import patient_s

# The child makes the terminal its own before it becomes the program: Ctrl-C is a signal then.
_LAUNCH = (
    "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
    "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
)
_ESCAPES = re.compile(r"\x1b(\[[0-?]*[ -/]*[@-~]|\][^\x07]*\x07|.)")


class Terminal:
    """Runs ``python ARGUMENTS`` on a pseudo-terminal and keeps what it prints."""

    def __init__(
        self,
        arguments: Sequence[str],
        environment: Mapping[str, str],
        columns: int = 100,
        rows: int = 30,
    ) -> None:
        """Start it."""
        self.raw = ""
        self._waited = 0
        self._ours, self._theirs = pty.openpty()
        size = struct.pack("HHHH", rows, columns, 0, 0)
        fcntl.ioctl(self._theirs, termios.TIOCSWINSZ, size)
        self.modes_before = self.modes
        self._child = subprocess.Popen(
            [sys.executable, "-c", _LAUNCH, *arguments],
            stdin=self._theirs,
            stdout=self._theirs,
            stderr=self._theirs,
            env=dict(environment) | {"TERM": "xterm-256color"},
            start_new_session=True,
        )

    @property
    def modes(self) -> list[Any]:
        """Return the terminal's modes from termios."""
        return termios.tcgetattr(self._theirs)

    @property
    def text(self) -> str:
        """Everything that was printed, without escape sequences."""
        return _ESCAPES.sub("", self.raw)

    def type(self, characters: str) -> None:
        """Press keys."""
        os.write(self._ours, characters.encode())

    def wait_for(self, fragment: str, timeout_s: float) -> None:
        """Wait until ``fragment`` stands in what was printed since the last wait."""
        self.wait_for_any((fragment,), timeout_s)

    def wait_for_any(self, fragments: Sequence[str], timeout_s: float) -> str:
        """Wait for one of some fragments in the same way; return which it was."""
        deadline = time.monotonic() + patient_s(timeout_s)
        while True:
            text = self.text
            for fragment in fragments:
                if fragment in text[self._waited :]:
                    self._waited = text.index(fragment, self._waited) + len(fragment)
                    return fragment
            if time.monotonic() > deadline or self._child.poll() is not None:
                code = self._child.poll()
                how = "the program still runs" if code is None else f"it exited with {code}"
                raise AssertionError(f"{fragments} did not come; {how}. Printed:\n{text}")
            self._read(0.05)

    def wait_for_stop(self, timeout_s: float) -> None:
        """Wait until the program has been stopped, as by Ctrl-Z."""
        deadline = time.monotonic() + patient_s(timeout_s)
        while psutil.Process(self._child.pid).status() != psutil.STATUS_STOPPED:
            assert time.monotonic() < deadline, f"It does not stop. Printed:\n{self.text}"
            self._read(0.05)
        while self._read(0.0):
            pass

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the program."""
        self._child.send_signal(number)

    def wait(self, timeout_s: float) -> int:
        """Wait for the program's end; return its exit code."""
        deadline = time.monotonic() + patient_s(timeout_s)
        while self._child.poll() is None:
            if time.monotonic() > deadline:
                raise AssertionError(f"It is still running. Printed:\n{self.text}")
            self._read(0.05)
        while self._read(0.0):
            pass
        return self._child.returncode

    def _read(self, timeout_s: float) -> bool:
        if not select.select([self._ours], [], [], timeout_s)[0]:
            return False
        self.raw += os.read(self._ours, 65536).decode("utf-8", "replace")
        return True

    def close(self) -> None:
        """End the program, if it has not ended, and the terminal."""
        if self._child.poll() is None:
            self._child.kill()
        self._child.wait(10.0)
        os.close(self._ours)
        os.close(self._theirs)
