"""Hostile frames into vehicles that fly; the whole million is in `make bench`."""

from __future__ import annotations

import itertools
import math

import pytest

from mavlink_sitl import Simulation, VehicleConfig
from tests.support.ground_station import GroundStation, flying
from tests.support.hostile_frames import frames

COUNT = 60_000


def alive(station: GroundStation) -> None:
    """It still moves, thinks and answers."""
    station.vehicle.link.silent = station.vehicle.link.mute = False
    station.vehicle.link.set_faults(None)
    station.vehicle.link.read()
    station.log.clear()
    station.run(6.0)
    assert station.messages("HEARTBEAT")
    assert all(math.isfinite(x) for x in (*station.position, *station.velocity))
    assert station.command(31999) == 3


def feed(station: GroundStation, seed: int, count: int) -> None:
    """Frames at 20,000 a simulated second."""
    for number, frame in enumerate(itertools.islice(frames(seed), count)):
        station.vehicle.link.write(frame)
        if number % 200 == 0:
            station.simulation.run_for(0.01)
            station.vehicle.link.read()


def test_hostile_frames_do_not_stop_a_flying_copter() -> None:
    station = flying(20.0)
    feed(station, 1, COUNT)
    alive(station)


@pytest.mark.parametrize(
    ("vehicle", "autopilot"),
    [("copter", "px4"), ("rover", "ardupilot"), ("boat", "ardupilot"), ("plane", "px4")],
)
def test_nor_the_others(vehicle: str, autopilot: str) -> None:
    config = VehicleConfig(vehicle=vehicle, autopilot=autopilot, ready_after_s=1.0)
    station = GroundStation(Simulation([config], seed=1))
    station.run(4.0)
    station.command(400, 1, 21196)
    feed(station, 2, COUNT // 6)
    alive(station)
