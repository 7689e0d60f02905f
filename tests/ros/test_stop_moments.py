"""Programs that start others end with them, whenever they are stopped after their start."""

from __future__ import annotations

import importlib.util
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from drone_navigation.processes import free_domain, free_udp_port, ros_environment
from tests.support.processes import Process, patient_s

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_stop_moments")]

ENDED_S = 5.0
_WORDS = ("Traceback", "RCLError", "never retrieved", "terminate called", "did not stop within")
_INTERPRETER = ("Python runtime state: core initialized", "Failed to import the site module")
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# The one before its own handlers, the other while it works; between them each quarter of a second.
MOMENTS_S = tuple(0.25 * step for step in range(61))


def _server(folder: Path) -> list[str]:
    link = f"udpin://127.0.0.1:{free_udp_port()}"
    return ["navigation_server", "--link", link, "--tlog", str(folder / "flight.tlog")]


def _trial(_folder: Path) -> list[str]:
    return ["navigation_server", "--computer-row"]


def _nav2(_folder: Path) -> list[str]:
    return ["navigation_nav2"]


def _console(_folder: Path) -> list[str]:
    return ["navigation_console", "--no-browser", "--port", "0"]


def _target(_folder: Path) -> list[str]:
    return ["navigation_target", "--link", f"udpin://127.0.0.1:{free_udp_port()}"]


def _simulated_console(_folder: Path) -> list[str]:
    return ["simulated_console", "--no-browser", "--port", "0"]


def _demo(folder: Path) -> list[str]:
    return ["demo", "--out", str(folder)]


def _demo_nav2(folder: Path) -> list[str]:
    return ["demo_nav2", "--out", str(folder)]


PROGRAMS = (_server, _trial, _console, _target, _simulated_console, _demo, _nav2, _demo_nav2)


@pytest.fixture
def program(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Process]:
    make = request.param
    if "nav2" in make.__name__ and importlib.util.find_spec("nav2_msgs") is None:
        pytest.skip("nav2_msgs is not built here")
    name, *options = make(tmp_path)
    environment = ros_environment(free_domain(free_udp_port()))
    words = ["python", "-m", f"drone_navigation.{name}", *options]
    # A job in the background of a shell ignores interrupts, and would hand that down.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = Process(name, words, environment)
    signal.signal(signal.SIGINT, before)
    yield process
    process.stop(ENDED_S)


@pytest.mark.parametrize("moment_s", MOMENTS_S)
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda make: make.__name__[1:], indirect=True)
def test_a_program_ends_with_what_it_has_started_whenever_it_is_stopped(
    program: Process, moment_s: float
) -> None:
    threading.Event().wait(moment_s)
    number = _SIGNALS[round(4.0 * moment_s) % 2]
    started = psutil.Process(program.pid).children(recursive=True)
    program.signal(number)
    program.signal(number)  # as from a terminal and from make
    # Before its own code runs, a signal has its default action.
    assert program.wait(ENDED_S) in (0, 1, 130, -number), program.text
    until_s = time.monotonic() + patient_s(ENDED_S)
    while left := [child for child in started if child.is_running()]:
        assert time.monotonic() < until_s, f"{left} outlive it: {program.text}"
        threading.Event().wait(0.05)
    # An interrupt of the interpreter's own start, before any module, has a traceback of Python's.
    if not any(sign in program.text for sign in _INTERPRETER):
        assert not any(word in program.text for word in _WORDS), program.text
