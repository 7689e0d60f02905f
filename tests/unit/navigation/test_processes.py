"""Processes of a flight: they end, with what they have started, and nothing waits for ever."""

from __future__ import annotations

import os
import signal
import threading
import time

import psutil
import pytest

from drone_navigation.processes import Process, ProcessGroup, free_domain
from tests.support.processes import HANGS_AFTER_S, patient_s

_START = "import subprocess; c = subprocess.Popen(['sleep', '50']); print(c.pid, flush=True)"
_DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"


# A program that starts two others, which print their process ids, and waits.
_PROGRAM = """
import sys, threading
from drone_navigation.processes import ProcessGroup

code = sys.argv[1] + "import os, time; print(os.getpid(), flush=True); time.sleep(50)"
try:
    with ProcessGroup() as group:
        for name in ("one", "two"):
            print(group.start(name, ["python", "-c", code]).wait_for("", 20.0), flush=True)
        print("started", flush=True)
        threading.Event().wait(50.0)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(7)
"""


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
        assert process.wait(HANGS_AFTER_S) == 0
        assert _is_running(child), "it waited for the output to be closed"
    finally:
        os.kill(child, signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    "children",
    [pytest.param("", id="willing"), pytest.param(f"{_DEAF}; ", id="deaf", marks=pytest.mark.wide)],
)
def test_an_interrupt_ends_a_program_and_all_that_it_has_started(
    children: str, number: signal.Signals
) -> None:
    program = Process("program", ["python", "-c", _PROGRAM, children])
    try:
        program.wait_for("started", patient_s(20.0))
        pids = [int(line) for line in program.lines[:2]]
        program.signal(number)
        program.signal(number)
        assert program.wait(patient_s(10.0)) == 7, program.text
        assert program.lines[-1] == "interrupted", program.text
        assert not any(_is_running(pid) for pid in pids)
    finally:
        program.stop(1.0)


def _start_while_interrupted(group: ProcessGroup) -> None:
    with group._held():
        os.kill(os.getpid(), signal.SIGINT)
        process = Process("child", ["python", "-c", "import time; time.sleep(50)"])
        group._processes.append(process)


def test_an_interrupt_while_a_process_is_started_is_seen_afterwards() -> None:
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    group = ProcessGroup()
    try:
        with pytest.raises(KeyboardInterrupt):
            _start_while_interrupted(group)
        (process,) = group._processes
        group._stop()
        assert process.returncode is not None
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


_DOMAIN = "from drone_navigation.processes import free_domain; print(free_domain(40), flush=True)"


def test_a_ros_domain_is_given_to_one_program_only() -> None:
    """A domain without nodes may be about to be used by the program that asked for it."""
    mine = free_domain(40)
    other = Process("other", ["python", "-c", _DOMAIN])
    assert other.wait(patient_s(5.0)) == 0
    assert mine != int(other.text)
    assert free_domain(40) != mine
