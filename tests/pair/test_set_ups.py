"""The simulated set-ups of bridge_config/, each with the first goal of docs/getting_started.md."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from drone_navigation.requests import NavigateRequest, Request, TakeoffRequest
from mavlink_sitl import VehicleConfig
from tests.support.simulated_flight import SimulatedFlight

FILES = sorted((Path(__file__).resolve().parents[2] / "bridge_config/simulated").glob("*.yaml"))


def flight_of(path: Path) -> SimulatedFlight:
    firmware, vehicle = path.stem.split("_")
    values = yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"]
    simulated = VehicleConfig(autopilot=firmware, vehicle=vehicle, ready_after_s=1.0)
    return SimulatedFlight(simulated=simulated, **values).ready()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_first_goal_succeeds_with_each_set_up(path: Path) -> None:
    flight = flight_of(path)
    flight.run_for(3.0)
    goals: list[Request] = []
    ahead_m = 5.0
    if path.stem.endswith(("copter", "plane")):
        goals.append(TakeoffRequest(0.0))
    if path.stem.endswith("plane"):
        ahead_m = 300.0
    goals.append(
        NavigateRequest("base_link", (ahead_m, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), False, 0.0)
    )
    for goal in goals:
        end = flight.run_to_end(flight.start(goal), 300.0)
        assert end.code.value == "SUCCESS", end.message
