"""Another speed on the way: the vehicle flies or drives on with it, and does not brake first."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    FAILED,
    POSITION,
    VELOCITY,
    GroundStation,
    flying,
)
from sitl_support.kinds import PLANE_AUTO, ROVER_AUTO, plane, rover
from sitl_support.missions import home, item, upload, waypoint

pytestmark = pytest.mark.wide

SPEED = mav.MAV_CMD_DO_CHANGE_SPEED


def put(station: GroundStation, name: str, value: float) -> None:
    station.send(mav.MAVLink_param_set_message(1, 1, name.encode(), value, 9))


def speeds(station: GroundStation, seconds: float, step_s: float = 0.1) -> list[float]:
    """The true speed over ground, ten times a second."""
    seen = []
    for _ in range(round(seconds / step_s)):
        station.run(step_s, step_s)
        seen.append(math.hypot(*station.velocity[:2]))
    return seen


def in_auto(north_m: float = 400.0, speed: float = 1000.0) -> GroundStation:
    """On a long way north, at full speed."""
    station = flying(10.0, {"WPNAV_SPEED": speed})
    assert upload(station, [home(), waypoint(north_m, 0), waypoint(north_m, 100)]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.run(12.0)
    return station


def in_guided() -> GroundStation:
    station = flying(10.0)
    station.setpoint(POSITION, (400.0, 0.0, -10.0))
    station.run(12.0)
    return station


def by_command(station: GroundStation, speed: float) -> None:
    assert station.command(SPEED, 1, speed, -1) == ACCEPTED


def by_command_int(station: GroundStation, speed: float) -> None:
    assert station.command_int(SPEED, 0, 1, speed, -1) == ACCEPTED


def by_parameter(station: GroundStation, speed: float) -> None:
    put(station, "WPNAV_SPEED", speed * 100.0)


@pytest.mark.parametrize("change", [by_command, by_command_int, by_parameter])
@pytest.mark.parametrize(("before", "after"), [(10.0, 4.0), (4.0, 10.0), (10.0, 8.0)])
def test_a_copter_in_auto_flies_on_with_another_speed(
    change: Callable[[GroundStation, float], None], before: float, after: float
) -> None:
    station = in_auto(speed=before * 100.0)
    assert speeds(station, 0.1)[0] == pytest.approx(before, abs=0.2)
    change(station, after)
    seen = speeds(station, 9.0)
    assert seen[-1] == pytest.approx(after, abs=0.15)
    assert min(before, after) - 0.4 < min(seen), "it does not brake below both"
    assert max(seen) < max(before, after) + 0.4
    steps = [abs(b - a) / 0.1 for a, b in pairwise(seen)]
    assert max(steps) < 3.2, "no harder than WPNAV_ACCEL and the correction after it"


@pytest.mark.parametrize("after", [3.0, 6.0])
def test_a_copter_in_guided_flies_on_with_another_speed(after: float) -> None:
    station = in_guided()
    before = speeds(station, 0.1)[0]
    assert before > 9.0
    by_command(station, after)
    seen = speeds(station, 10.0)
    assert seen[-1] == pytest.approx(after, abs=0.2)
    assert min(seen) > after - 0.4


def test_a_copter_in_guided_becomes_faster_without_a_brake() -> None:
    station = in_guided()
    by_command(station, 3.0)
    station.run(10.0)
    by_command(station, 9.0)
    seen = speeds(station, 8.0)
    assert min(seen) > 2.6
    assert seen[-1] == pytest.approx(9.0, abs=0.3)


def test_a_velocity_continues_with_another_speed() -> None:
    station = flying(10.0)
    station.stream(6.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(4.0, 0.0, 0.0)))
    by_command(station, 8.0)
    seen = []
    for _ in range(10):
        station.setpoint(VELOCITY, velocity=(4.0, 0.0, 0.0))
        seen += speeds(station, 0.2)
    assert min(seen) > 3.5


def test_speeds_up_and_down_count_on_a_slope_under_way() -> None:
    station = flying(10.0)
    assert upload(station, [home(), waypoint(0, 0, 80), waypoint(0, 0, 5)]) == 0
    station.mode(AUTO)
    station.run(8.0)
    assert station.velocity[2] == pytest.approx(-2.5, abs=0.1)
    assert station.command(SPEED, 2, 1.0) == ACCEPTED
    station.run(6.0)
    assert station.velocity[2] == pytest.approx(-1.0, abs=0.1)
    put(station, "WPNAV_SPEED_UP", 400.0)
    station.run(6.0)
    assert station.velocity[2] == pytest.approx(-4.0, abs=0.2)
    station.run_until(lambda: station.vehicle.plans.current == 2, 60.0)
    station.run(6.0)
    assert station.velocity[2] == pytest.approx(1.5, abs=0.1)
    put(station, "WPNAV_SPEED_DN", 300.0)
    station.run(5.0)
    assert station.velocity[2] == pytest.approx(3.0, abs=0.2)


@pytest.mark.parametrize("later_s", [0.3, 1.5, 3.0, 6.0, 9.0, 10.5])
def test_wherever_it_changes_the_leg_ends_at_its_waypoint(later_s: float) -> None:
    """While it accelerates, at full speed, and when it brakes already."""
    station = flying(10.0)
    assert upload(station, [home(), waypoint(60, 0, 10, 1.0), waypoint(60, 20)]) == 0
    station.mode(AUTO)
    station.run(later_s)
    by_command(station, 2.5)
    station.run_until(lambda: station.vehicle.plans.current == 2, 60.0)
    assert math.dist(station.position, (60.0, 0.0, -10.0)) < 1.0


@pytest.mark.parametrize("speed", [2.0, 10.0])
def test_a_speed_that_changes_in_a_corner_spares_the_corner(speed: float) -> None:
    station = flying(10.0)
    assert upload(station, [home(), waypoint(40, 0), waypoint(40, 60), waypoint(0, 60)]) == 0
    station.mode(AUTO)
    station.run_until(lambda: station.position[0] > 37.0)
    by_command(station, speed)
    seen: list[float] = []
    while station.position[1] < 12.0:
        seen += speeds(station, 0.2)
        assert len(seen) < 200
    assert min(seen) > 1.2
    assert station.position[0] == pytest.approx(40.0, abs=2.0)


# Rovers.


@pytest.mark.parametrize(("before", "after"), [(4.0, 1.5), (1.5, 4.0)])
def test_a_rover_in_auto_drives_on_with_another_speed(before: float, after: float) -> None:
    """From 5 m/s to 1.5 the real one sank to 1.06 m/s for a moment."""
    station = rover({"WP_SPEED": before})
    assert upload(station, [home(), waypoint(200, 0), waypoint(200, 20)]) == 0
    station.mode(ROVER_AUTO)
    station.run(12.0)
    by_command(station, after)
    seen = speeds(station, 8.0)
    assert seen[-1] == pytest.approx(after, abs=0.2)
    assert min(seen) > min(before, after) - 0.6, "it does not stop"


@pytest.mark.parametrize(("before", "after"), [(4.0, 1.5), (1.5, 4.0)])
def test_a_rover_in_guided_drives_on_with_another_speed(before: float, after: float) -> None:
    station = rover({"WP_SPEED": before})
    station.setpoint(POSITION, (200.0, 0.0, 0.0))
    station.run(12.0)
    by_command(station, after)
    seen = speeds(station, 8.0)
    assert seen[-1] == pytest.approx(after, abs=0.2)
    assert min(seen) > min(before, after) - 0.5, "it does not stop"


def test_a_rover_that_goes_nowhere_takes_no_speed() -> None:
    assert rover().command(SPEED, 1, 2.0) == FAILED


def test_a_rovers_item_changes_the_speed_of_its_leg() -> None:
    slow = item(SPEED, params=(1.0, 1.5), anywhere=True)
    station = rover()
    assert upload(station, [home(), waypoint(40, 0), slow, waypoint(200, 0)]) == 0
    station.mode(ROVER_AUTO)
    station.run_until(lambda: station.vehicle.plans.current == 3, 40.0)
    seen = speeds(station, 8.0)
    assert seen[-1] == pytest.approx(1.5, abs=0.2)
    assert min(seen) > 0.6, "it does not stop"


def test_a_plane_flies_its_mission_with_another_airspeed() -> None:
    station = plane()
    assert upload(station, [home(), waypoint(2500, 0, 60), waypoint(2500, 500, 60)]) == 0
    station.mode(PLANE_AUTO)
    station.run(25.0)
    assert station.command(SPEED, 0, 27.0, -1) == ACCEPTED
    station.run(12.0)
    assert math.hypot(*station.velocity[:2]) > 25.0
