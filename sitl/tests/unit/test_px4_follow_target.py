"""AUTO.FOLLOW_TARGET of the simulated PX4, after the firmware's source."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import ACCEPTED, TEMPORARILY_REJECTED
from sitl_support.px4_station import HOME, NAN, Px4Station, at, flying_px4, ready_px4

Place = tuple[float, float]


@pytest.fixture
def air() -> Px4Station:
    """10 m above home; the target has not been heard."""
    station = flying_px4().quiet()
    assert station.mode(px4.LOITER) == ACCEPTED
    return station


def target(
    station: Px4Station, place: Place, velocity: tuple[float, float, float], up_m: float = 0.0
) -> None:
    x, y = at(*place)
    message = mav.MAVLink_follow_target_message(
        0, 3, x, y, HOME.altitude_amsl_m + up_m,
        velocity, [0.0] * 3, [1.0, 0.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3, 0,
    )  # fmt: skip
    station.send(message)


def walk(station: Px4Station, seconds: float, at_s: Callable[[float], tuple[Place, Place]]) -> None:
    """Send where the target is and how fast, four times a second."""
    begin_s = station.now_s

    def send() -> None:
        place, velocity = at_s(station.now_s - begin_s)
        target(station, place, (*velocity, 0.0))

    station.stream(seconds, 4.0, send)


def standing(_: float) -> tuple[Place, Place]:
    return (30.0, 0.0), (0.0, 0.0)


def eastwards(seconds: float) -> tuple[Place, Place]:
    return (30.0, 2.0 * seconds), (0.0, 2.0)


def behind(station: Px4Station, place: Place) -> Place:
    """How far north and east of the target it is."""
    north, east, _ = station.position
    return north - place[0], east - place[1]


@pytest.mark.night
def test_it_keeps_behind_a_target_that_moves_and_looks_at_it(air: Px4Station) -> None:
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    walk(air, 40.0, eastwards)
    air.run(1.1)
    beat = air.last("HEARTBEAT")
    assert (beat.custom_mode, beat.base_mode) == (0x08040000, 145)
    walk_s = 41.1
    assert behind(air, eastwards(walk_s)[0]) == pytest.approx((0.0, -8.0), abs=1.0)
    assert air.velocity[1] == pytest.approx(2.0, abs=0.4)
    assert air.position[2] == pytest.approx(-8.0, abs=2.0)  # of home, which drifts
    yaw = float(air.simulation.truth.yaw_rad[0])
    assert yaw == pytest.approx(math.pi / 2, abs=0.2)


@pytest.mark.wide
def test_a_target_that_stands_is_seen_from_the_north_and_turned_round(air: Px4Station) -> None:
    """Its course counts as north until it moves."""
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    walk(air, 25.0, standing)
    assert behind(air, (30.0, 0.0)) == pytest.approx((-8.0, 0.0), abs=1.0)
    air.set_parameter("FLW_TGT_FA", 90.0)
    walk(air, 15.0, standing)
    assert behind(air, (30.0, 0.0)) == pytest.approx((0.0, 8.0), abs=1.0)


@pytest.mark.wide
def test_distance_and_height_are_parameters(air: Px4Station) -> None:
    air.set_parameter("FLW_TGT_DST", 12.0)
    air.set_parameter("FLW_TGT_HT", 20.0)
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    walk(air, 2.0, standing)
    assert math.hypot(*air.position[:2]) < 1.0, "it climbs first"
    walk(air, 30.0, standing)
    assert behind(air, (30.0, 0.0)) == pytest.approx((-12.0, 0.0), abs=1.0)
    assert air.position[2] == pytest.approx(-20.0, abs=2.0)


@pytest.mark.wide
def test_the_height_may_be_that_above_the_target(air: Px4Station) -> None:
    air.set_parameter("FLW_TGT_ALT_M", 2, kind=6)
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    air.stream(12.0, 4.0, lambda: target(air, (30.0, 0.0), (0.0, 0.0, 0.0), up_m=10.0))
    assert air.position[2] == pytest.approx(-18.0, abs=0.6)
    air.set_parameter("FLW_TGT_ALT_M", 1, kind=6)
    air.stream(12.0, 4.0, lambda: target(air, (30.0, 0.0), (0.0, 0.0, 0.0), up_m=10.0))
    assert air.position[2] == pytest.approx(-8.0, abs=0.6)


@pytest.mark.wide
def test_the_speed_round_the_target_is_limited(air: Px4Station) -> None:
    air.set_parameter("FLW_TGT_MAX_VEL", 1.0)
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    walk(air, 40.0, standing)
    air.set_parameter("FLW_TGT_FA", 0.0)
    walk(air, 5.0, standing)
    assert math.hypot(*air.velocity) < 1.3


@pytest.mark.wide
def test_lower_responsiveness_trusts_a_jump_less(air: Px4Station) -> None:
    seen = []
    for responsiveness in (0.1, 0.95):
        air.set_parameter("FLW_TGT_RS", responsiveness)
        assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
        walk(air, 30.0, standing)
        begin = air.position[0]
        walk(air, 1.5, lambda _: ((45.0, 0.0), (0.0, 0.0)))
        seen.append(air.position[0] - begin)
        walk(air, 1.0, standing)
    assert seen[0] > 2.0 * seen[1]


@pytest.mark.night
def test_a_silent_target_is_taken_to_stand_still_and_the_vehicle_holds(air: Px4Station) -> None:
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    walk(air, 30.0, eastwards)
    air.run(10.0)
    place = air.position
    assert math.hypot(*air.velocity) < 0.3
    assert 60.0 < place[1] + 8.0 < 68.0
    air.run(5.0)
    assert math.dist(air.position, place) < 0.5
    assert air.custom_mode == px4.FOLLOW_TARGET


def test_without_a_target_it_holds(air: Px4Station) -> None:
    place = air.position
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    air.run(5.0)
    assert math.dist(air.position, place) < 1.0
    assert air.custom_mode == px4.FOLLOW_TARGET


@pytest.mark.night
def test_a_target_without_a_velocity_gets_one_from_its_places(air: Px4Station) -> None:
    assert air.mode(px4.FOLLOW_TARGET) == ACCEPTED
    begin_s = air.now_s

    def send() -> None:
        place = eastwards(air.now_s - begin_s)[0]
        target(air, place, (NAN, NAN, NAN))

    air.stream(40.0, 2.0, send)
    place = eastwards(air.now_s - begin_s)[0]
    assert behind(air, place) == pytest.approx((0.0, -8.0), abs=1.5)


def test_it_cannot_be_armed_in_and_other_kinds_lack_it() -> None:
    ground = ready_px4()
    assert ground.mode(px4.FOLLOW_TARGET) == ACCEPTED
    assert ground.arm() == TEMPORARILY_REJECTED
    assert ready_px4(vehicle="plane").mode(px4.FOLLOW_TARGET) == TEMPORARILY_REJECTED
