"""`make demo-agent`: the whole script is played, and the film shows it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.support.processes import HANGS_AFTER_S

pytestmark = [pytest.mark.wide, pytest.mark.night]


def test_an_agent_is_rejected_and_then_confirmed_in_a_film(tmp_path: Path) -> None:
    played = subprocess.run(
        [sys.executable, "-m", "tests.agents.demo", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER_S,
        check=False,
    )
    assert played.returncode == 0, played.stdout + played.stderr
    lines = played.stdout.splitlines()
    order = ("> goto", "OUTSIDE_ENVELOPE", "accepted:", "> goto", "waiting for a person",
             "rehearsal:", "navigation_mcp confirm", "Type yes", "SUCCESS")  # fmt: skip
    rest = iter(lines)
    for part in order:
        assert any(part in line for line in rest), (part, lines)
    with Image.open(tmp_path / "agent.gif") as film:
        assert getattr(film, "n_frames", 1) > 60
    assert (tmp_path / "agent.mp4").stat().st_size > 50_000
