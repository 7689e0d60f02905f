"""Processes of a flight: they end, with what they have started, and nothing waits for ever."""

from __future__ import annotations

import os
import signal
import threading
import time

import psutil

from drone_navigation.processes import Process
from tests.support.processes import patient_s

_START = "import subprocess; c = subprocess.Popen(['sleep', '50']); print(c.pid, flush=True)"
_DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


def _is_running(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_what_a_process_has_started_is_killed_with_it() -> None:
    process = Process("deaf", ["python", "-c", f"{_DEAF}; {_START}; c.wait()"])
    child = int(process.wait_for("", 20.0))
    assert process.stop(0.5) == -signal.SIGKILL
    deadline_s, pause = time.monotonic() + patient_s(20.0), threading.Event()
    while _is_running(child):
        assert time.monotonic() < deadline_s, "it outlives the process that started it"
        pause.wait(0.05)


def test_a_process_ends_though_what_it_left_behind_holds_its_output() -> None:
    process = Process("parent", ["python", "-c", _START])
    child = int(process.wait_for("", 20.0))
    try:
        assert process.wait(20.0) == 0
        assert _is_running(child), "it waited for the output to be closed"
    finally:
        os.kill(child, signal.SIGKILL)
