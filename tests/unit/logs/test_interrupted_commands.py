"""The commands that read recordings end on Ctrl-C with a sentence, and leave nothing half made."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from threading import Thread

import pytest

from tests.support.processes import HANGS_AFTER_S

pytestmark = pytest.mark.wide

_FLIGHT = Path(__file__).resolve().parents[2] / "data/copter_lowbatt.tlog"


def interrupt(process: subprocess.Popen[str]) -> str:
    """Send SIGINT and return what the process printed, after it ended."""
    try:
        process.send_signal(signal.SIGINT)
        return process.communicate(timeout=HANGS_AFTER_S)[0]
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize(
    ("command", "arguments"),
    [
        ("flight_reports.flight_plot", []),
        ("flight_reports.flight_video", []),
        ("flight_reports.navigation_report", []),
        ("flight_logs.export_command", ["--to", "exported"]),
    ],
)
def test_while_the_log_is_read(tmp_path: Path, command: str, arguments: list[str]) -> None:
    log = tmp_path / "flight.tlog"
    os.mkfifo(log)  # which keeps the command reading for as long as the test needs
    process = subprocess.Popen(
        [sys.executable, "-m", command, str(log), *arguments],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    # It opens at once with the command, which then reads.
    opening = Thread(target=lambda: opened.append(os.open(log, os.O_WRONLY)), daemon=True)
    opened: list[int] = []
    opening.start()
    opening.join(HANGS_AFTER_S)
    text = interrupt(process)
    assert opened, text
    os.close(opened[0])
    assert text.startswith("Interrupted; "), text
    assert "Traceback" not in text
    assert process.returncode == 1
    assert list(tmp_path.rglob("*.*")) == [log]


def test_while_the_film_is_drawn(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "flight_reports.flight_video", str(_FLIGHT), "-o", str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    first = process.stdout.readline()  # its progress
    text = interrupt(process)
    assert first.startswith("picture "), first + text
    assert "Traceback" not in text
    assert "were not written" in text
    assert process.returncode == 1
    assert list(tmp_path.iterdir()) == []
