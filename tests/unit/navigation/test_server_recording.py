"""The recording of a server, as its parameters choose it."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from drone_navigation.check.command import look
from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.fleet import FleetApplication, Member
from navigation_bridge.network import open_network

FRAME = Codec(1, 1).encode(make("ATTITUDE", roll=1.0))


@pytest.mark.parametrize("file_mb", [0, 1])
def test_the_size_of_a_file_chooses_numbered_ones(tmp_path: Path, file_mb: int) -> None:
    path, said = tmp_path / "flight.tlog", list[str]()
    values = {"link_url": "udpin://127.0.0.1:0", "record_tlog": str(path)}
    config = make_config({**values, "record_tlog_file_mb": file_mb})
    network = open_network(config, [config], said.append)
    assert network.recorder is not None
    network.recorder.write(FRAME)
    clock = MonotonicClock()
    bridge = Bridge(Vehicle(config.vehicle), config.bridge)
    network.drive(FleetApplication([Member("", 0, bridge)], clock), clock).stop()
    expected = tmp_path / "flight-000001.tlog" if file_mb else path
    assert list(TlogReader(expected))
    assert (f"Recording to {expected}" in said) is bool(file_mb)


@pytest.mark.parametrize("file_mb", [0, 1])
def test_a_check_leaves_the_recording_as_it_is(tmp_path: Path, file_mb: int) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(b"the flight before")
    values = {"link_url": "udpin://127.0.0.1:0", "record_tlog": str(path)}
    config = make_config({**values, "record_tlog_file_mb": file_mb})
    reports = look({"": config}, 0.0, Console(stderr=True))
    assert reports[""].is_silent
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"the flight before"
