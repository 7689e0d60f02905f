"""ArduRover's own simulator was driven with the same script; this is what it did.

ArduPilot 4.7.0-dev, its standard parameters. Numbers are its LOCAL_POSITION_NED.
"""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import ACCEPTED, GroundStation
from sitl_support.kinds import rover
from sitl_support.missions import home, upload, waypoint

ROVER_AUTO = 10

SPED_UP = [(1.7, 0.34), (2.7, 1.36), (3.7, 3.31), (4.7, 6.22), (5.7, 10.1), (6.7, 14.97)]
"""Seconds after AUTO was chosen, and metres along the leg, nose to its end"""
SLOWED_DOWN = [(1.24, 4.0), (2.24, 2.71), (3.24, 1.61), (4.24, 1.06), (5.74, 1.47), (7.74, 1.52)]
"""Seconds after DO_CHANGE_SPEED to 1.5 m/s, and speed in m/s: 5 m/s before"""


def in_auto(north_m: float) -> GroundStation:
    station = rover()
    station.run(3.0)
    assert upload(station, [home(), waypoint(north_m, 0), waypoint(north_m, 60)]) == 0
    assert station.mode(ROVER_AUTO) == ACCEPTED
    return station


def test_a_leg_waits_for_the_rover_to_speed_up() -> None:
    station = in_auto(150.0)
    begin_s, north_m = station.now_s, station.position[0]
    for after_s, real_m in SPED_UP:
        station.run(begin_s + after_s - station.now_s)
        assert station.position[0] - north_m == pytest.approx(real_m, abs=1.8), after_s


def test_a_leg_waits_for_the_rover_to_turn_round() -> None:
    """153 degrees, until it drove 2.4 m ahead after 5.6 s; 10.4 m were driven without waiting."""
    station = in_auto(-150.0)
    begin_s, north_m = station.now_s, station.position[0]
    station.run(begin_s + 5.6 - station.now_s)
    assert north_m - station.position[0] < 5.0
    station.run(6.0)
    assert north_m - station.position[0] > 15.0


def test_another_speed_is_braked_to_along_the_leg() -> None:
    station = in_auto(400.0)
    station.run(14.0)
    assert station.velocity[0] == pytest.approx(4.95, abs=0.1)
    begin_s = station.now_s
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 1.5, -1) == ACCEPTED
    for after_s, real_m_s in SLOWED_DOWN:
        station.run(begin_s + after_s - station.now_s)
        assert station.velocity[0] == pytest.approx(real_m_s, abs=0.75), after_s
