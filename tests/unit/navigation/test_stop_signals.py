"""A program that is asked to stop ends in time, with a code that says whether it hung."""

from __future__ import annotations

import signal

import pytest

from drone_navigation.process_control.stop_signals import EXIT_HUNG
from tests.support.processes import Process

SOURCE = """
import threading
from drone_navigation.process_control.stop_signals import StopSignals

signals = StopSignals("program")
print("started", flush=True)
signals.wait(60.0)
{closed}
threading.Event().wait(60.0)
"""


@pytest.mark.parametrize(
    ("closed", "code", "text"),
    [
        ("", EXIT_HUNG, "program: did not stop within 5 s and was ended."),
        ("signals.close(0)", 0, ""),
    ],
)
def test_who_has_closed_all_that_is_its_own_does_not_hang(
    closed: str, code: int, text: str
) -> None:
    process = Process("program", ["python", "-c", SOURCE.format(closed=closed)])
    try:
        process.wait_for("started", 30.0)
        process.signal(signal.SIGTERM)
        assert process.wait(30.0) == code
        assert ("did not stop" in process.text) == bool(text)
        assert text in process.text
    finally:
        process.stop()
