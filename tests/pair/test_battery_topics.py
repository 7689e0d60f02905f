"""The topics of a vehicle with several batteries, as a bag has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from drone_navigation.tlog2mcap import convert
from mavlink_sitl import FurtherBattery
from tests.support.flights.recorded_flight import Recorder
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.logs.bags import read_bag

SERVER = "/navigation_server"


def test_each_of_several_batteries_has_its_topic(tmp_path: Path) -> None:
    flight = SimulatedFlight()
    recorder = Recorder(flight, tmp_path / "flown.tlog")
    flight.ready()
    flight.run_for(3.0)
    flight.simulation.vehicles[0].set_further_battery(FurtherBattery(1, 4, 3))
    flight.run_for(10.0)
    recorder.close()
    convert(tmp_path / "flown.tlog", tmp_path / "flown.mcap")
    topics = read_bag(tmp_path / "flown.mcap").topics
    shares = {
        name: [message.percentage for _, message in topics[f"{SERVER}/{name}"].messages]
        for name in ("battery", "battery_0", "battery_1")
    }
    assert any(share > 0.9 for share in shares["battery"])
    assert shares["battery"][-1] == pytest.approx(0.04)
    assert min(shares["battery_0"]) > 0.9
    assert max(shares["battery_1"]) == pytest.approx(0.04)
    assert len(shares["battery_0"]) > 5 < len(shares["battery_1"])
