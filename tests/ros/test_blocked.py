"""A goal without a way to it: what the client and the server's log say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.ros.ros_flight import Flight

pytestmark = pytest.mark.wide


WALLS = """
obstacles:
  - {kind: wall, from_m: [-3, -3], to_m: [3, -3], height_m: 900}
  - {kind: wall, from_m: [3, -3], to_m: [3, 3], height_m: 900}
  - {kind: wall, from_m: [3, 3], to_m: [-3, 3], height_m: 900}
  - {kind: wall, from_m: [-3, 3], to_m: [-3, -3], height_m: 900}
"""


def test_blocked_comes_with_its_reason_and_ends_in_time(tmp_path: Path) -> None:
    known = tmp_path / "walls.yaml"
    known.write_text(WALLS, encoding="utf-8")
    parameters = {"obstacles_file": f"'{known}'", "blocked_timeout_s": "3.0"}
    given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
    walled_in = Flight(tmp_path, "--ros-args", *given, "--")
    try:
        command = ["python", "-m", "drone_navigation.navigation_client"]
        goal = ["--goal", "10", "0", "2", "--avoid"]
        shown = Process("client", [*command, *goal], walled_in.environment)
        assert shown.wait(30.0) == 1, shown.text
        assert walled_in.server is not None
        assert re.search(r"^BLOCKED: \w", shown.text, re.MULTILINE), shown.text
        assert "NO_PATH: " in shown.text
        assert re.search(r" BLOCKED: \w", walled_in.server.text)
    finally:
        walled_in.close()
