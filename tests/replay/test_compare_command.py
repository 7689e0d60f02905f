"""`python -m comparison` on recordings that it does not compare."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.logs.recordings import ROOT, recording
from tests.support.processes import HANGS_AFTER_S

TESTS = ROOT / "sitl/tests"
pytestmark = pytest.mark.wide


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("px4/offboard_10m_20n_gt_truth", "no ground station sends to the vehicle"),
        ("real/sub_small", "submarine with ardupilot is not supported"),
        ("real/copter_2018-09-17", "a pilot flew it by radio"),
    ],
)
def test_recordings_that_are_not_compared_say_why(name: str, reason: str) -> None:
    command = [sys.executable, "-m", "comparison", str(recording(name))]
    done = subprocess.run(
        command, cwd=TESTS, capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False
    )
    assert done.returncode == 2
    assert reason in done.stderr
