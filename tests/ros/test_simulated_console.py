"""`make console` as a person sees it: what it does while it starts, and its end by Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from drone_navigation.processes import free_domain, free_udp_port, ros_environment
from tests.support.processes import HANGS_AFTER_S
from tests.support.ros.ros_flight import READY_TIMEOUT_S
from tests.support.ros.terminal import Terminal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("console")]
COMMAND = ["-m", "drone_navigation.simulated_console", "--no-browser", "--port", "0"]
CTRL_C = "\x03"


def test_the_start_is_told_and_ctrl_c_is_a_clean_end() -> None:
    """The terminal tells all of its foreground, and the program tells what it has started."""
    shown = Terminal(COMMAND, ros_environment(free_domain(free_udp_port())))
    shown.wait_for("Starting a simulated vehicle and a navigation server", 30.0)
    shown.wait_for("Ready after ", READY_TIMEOUT_S)
    shown.wait_for("The console is at ", READY_TIMEOUT_S)
    shown.type(CTRL_C)
    assert shown.wait(30.0) == 0, shown.text
    assert "Traceback" not in shown.text


@pytest.mark.parametrize("moment", ["Starting a simulated vehicle", "Ready after "])
def test_ctrl_c_while_it_starts_is_a_clean_end_as_well(moment: str) -> None:
    shown = Terminal(COMMAND, ros_environment(free_domain(free_udp_port())))
    shown.wait_for(moment, READY_TIMEOUT_S)
    shown.type(CTRL_C)
    assert shown.wait(30.0) == 0, shown.text
    assert "Traceback" not in shown.text


def test_an_interrupt_that_is_held_back_while_python_starts_ends_a_program() -> None:
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        child = subprocess.Popen(
            [sys.executable, "-m", "drone_navigation.navigation_console", "--help"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        child.send_signal(signal.SIGINT)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    output, _ = child.communicate(timeout=HANGS_AFTER_S)
    assert (child.returncode, output) == (-signal.SIGINT, b"")
