"""A server that is traced: its objects are frozen, and its turns are summed up at the end."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.processes import patient_s
from tests.support.ros.ros_flight import Flight, navigate_goal

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_actions")]


def test_a_traced_server_sums_up_its_turns_and_has_frozen_what_stays(tmp_path: Path) -> None:
    flight = Flight(tmp_path, "--trace-lateness")
    try:
        assert flight.server is not None
        goal = navigate_goal(20.0, 0.0, 3.0)
        goal.avoid_obstacles = True
        # Its path is searched for after all is loaded and frozen.
        flight.wait_for_status(flight.send(goal), "NAVIGATING")
        flight.server.stop(patient_s(5.0))
        found = re.search(
            r"(\d+) turns, \d+ above 20 ms, the longest of [\d.]+ ms; (\d+) objects frozen",
            flight.server.text,
        )
        assert found, flight.server.text
        assert int(found[1]) > 10
        assert int(found[2]) > 50_000
    finally:
        flight.close()
