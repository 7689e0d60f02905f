"""Hostile packets never stop the simulated PX4."""

from __future__ import annotations

import itertools
import math
import random

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.mavlink.px4.commands import HANDLERS
from tests.support.hostile_frames import frames
from tests.support.px4_station import Px4Station, flying_px4, ready_px4

EXTREMES = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e-45, 0.0, 1.0, -1.0, 5.0, 33.0, 1e9)
REBOOT = 246


def alive(station: Px4Station) -> None:
    """It still thinks, flies and answers."""
    station.vehicle.link.read()
    station.log.clear()
    station.run(1.5)
    assert station.messages("HEARTBEAT")
    assert all(math.isfinite(x) for x in (*station.position, *station.velocity))
    assert station.command(31999) == 3


def test_20_000_hostile_frames_in_flight() -> None:
    station = flying_px4()
    for number, frame in enumerate(itertools.islice(frames(11), 20_000)):
        station.vehicle.link.write(frame)
        if number % 50 == 0:
            station.simulation.run_for(0.03)  # not so long that it lands
            station.vehicle.link.read()
    alive(station)


@pytest.mark.parametrize("command", sorted(set(HANDLERS) - {REBOOT}))
def test_every_known_command_with_extreme_parameters(command: int) -> None:
    station = ready_px4()
    station.arm()
    rng = random.Random(command)
    for _ in range(60):
        values = [rng.choice(EXTREMES) for _ in range(7)]
        message = mav.MAVLink_command_long_message(1, 1, command, 0, *values)
        if rng.random() < 0.5:
            x, y = (rng.choice([-(2**31), 2**31 - 1, 0, 473977430]) for _ in range(2))
            message = mav.MAVLink_command_int_message(
                1, 1, rng.choice([0, 3, 6, 255]), command, 0, 0, *values[:4], x, y, values[6]
            )
        answers = [m.get_type() for m in station.send(message)]
        assert answers.count("COMMAND_ACK") <= (2 if command == 176 else 1)
        station.simulation.run_for(0.05)
    alive(station)


def test_setpoints_with_extreme_fields_in_every_frame_and_mask() -> None:
    station = flying_px4()
    rng = random.Random(3)
    for number in range(3000):
        values = [rng.choice(EXTREMES) for _ in range(11)]
        frame, mask = rng.choice([0, 1, 5, 6, 8, 9, 11]), rng.randrange(0x1000)
        message = mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *values)
        if number % 2:
            x, y = (rng.choice([-(2**31), 2**31 - 1, 0, 473977430]) for _ in range(2))
            message = mav.MAVLink_set_position_target_global_int_message(
                0, 1, 1, frame, mask, x, y, *values[2:]
            )
        station.vehicle.link.write(station.pack(message))
        station.simulation.run_for(0.02)
        station.vehicle.link.read()
    alive(station)


@pytest.mark.parametrize("value", [0.0, -1e9, 3.4e38, 1e-40])
def test_absurd_parameters_do_not_stop_a_flight(value: float) -> None:
    station = flying_px4()
    for name, spec in station.vehicle.parameters.specs.items():
        if spec.type == 9:
            station.set_parameter(name, value)
    station.stream_to(1.0, 20.0, 0.0, -12.0)
    for number in (px4.LOITER, px4.RTL, px4.LAND, px4.TAKEOFF):
        station.mode(number)
        station.run(1.5)
    alive(station)
