"""The worlds of the demos can be lived in."""

from __future__ import annotations

from pathlib import Path

import pytest

from mavlink_sitl import Simulation, VehicleConfig, load_world

WORLDS = sorted((Path(__file__).parents[3] / "bridge_config/worlds").glob("*.yaml"))


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.stem)
def test_a_vehicle_stands_in_it_unharmed(path: Path) -> None:
    simulation = Simulation([VehicleConfig()], world=load_world(path))
    simulation.run_for(3.0)
    assert simulation.truth.on_ground.all()
    assert not simulation.truth.collided.any()
