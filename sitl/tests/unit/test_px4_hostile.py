"""Hostile packets never stop the simulated PX4."""

from __future__ import annotations

import itertools
import math
import random

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.mavlink.px4 import messages
from mavlink_sitl.mavlink.px4.commands import HANDLERS
from sitl_support.ground_station import alive
from sitl_support.hostile_frames import extreme_setpoints, frames
from sitl_support.missions import upload
from sitl_support.px4_station import Px4Station, flying_px4, plan_item, ready_px4

pytestmark = pytest.mark.wide

EXTREMES = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e-45, 0.0, 1.0, -1.0, 5.0, 33.0, 1e9)
REBOOT = 246


def test_20_000_hostile_frames_in_flight() -> None:
    station = flying_px4()
    for number, frame in enumerate(itertools.islice(frames(11), 20_000)):
        station.vehicle.link.write(frame)
        if number % 50 == 0:
            station.simulation.run_for(0.03)  # too short for a landing
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
    places = (-(2**31), 2**31 - 1, 0, 473977430)
    for message in extreme_setpoints(EXTREMES, (0, 1, 5, 6, 8, 9, 11), places):
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


KINDS = ["rover", "boat", "plane"]


def under_way(kind: str) -> Px4Station:
    """A rover or a boat that drives, a plane that climbs; quiet."""
    station = ready_px4(vehicle=kind).quiet()
    assert station.command(22, 0, 0, 0, *[math.nan] * 4) == 0
    assert station.arm() == 0
    station.run(14.0 if kind == "plane" else 1.0)
    station.stream_to(1.0, 200.0, 50.0, -40.0)
    assert station.mode(px4.OFFBOARD) == 0
    station.stream_to(1.0, 200.0, 50.0, -40.0)
    return station


def sane(station: Px4Station) -> None:
    """It is where a vehicle can be, and every message of it can be made."""
    assert math.hypot(*station.velocity) < 80.0
    assert all(math.isfinite(x) for x in (*station.position, *station.velocity))
    snapshot = station.vehicle.snapshot()
    for build in messages.BUILDERS[station.vehicle.firmware.personality.kind].values():
        build(snapshot)


@pytest.mark.parametrize("kind", KINDS)
def test_absurd_parameters_do_not_stop_other_kinds(kind: str) -> None:
    station = under_way(kind)
    parameters = station.vehicle.parameters
    for name in parameters.table.acting:
        if name.startswith(("SIM_", "COM_OBL", "COM_LOW", "BAT", "GF_")):
            continue  # they end the way, rightly
        before = parameters[name]
        for value in (0.0, -1.0, 1e-40, 1e9, -1e9, 3.4e38, -3.4e38):
            parameters.set(name, value)
            station.go_to(300.0, 50.0, -40.0)
            station.run(0.15, step_s=0.15)
            sane(station)
        parameters.set(name, before)
    for number in (px4.LOITER, px4.RTL, px4.MISSION, px4.LAND, px4.TAKEOFF):
        station.mode(number)
        station.run(1.0)
        sane(station)
    alive(station)


@pytest.mark.parametrize("kind", KINDS)
def test_absurd_setpoints_commands_and_missions_do_not_stop_other_kinds(kind: str) -> None:
    station = under_way(kind)
    rng = random.Random(5)
    for number in range(600):
        values = [rng.choice(EXTREMES) for _ in range(11)]
        mask = rng.choice([0x9F8, 0xDC7, 0xDC0, 0xC3F, 0x000, rng.randrange(0x1000)])
        station.send(
            mav.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, rng.choice([1, 8]), mask, *values
            )
        )
        x, y = (rng.choice([-(2**31), 2**31 - 1, 0, 473977430]) for _ in range(2))
        command = rng.choice([20, 21, 22, 176, 178, 192, 193, 300])
        message = mav.MAVLink_command_int_message(
            1, 1, 6, command, 0, 0, *values[:4], x, y, values[6]
        )
        if number % 4 == 0:
            station.send(message)
        station.run(0.1, step_s=0.1)
        sane(station)
    for number in range(12):
        command = rng.choice([16, 17, 18, 19, 21, 22, 31, 93])
        params = [rng.choice(EXTREMES) for _ in range(4)]
        up_m = rng.choice([0.0, 50.0, -1e6, 1e6])
        item = plan_item(command, rng.choice([0.0, 300.0]), 100.0 * number, up_m, *params)
        upload(station, [item, plan_item(16, 0.0, 0.0, 50.0)])
        station.mode(px4.MISSION)
        station.run(1.5, step_s=0.1)
        sane(station)
    alive(station)
