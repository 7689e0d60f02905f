"""The program `python -m mavlink_sitl` as a process, and clients that talk to it."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from pymavlink import mavutil

WAIT_S = 200.0
"""No wait is longer; on an idle machine each is far below a second"""


def environment(**more: str) -> dict[str, str]:
    """That of the tests, with what they import."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), **more}


def free_udp_port() -> int:
    """Return a UDP port of 127.0.0.1 that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Program:
    """A running simulator, and the lines that it prints."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.first_line = self.line()

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().rstrip("\n")

    @property
    def port(self) -> int:
        """The port of its (last) link."""
        return int(self.first_line.rsplit(":", 1)[1])

    def end(self, number: int = signal.SIGTERM) -> str:
        """Send a signal; what it printed until its end, which must be a clean one."""
        self.process.send_signal(number)
        rest, _ = self.process.communicate(timeout=WAIT_S)
        assert self.process.returncode == 0
        return rest


@contextlib.contextmanager
def running(*options: str) -> Iterator[Program]:
    """Start the program; whatever happens, it does not outlive the test."""
    with subprocess.Popen(
        [sys.executable, "-m", "mavlink_sitl", *options],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        try:
            yield Program(process)
        finally:
            process.kill()


@contextlib.contextmanager
def client(address: str) -> Iterator[Any]:
    """Pymavlink's connection, closed at the end."""
    connection = mavutil.mavlink_connection(address, source_system=255, dialect="all")
    try:
        yield connection
    finally:
        connection.close()
