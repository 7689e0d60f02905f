"""DO_ORBIT of the simulated PX4, after the firmware's source."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import ACCEPTED, DENIED, UNSUPPORTED
from sitl_support.px4_station import HOME, NAN, Px4Station, at, flying_px4, ready_px4

pytestmark = pytest.mark.wide

ORBIT = mav.MAV_CMD_DO_ORBIT
ALTITUDE_M = HOME.altitude_amsl_m + 10.0
CENTRE = (20.0, 0.0)


@pytest.fixture
def air() -> Px4Station:
    """Holding 10 m above home."""
    station = flying_px4()
    assert station.mode(px4.LOITER) == ACCEPTED
    station.gcs_heartbeat()
    return station.quiet()


def orbit(
    station: Px4Station, radius_m: float, speed_m_s: float = 3.0, yaw: float = 0.0, **where: float
) -> int:
    """COMMAND_INT round the centre, or elsewhere."""
    latitude, longitude = at(*CENTRE)
    x, y = int(where.get("x", latitude)), int(where.get("y", longitude))
    z = where.get("z", ALTITUDE_M)
    return station.command_int(ORBIT, 5, radius_m, speed_m_s, yaw, 0.0, x=x, y=y, z=z)


def circling(station: Px4Station, radius_m: float) -> None:
    """Wait until it is on the circle and has its speed."""
    station.run_until(lambda: abs(from_centre(station) - radius_m) < 1.0)
    station.run(6.0)


# On a circle the integrators of the velocity turn with the vehicle and never catch up with the
# drag: it flies a little slower and further out than asked, as the same loops of the real one.


def from_centre(station: Px4Station) -> float:
    return math.dist(station.position[:2], CENTRE)


def turning(station: Px4Station) -> float:
    """Speed along the circle, positive clockwise."""
    (north, east, _), (v_north, v_east, _) = station.position, station.velocity
    north, east = north - CENTRE[0], east - CENTRE[1]
    return (north * v_east - east * v_north) / math.hypot(north, east)


@pytest.mark.parametrize("radius_m", [8.0, -8.0])
def test_it_flies_to_the_circle_and_round_it(air: Px4Station, radius_m: float) -> None:
    assert orbit(air, radius_m) == ACCEPTED
    air.run(1.1)
    beat = air.last("HEARTBEAT")
    assert (beat.custom_mode, beat.base_mode) == (0x01030000, 145)
    circling(air, 8.0)
    for _ in range(12):
        air.run(1.0)
        assert from_centre(air) == pytest.approx(8.0, abs=1.0)
        assert turning(air) == pytest.approx(math.copysign(2.6, radius_m), abs=0.5)
        assert air.position[2] == pytest.approx(-10.0, abs=0.5)


def heading_to_centre(station: Px4Station) -> float:
    north, east, _ = station.position
    return math.atan2(CENTRE[1] - east, CENTRE[0] - north)


def off(station: Px4Station, heading_rad: float) -> float:
    yaw = float(station.simulation.truth.yaw_rad[0])
    return abs(math.remainder(yaw - heading_rad, math.tau))


@pytest.mark.parametrize("behaviour", [0, 1, 2, 3])
def test_the_nose_follows_the_rule(air: Px4Station, behaviour: int) -> None:
    air.run(2.0)
    begun = float(air.simulation.truth.yaw_rad[0])
    assert orbit(air, 8.0, yaw=behaviour) == ACCEPTED
    circling(air, 8.0)
    seen = []
    for _ in range(8):
        air.run(0.7)
        centre = heading_to_centre(air)
        wanted = {0: centre, 1: begun, 3: centre - math.pi / 2}.get(behaviour, 0.0)
        seen.append(off(air, wanted))
    if behaviour == 2:
        yaws = {round(float(air.simulation.truth.yaw_rad[0]), 1)}
        air.run(3.0)
        assert yaws == {round(float(air.simulation.truth.yaw_rad[0]), 1)}
    else:
        assert max(seen) < 0.35


def test_the_execution_is_reported_and_ends_with_the_mode(air: Px4Station) -> None:
    assert air.command(512, 360) == DENIED
    assert orbit(air, -8.0, yaw=3.0) == ACCEPTED
    air.run(2.0)
    status = air.messages("ORBIT_EXECUTION_STATUS")
    assert 9 <= len(status) <= 11  # 5 Hz to a companion computer
    assert (status[-1].radius, status[-1].frame) == (-8.0, 0)
    assert (status[-1].x, status[-1].y) == pytest.approx(at(*CENTRE), abs=2)
    assert status[-1].z == pytest.approx(ALTITUDE_M, abs=0.1)
    assert air.command(512, 360) == ACCEPTED
    assert air.mode(px4.LOITER) == ACCEPTED
    begin_s = air.now_s
    air.run(3.0)
    assert not air.messages("ORBIT_EXECUTION_STATUS", begin_s + 0.01)
    assert math.hypot(*air.velocity) < 1.0


def test_what_is_not_given_stays(air: Px4Station) -> None:
    assert orbit(air, 8.0) == ACCEPTED
    circling(air, 8.0)
    unknown = {"x": 2**31 - 1, "y": 2**31 - 1, "z": NAN}
    assert orbit(air, NAN, 1.5, NAN, **unknown) == ACCEPTED
    air.run(8.0)
    assert turning(air) == pytest.approx(1.5, abs=0.3)
    assert from_centre(air) == pytest.approx(8.0, abs=1.0)
    assert orbit(air, 15.0, 3.0, NAN, **unknown) == ACCEPTED
    circling(air, 15.0)
    assert from_centre(air) == pytest.approx(15.0, abs=0.8)


def test_without_a_centre_it_flies_round_where_it_is(air: Px4Station) -> None:
    place = air.position
    assert air.command(ORBIT, 5.0, 2.0, 0.0, 0.0, NAN, NAN, NAN) == ACCEPTED
    air.run(15.0)
    assert math.dist(air.position[:2], place[:2]) == pytest.approx(5.0, abs=0.6)
    assert math.hypot(*air.velocity) == pytest.approx(1.7, abs=0.4)


def test_the_speed_is_limited_by_the_radius(air: Px4Station) -> None:
    """To 2 m/s2 inwards: 4 m/s at 8 m."""
    assert orbit(air, 8.0, 20.0) == ACCEPTED
    circling(air, 8.0)
    assert 2.6 < turning(air) < 4.1


@pytest.mark.parametrize("radius_m", [0.0, 0.9, 1001.0])
def test_a_radius_out_of_range_is_accepted_and_not_flown(air: Px4Station, radius_m: float) -> None:
    assert orbit(air, radius_m) == ACCEPTED
    air.run(3.0)
    assert "Orbit radius limit exceeded\t" in air.texts()
    assert air.custom_mode == px4.ORBIT
    assert math.hypot(*air.velocity) < 0.5


def test_parameters_limit_the_radius_and_choose_the_nose(air: Px4Station) -> None:
    air.set_parameter("MC_ORBIT_RAD_MAX", 6.0)
    assert orbit(air, 8.0) == ACCEPTED
    assert "Orbit radius limit exceeded\t" in air.texts()
    assert air.mode(px4.LOITER) == ACCEPTED
    air.set_parameter("MC_ORBIT_YAW_MOD", 3, kind=6)
    assert orbit(air, 6.0, 2.0, yaw=5.0) == ACCEPTED  # ORBIT_YAW_BEHAVIOUR_UNCHANGED
    circling(air, 6.0)
    assert off(air, heading_to_centre(air) - math.pi / 2) < 0.35


def test_it_cannot_be_armed_in() -> None:
    ground = ready_px4()
    assert orbit(ground, 8.0) == ACCEPTED
    assert ground.custom_mode == px4.ORBIT
    assert ground.arm() != ACCEPTED


@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_rovers_and_boats_have_none(kind: str) -> None:
    assert ready_px4(vehicle=kind).command(ORBIT, 8.0) == UNSUPPORTED
