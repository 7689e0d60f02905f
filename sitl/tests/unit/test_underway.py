"""A vehicle that begins in the air or on its way, and time in longer steps."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl.command_line.options import parse
from mavlink_sitl.config import ConfigurationError, Underway, VehicleConfig
from mavlink_sitl.simulation import Simulation
from mavlink_sitl.world.model import Obstacle, RangeSensor, World

IN_AIR = Underway((30.0, -20.0, -12.0), (3.0, 0.0, 0.0))
KINDS = [("copter", "ardupilot", "GUIDED"), ("copter", "px4", "AUTO.LOITER")]


def made(config: VehicleConfig, tick_s: float = 0.01) -> Simulation:
    return Simulation([config], tick_s=tick_s)


@pytest.mark.parametrize(("vehicle", "autopilot", "mode"), KINDS)
@pytest.mark.parametrize("tick_s", [0.01, 0.05])
def test_a_copter_begins_in_the_air_and_stays_there(
    vehicle: str, autopilot: str, mode: str, tick_s: float
) -> None:
    simulation = made(VehicleConfig(vehicle, autopilot, ready_after_s=0.0, underway=IN_AIR), tick_s)
    simulation.run_for(0.1)
    copter = simulation.vehicles[0].firmware
    assert copter.armed
    assert not copter.landed
    assert copter.mode.spec.name == mode
    assert simulation.truth.position_ned_m[0] == pytest.approx((30.0, -20.0, -12.0), abs=0.5)
    assert simulation.truth.velocity_ned_m_s[0, 0] == pytest.approx(3.0, abs=0.6)
    simulation.run_for(15.0)
    assert copter.armed
    assert simulation.truth.position_ned_m[0, 2] == pytest.approx(-12.0, abs=0.5)
    assert math.hypot(*simulation.truth.velocity_ned_m_s[0]) < 0.2


@pytest.mark.parametrize("vehicle", ["rover", "boat"])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_drives_begins_on_its_way(vehicle: str, autopilot: str) -> None:
    start = Underway((30.0, -20.0, 0.0), (1.0, 0.0, 0.0))
    config = VehicleConfig(vehicle, autopilot, ready_after_s=0.0, heading_deg=0.0, underway=start)
    simulation = made(config)
    simulation.run_for(0.1)
    assert simulation.vehicles[0].firmware.armed
    assert simulation.truth.position_ned_m[0] == pytest.approx((30.0, -20.0, 0.0), abs=0.3)
    assert simulation.truth.velocity_ned_m_s[0, 0] > 0.5


def test_of_two_only_one_is_moved() -> None:
    simulation = Simulation(
        [VehicleConfig(ready_after_s=0.0, underway=IN_AIR), VehicleConfig(ready_after_s=0.0)]
    )
    simulation.run_for(5.0)
    assert simulation.truth.position_ned_m[0, 2] == pytest.approx(-12.0, abs=0.5)
    assert simulation.truth.position_ned_m[1] == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert list(simulation.truth.on_ground) == [False, True]


def test_it_may_also_stand_elsewhere() -> None:
    stands = Underway((5.0, 6.0, 0.0), (3.0, 0.0, 0.0), moves=False)
    simulation = made(VehicleConfig(ready_after_s=0.0, underway=stands))
    simulation.run_for(5.0)
    assert not simulation.vehicles[0].firmware.armed
    assert simulation.truth.position_ned_m[0] == pytest.approx((5.0, 6.0, 0.0), abs=0.01)


def test_it_is_an_option_of_the_program() -> None:
    _, config = parse(["--underway", "30,-20,12"])
    assert config.underway == Underway((30.0, -20.0, -12.0))


def test_planes_and_broken_numbers_are_rejected() -> None:
    with pytest.raises(ConfigurationError, match="plane"):
        VehicleConfig("plane", underway=IN_AIR)
    with pytest.raises(ConfigurationError, match="numbers"):
        VehicleConfig(underway=Underway((math.nan, 0.0, 0.0)))


@pytest.mark.parametrize("tick_s", [0.0, -0.01, 0.03, 0.1])
def test_a_tick_that_does_not_fit_is_rejected(tick_s: float) -> None:
    with pytest.raises(ConfigurationError, match=r"0\.05"):
        made(VehicleConfig(), tick_s)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_streams_are_silenced_but_the_heartbeat(autopilot: str) -> None:
    simulation = made(VehicleConfig(autopilot=autopilot))
    simulation.run_for(4.0)
    simulation.vehicles[0].silence_streams()
    simulation.run_for(1.0)
    simulation.link.read()
    simulation.run_for(3.0)
    kinds = {int.from_bytes(frame[7:10], "little") for frame in simulation.link.read_datagrams()}
    assert 0 in kinds
    assert not kinds & {30, 32, 33, 24, 147}
    assert (42 in kinds) is (autopilot == "px4")  # nobody can stop it there


def test_a_companion_scanner_is_not_silenced_with_the_streams_of_an_ardupilot() -> None:
    world = World(obstacles=(Obstacle("post", (8.0, 0.0), 1.0),), range_sensor=RangeSensor())
    simulation = Simulation([VehicleConfig()], world=world)
    simulation.run_for(4.0)
    simulation.vehicles[0].silence_streams()
    simulation.run_for(1.0)
    simulation.link.read()
    simulation.run_for(3.0)
    kinds = [int.from_bytes(frame[7:10], "little") for frame in simulation.link.read_datagrams()]
    assert kinds.count(330) >= 20
    assert 132 not in kinds
