"""The simulated set-ups of bridge_config/, each with the first goal of docs/getting_started.md."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from mavlink_sitl import VehicleConfig
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_file import read_parameter_file
from navigation_bridge.goals.requests import NavigateRequest, Request, TakeoffRequest
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


CONFIG = Path(__file__).resolve().parents[2] / "bridge_config"
FLEET = {"copter": "ardupilot_copter", "px4": "px4_copter", "rover": "ardupilot_rover"}
FILES = sorted((CONFIG / "simulated").glob("*.yaml"))


def flight_of(name: str, values: Mapping[str, Any]) -> SimulatedFlight:
    firmware, vehicle = name.split("_")
    system_id = values.get("target_system")
    simulated = VehicleConfig(
        autopilot=firmware, vehicle=vehicle, ready_after_s=1.0, system_id=system_id
    )
    flight = SimulatedFlight(simulated=simulated, **values).ready()
    flight.run_for(3.0)
    return flight


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_first_goal_succeeds_with_each_set_up(path: Path) -> None:
    values = yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"]
    flight = flight_of(path.stem, values)
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


@pytest.mark.parametrize(
    "path",
    [
        path
        for path in sorted(CONFIG.glob("[rs]*/*_*.yaml"))
        if path.stem.endswith(("copter", "rover"))
    ],
    ids=lambda path: f"{path.parent.name}-{path.stem}",
)
def test_what_can_stand_arrives_within_half_a_metre(path: Path) -> None:
    """A metre let a goal of 0.3 m count as arrived where it began."""
    values = yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"]
    assert make_config(values).bridge.goto.arrival_radius_m <= 0.5


@pytest.mark.parametrize("name", FLEET)
def test_a_first_goal_succeeds_with_each_vehicle_of_the_fleet(name: str) -> None:
    file = read_parameter_file(CONFIG / "fleet.yaml", "navigation_server")
    assert list(file.vehicles) == list(FLEET)
    flight = flight_of(FLEET[name], file.vehicles[name])
    height_m = 0.0 if name == "rover" else 3.0
    goal = NavigateRequest("map", (10.0, 5.0, height_m), (0.0, 0.0, 0.0, 1.0), False, 0.0)
    end = flight.run_to_end(flight.start(goal), 300.0)
    assert end.code.value == "SUCCESS", end.message
