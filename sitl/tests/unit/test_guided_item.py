"""NAV_GUIDED_ENABLE: a companion has the vehicle for a part of its mission."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    POSITION,
    VELOCITY,
    GroundStation,
    flying,
)
from sitl_support.kinds import kind
from sitl_support.missions import Message, home, item, upload, waypoint

ROVER_AUTO = 10
NOTHING = (0.0, 0.0, 0.0, 0.0)


def limits(*params: float) -> Message:
    return item(mav.MAV_CMD_DO_GUIDED_LIMITS, params=params, anywhere=True)


def obeying(bounds: tuple[float, ...], enabled: float = 1.0) -> GroundStation:
    """At 10 m in AUTO, at the item that lets a companion have it."""
    station = flying(10.0)
    guided = item(mav.MAV_CMD_NAV_GUIDED_ENABLE, params=(enabled,), anywhere=True)
    mission = [home(), waypoint(3, 0, 10), limits(*bounds), guided, waypoint(0, 8, 10)]
    assert upload(station, mission) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run_until(lambda: station.vehicle.plans.current >= 3, 30.0)
    return station


def test_it_flies_to_a_companions_setpoint_and_stays_at_the_item() -> None:
    station = obeying(NOTHING)
    station.setpoint(POSITION, (15.0, 0.0, -12.0))
    station.run(12.0)
    assert math.dist(station.position, (15.0, 0.0, -12.0)) < 0.7
    assert station.vehicle.plans.current == 3
    assert station.last("HEARTBEAT").custom_mode == AUTO


@pytest.mark.parametrize(
    "bounds",
    [(4.0, 0, 0, 0), (0, 8.0, 0, 0), (0, 0, 14.0, 0), (0, 0, 0, 5.0)],
    ids=["time", "too low", "too high", "too far"],
)
def test_the_mission_continues_at_a_limit(bounds: tuple[float, ...]) -> None:
    station = obeying(bounds)
    low, high = bounds[1] > 0.0, bounds[2] > 0.0
    velocity = (1.0, 0.0, 1.0 if low else -1.0 if high else 0.0)
    for _ in range(14):
        station.setpoint(VELOCITY, velocity=velocity)
        station.run(0.5)
    assert station.vehicle.plans.current == 4
    station.run_until(lambda: math.dist(station.position, (0.0, 8.0, -10.0)) < 1.0, 30.0)


def test_setpoints_count_only_at_such_an_item() -> None:
    station = obeying(NOTHING, enabled=0.0)
    station.run(0.2)
    assert station.vehicle.plans.current == 4, "0 ends it at once"
    station.setpoint(POSITION, (50.0, 0.0, -12.0))
    station.run(12.0)
    assert math.dist(station.position, (0.0, 8.0, -10.0)) < 1.0


@pytest.mark.parametrize("bounds", [(6.0, 0, 0, 0), (0, 0, 0, 4.0)], ids=["time", "too far"])
def test_a_rover_obeys_until_a_limit_too(bounds: tuple[float, ...]) -> None:
    station = kind("rover")
    guided = item(mav.MAV_CMD_NAV_GUIDED_ENABLE, params=(1.0,), anywhere=True)
    assert upload(station, [home(), limits(*bounds), guided, waypoint(0, 8)]) == 0
    assert station.mode(ROVER_AUTO) == ACCEPTED
    assert station.arm() == ACCEPTED
    station.run(1.5)
    assert station.vehicle.plans.current == 2
    for _ in range(12):
        station.setpoint(VELOCITY, velocity=(1.5, 0.0, 0.0))
        station.run(0.5)
    assert station.position[0] > 2.0
    station.run_until(lambda: station.vehicle.plans.current == 3, 5.0)
    station.run_until(lambda: math.dist(station.position[:2], (0.0, 8.0)) < 2.0, 30.0)
