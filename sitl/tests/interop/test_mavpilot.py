"""mavpilot, unmodified from PyPI, flies its demonstrations with the simulated PX4 over UDP."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pytest_mavlink_sitl import simulator_process
from sitl_support.programs import environment

pytest.importorskip("mavpilot", reason="mavpilot from PyPI is not installed")

pytestmark = pytest.mark.wide

LIMIT_S = 240.0


@pytest.mark.parametrize("pattern", ["square", pytest.param("star", marks=pytest.mark.night)])
def test_a_pattern_is_flown_to_its_end(pattern: str) -> None:
    with simulator_process("--autopilot", "px4") as port:
        link = ["--connection", f"udp:127.0.0.1:{port}", "--no-viz", "--pattern", pattern]
        program = subprocess.run(
            [sys.executable, "-m", "mavpilot", *link],
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
    # It exits with 0 whatever happened, and lands by itself after a failure.
    assert "Mission complete" in program.stdout, program.stdout
    assert "ERROR" not in program.stdout, program.stdout
