"""LANDING_TARGET: what both firmwares do with it, as the real ones were seen to.

ArduCopter 4.7.0-dev with PLND_ENABLED 1 and PLND_TYPE 1, PX4 v1.17; both calm, from 10 m.
"""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import ACCEPTED, GUIDED, LAND, GroundStation, flying
from sitl_support.px4_station import Px4Station, flying_px4

TARGET = (3.0, 2.0)
PRECISION = {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}


def landing_target(
    station: GroundStation, place: tuple[float, float, float], frame: int, distance_m: float = 1.0
) -> None:
    station.send(
        mav.MAVLink_landing_target_message(
            0, 0, frame, 0.0, 0.0, distance_m, 0.0, 0.0, *place, [1.0, 0.0, 0.0, 0.0], 2, 1
        )
    )


def see(station: GroundStation) -> None:
    """Send where `TARGET` is, as a level companion of an ArduPilot sees it."""
    (north, east, down), yaw = station.position, station.last("ATTITUDE").yaw
    n, e = TARGET[0] - north, TARGET[1] - east
    c, s = math.cos(yaw), math.sin(yaw)
    body = (c * n + s * e, c * e - s * n, -down)
    landing_target(station, body, mav.MAV_FRAME_BODY_FRD, math.hypot(*body))


def over(target_m: tuple[float, float], station: GroundStation) -> float:
    """How far the vehicle is from a place, over ground."""
    return math.dist(target_m, station.position[:2])


def is_armed(station: GroundStation) -> bool:
    return bool(station.last("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)


def copter_over_ground(parameters: dict[str, float]) -> GroundStation:
    station = flying(10.0, parameters)
    station.interval(30, 50.0)
    station.run(1.0)
    return station


# ArduCopter.

SEEN_LATE = [(0.0, 3.6, 8.2), (2.0, 3.6, 7.2), (4.0, 1.6, 6.6), (6.0, 0.2, 5.6), (8.0, 0.3, 4.6)]
"""Seconds since the target is seen, distance from it and height, m: `ap_late`"""


def test_as_flown_by_the_real_copter_it_lands_on_a_target_seen_late() -> None:
    """Used from 2 s after it was first seen; slowly over the last two metres."""
    station = copter_over_ground(PRECISION)
    assert station.mode(LAND) == ACCEPTED
    station.run(3.9)
    begin_s = station.now_s
    for after_s, real_off_m, real_height_m in SEEN_LATE:
        station.stream(begin_s + after_s - station.now_s, 10.0, lambda: see(station))
        assert over(TARGET, station) == pytest.approx(real_off_m, abs=0.5), after_s
        assert -station.position[2] == pytest.approx(real_height_m, abs=0.5), after_s
    station.stream(21.1 - 8.0, 10.0, lambda: see(station))
    assert station.position[2] == pytest.approx(0.0, abs=0.3), "the real one touched down then"
    station.run(4.0)
    assert over(TARGET, station) < 0.1
    assert not is_armed(station)
    assert station.texts(begin_s)[:2] == ["PrecLand: Target Found", "PrecLand: Init Complete"]
    assert "PrecLand: Target Lost" in station.texts(begin_s)


def test_as_flown_by_the_real_copter_a_lost_target_ends_straight_down() -> None:
    station = copter_over_ground(PRECISION)
    station.stream(2.0, 20.0, lambda: see(station))
    assert station.mode(LAND) == ACCEPTED
    while -station.position[2] > 6.0:
        station.stream(0.2, 20.0, lambda: see(station))
    lost_s = station.now_s
    station.run(3.0)
    where = station.position[:2]
    assert "PrecLand: Target Lost" in station.texts(lost_s)
    station.run_until(lambda: not is_armed(station))
    assert 10.0 < station.now_s - lost_s < 18.0, "the real one disarmed after 14 s"
    assert math.dist(where, station.position[:2]) < 0.2


@pytest.mark.parametrize("parameters", [{}, {"PLND_ENABLED": 1.0}])
def test_without_its_parameters_a_copter_lands_where_it_is(parameters: dict[str, float]) -> None:
    station = copter_over_ground(parameters)
    station.mode(LAND)
    station.stream(12.0, 10.0, lambda: see(station))
    assert math.hypot(*station.position[:2]) < 0.3
    assert not any("PrecLand" in text for text in station.texts())


def test_a_copter_takes_no_target_in_another_frame_or_without_a_distance() -> None:
    station = copter_over_ground(PRECISION)
    landing_target(station, (3.0, 2.0, 10.0), mav.MAV_FRAME_LOCAL_NED)
    landing_target(station, (3.0, 2.0, 10.0), mav.MAV_FRAME_BODY_FRD, 0.0)
    landing_target(station, (math.nan, 2.0, 10.0), mav.MAV_FRAME_BODY_FRD, 10.0)
    station.run(1.0)
    texts = [text for text in station.texts() if "PrecLand" in text or "Plnd" in text]
    assert texts == ["Plnd: Frame not supported "]


def test_a_target_does_nothing_outside_of_land() -> None:
    station = copter_over_ground(PRECISION)
    assert station.mode(GUIDED) == ACCEPTED
    station.stream(5.0, 10.0, lambda: see(station))
    assert math.hypot(*station.position[:2]) < 0.3


# PX4.


def precland(height_m: float = 10.0) -> Px4Station:
    air = flying_px4(height_m)
    assert air.mode(px4.PRECLAND) == ACCEPTED
    return air


def see_local(air: Px4Station) -> None:
    """Send where `TARGET` is, in the local frame."""
    landing_target(air, (*TARGET, 0.0), mav.MAV_FRAME_LOCAL_NED)


@pytest.mark.night
def test_as_flown_by_the_real_px4_it_settles_over_its_target_and_lands_on_it() -> None:
    """From 3 m away, recorded: over it after 7 s, sinking from 10 s on, down after 26 s."""
    air = precland()
    begin_s = air.now_s
    air.stream(5.0, 10.0, lambda: see_local(air))
    assert over(TARGET, air) < 0.6
    assert -air.position[2] > 9.0
    air.stream(25.0, 10.0, lambda: see_local(air))
    air.run_until(lambda: not air.armed)
    assert air.now_s - begin_s < 40.0
    assert over(TARGET, air) < 0.3
    assert air.custom_mode == px4.OFFBOARD, "as before: it cannot be armed in AUTO.PRECLAND"


@pytest.mark.night
def test_a_px4_that_sees_no_target_searches_and_lands_where_it_is() -> None:
    air = precland(6.0)
    air.run(8.0)
    assert -air.position[2] > 9.0, "it climbs to PLD_SRCH_ALT"
    assert air.custom_mode == px4.PRECLAND
    air.run_until(lambda: not air.armed, 90.0)
    assert math.hypot(*air.position[:2]) < 0.6


@pytest.mark.night
def test_a_px4_that_loses_its_target_stops_and_searches() -> None:
    air = precland()
    while -air.position[2] > 5.0:
        air.stream(0.5, 10.0, lambda: see_local(air))
    air.run(15.0)
    assert -air.position[2] > 9.0
    air.stream(40.0, 10.0, lambda: see_local(air))
    assert not air.armed
    assert over(TARGET, air) < 0.3


def test_a_px4_takes_no_target_in_a_body_frame() -> None:
    air = precland()
    air.stream(5.0, 10.0, lambda: landing_target(air, (3.0, 2.0, 9.0), mav.MAV_FRAME_BODY_FRD))
    assert math.hypot(*air.position[:2]) < 0.6
