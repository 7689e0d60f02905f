"""Manoeuvres as data: what is asked, and within which bounds it must end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from sitl_support.ground_station import POSITION, GroundStation, copter, flying

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Leg:
    """A flight from 10 m above home to a target, one position setpoint.

    Attributes:
        target_ned_m: where to.
        speed_m_s: WPNAV_SPEED.
        seconds: by when it must be within 0.5 m and slower than 0.3 m/s.
        overshoot_m: how far beyond the target it may get.
        fastest_m_s: no faster than this over ground.
    """

    target_ned_m: Vector
    speed_m_s: float
    seconds: float
    overshoot_m: float
    fastest_m_s: float

    def __str__(self) -> str:
        return f"{self.target_ned_m} at {self.speed_m_s:g} m/s"


LEGS = [
    Leg((2.0, 0.0, -10.0), 10.0, 6.0, 0.3, 1.6),
    Leg((20.0, 0.0, -10.0), 10.0, 11.0, 0.7, 6.0),
    Leg((-14.0, 14.0, -10.0), 10.0, 11.0, 0.7, 6.0),
    Leg((20.0, 0.0, -10.0), 2.0, 16.0, 0.4, 2.1),
    Leg((60.0, 0.0, -10.0), 5.0, 21.0, 0.7, 5.25),
    Leg((150.0, 0.0, -10.0), 10.0, 33.0, 0.9, 10.4),
    Leg((0.0, 0.0, -30.0), 10.0, 17.0, 0.5, 0.3),
    Leg((0.0, 0.0, -3.0), 10.0, 10.0, 0.5, 0.3),
    Leg((15.0, 0.0, -20.0), 10.0, 13.0, 0.7, 6.0),
]


@pytest.mark.parametrize("leg", LEGS, ids=str)
def test_leg(leg: Leg) -> None:
    station = flying(10.0, {"WPNAV_SPEED": leg.speed_m_s * 100.0})
    start = station.position
    station.setpoint(POSITION, leg.target_ned_m)
    begin_s = station.now_s
    way = math.dist(start, leg.target_ned_m)
    settled_s = math.inf
    beyond = fastest = 0.0
    while station.now_s - begin_s < leg.seconds + 5.0:
        station.run(0.05)
        fastest = max(fastest, math.hypot(*station.velocity[:2]))
        beyond = max(beyond, math.dist(station.position, start) - way)
        near = math.dist(station.position, leg.target_ned_m) < 0.5
        if not near or math.hypot(*station.velocity) > 0.3:
            settled_s = math.inf
        elif settled_s == math.inf:
            settled_s = station.now_s - begin_s
    assert settled_s <= leg.seconds
    assert beyond <= leg.overshoot_m
    assert fastest <= leg.fastest_m_s


@pytest.mark.parametrize("height_m", [1.5, 3.0, 10.0, 40.0])
def test_take_off(height_m: float) -> None:
    station = copter().ready()
    begin_s = station.now_s
    station.take_off(height_m)
    assert -station.position[2] == pytest.approx(height_m, abs=0.3)
    assert station.now_s - begin_s < 8.0 + height_m / 2.0
    station.run(5.0)
    assert -station.position[2] == pytest.approx(height_m, abs=0.15)


def test_a_square_is_flown_without_losing_height() -> None:
    station = flying(10.0)
    lowest = highest = 10.0
    for corner in ((15.0, 0.0), (15.0, 15.0), (0.0, 15.0), (0.0, 0.0)):
        station.setpoint(POSITION, (*corner, -10.0))
        for _ in range(100):
            station.run(0.1)
            lowest = min(lowest, -station.position[2])
            highest = max(highest, -station.position[2])
        assert math.dist(station.position[:2], corner) < 0.4
    assert lowest > 9.6
    assert highest < 10.4


def test_hover_stays_where_it_is_for_a_minute() -> None:
    station = flying(10.0)
    worst = 0.0
    for _ in range(600):
        station.run(0.1)
        worst = max(worst, math.dist(station.position, (0.0, 0.0, -10.0)))
    assert worst < 0.25


def test_a_velocity_beyond_reach_ends_soon_after_the_order() -> None:
    """The desired motion does not run ahead of a vehicle that cannot follow."""
    station: GroundStation = flying(30.0)
    station.stream(20.0, 5.0, lambda: station.setpoint(0xDC7, velocity=(50.0, 0.0, 0.0)))
    assert 9.0 < station.velocity[0] < 15.0
    station.setpoint(0xDC7, velocity=(0.0, 0.0, 0.0))
    begin = station.position[0]
    station.run(25.0)
    assert math.hypot(*station.velocity) < 0.3
    assert station.position[0] - begin < 60.0
