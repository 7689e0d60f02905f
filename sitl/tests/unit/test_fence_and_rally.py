"""Fences that act, and rally points, as observed with ArduPilot."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.safety.fence import Area
from sitl_support.ground_station import (
    GUIDED,
    LAND,
    POSITION,
    POSITION_VELOCITY,
    RTL,
    VELOCITY,
    GroundStation,
    copter,
)
from sitl_support.missions import item, upload

INCLUSION, EXCLUSION, CIRCLE_IN, CIRCLE_OUT = 5001, 5002, 5003, 5004
FENCE = {"FENCE_ENABLE": 1.0, "FENCE_RADIUS": 30.0, "FENCE_ALT_MAX": 25.0}
GEOFENCE = mav.MAV_SYS_STATUS_GEOFENCE


def polygon(command: int, corners: list[tuple[float, float]]) -> list[mav.MAVLink_message]:
    count = (float(len(corners)),)
    return [item(command, n, e, params=count, mission_type=1) for n, e in corners]


SQUARE = polygon(INCLUSION, [(-15, -15), (15, -15), (15, 15), (-15, 15)])


def flying(parameters: dict[str, float]) -> GroundStation:
    station = copter(parameters=parameters).ready()
    station.interval(162, 5.0)
    return station.take_off(10)


@pytest.mark.parametrize("target", [(60.0, 0.0, -10.0), (0.0, 0.0, -30.0)])
def test_a_position_outside_is_ignored_in_silence(target: tuple[float, float, float]) -> None:
    station = flying(FENCE)
    begin_s = station.now_s
    station.setpoint(POSITION, target)
    station.run(8.0)
    assert math.dist(station.position, (0, 0, -10)) < 0.5
    assert station.texts(begin_s) == []


def test_a_velocity_towards_the_fence_ends_inside() -> None:
    station = flying(FENCE)
    station.stream(25.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(4.0, 0.0, 0.0)))
    assert 24.0 < station.position[0] < 30.0
    assert station.last("FENCE_STATUS").breach_count == 0
    station.stream(5.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(-2.0, 0.0, 0.0)))
    assert station.position[0] < 24.0, "the way back is free"


def test_a_velocity_with_a_position_inside_is_not_held_up() -> None:
    """As mode_guided.cpp has it: AC_Avoid looks at velocities without a position alone."""
    station = flying(FENCE)
    station.stream(
        20.0,
        5.0,
        lambda: station.setpoint(POSITION_VELOCITY, (29.0, 0.0, -10.0), velocity=(0.1, 0.0, 0.0)),
    )
    assert station.position[0] > 28.5, "nearer than FENCE_MARGIN"
    assert station.last("FENCE_STATUS").breach_count == 0


def breach(parameters: dict[str, float]) -> GroundStation:
    station = flying({**FENCE, "AVOID_ENABLE": 0.0, **parameters})
    station.stream(15.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(5.0, 0.0, 0.0)))
    return station


def test_a_breach_without_avoidance_returns_and_says_so() -> None:
    station = breach({})
    assert "Circle fence breached" in station.texts()
    assert station.last("HEARTBEAT").custom_mode == RTL
    status = [m for m in station.messages("FENCE_STATUS") if m.breach_status]
    assert (status[0].breach_status, status[0].breach_type) == (1, 3)
    broken = [m for m in station.messages("SYS_STATUS") if m.onboard_control_sensors_enabled]
    assert any(not m.onboard_control_sensors_health & GEOFENCE for m in broken)
    assert station.mode(GUIDED) == 0, "GUIDED is accepted again"


@pytest.mark.parametrize(("action", "mode"), [(0, GUIDED), (2, 9), (4, 17)])
def test_the_action_is_the_parameter_s(action: int, mode: int) -> None:
    station = breach({"FENCE_ACTION": action})
    assert station.last("HEARTBEAT").custom_mode == mode


def test_a_disabled_fence_does_nothing_until_it_is_enabled() -> None:
    station = flying({**FENCE, "FENCE_ENABLE": 0.0})
    assert station.messages("FENCE_STATUS") == []
    station.setpoint(POSITION, (45.0, 0.0, -10.0))
    station.run(15.0)
    assert station.position[0] > 40.0
    assert station.command(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
    station.run(1.0)
    assert "Circle fence breached" in station.texts()
    assert station.command(mav.MAV_CMD_DO_FENCE_ENABLE, 9) == 4


def test_an_uploaded_polygon_and_a_circle_to_keep_out_of() -> None:
    station = flying({"FENCE_ENABLE": 1.0})
    out = item(CIRCLE_OUT, 0, 10, params=(3.0,), mission_type=1)
    assert upload(station, [*SQUARE, out], 1) == 0
    for target in ((20.0, 0.0, -10.0), (0.0, 9.0, -10.0)):
        station.setpoint(POSITION, target)
        station.run(6.0)
        assert math.dist(station.position, (0, 0, -10)) < 0.5
    station.setpoint(POSITION, (12.0, 0.0, -10.0))
    station.run(10.0)
    assert station.position[0] == pytest.approx(12.0, abs=0.6)


def test_outside_the_fence_it_does_not_arm() -> None:
    station = copter(parameters={"FENCE_ENABLE": 1.0}).ready()
    far = polygon(INCLUSION, [(100, 100), (120, 100), (120, 120)])
    assert upload(station, far, 1) == 0
    station.mode(GUIDED)
    assert station.arm() == 4
    assert "Arm: Vehicle breaching Polygon fence" in station.texts()


def test_an_area_allows_what_is_inside_or_outside() -> None:
    corners = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 5.0), (0.0, 10.0))
    inside, outside = (2.0, 2.0), (5.0, 8.0)
    for inclusion in (True, False):
        area = Area(inclusion, corners)
        assert area.allows(inside) is inclusion
        assert area.allows(outside) is not inclusion
        circle = Area(inclusion, centre=(1.0, 1.0), radius_m=2.0)
        assert circle.allows((2.0, 2.0)) is inclusion
        assert circle.allows((4.0, 1.0)) is not inclusion


def test_rtl_goes_to_a_rally_point_that_is_nearer_than_home() -> None:
    station = copter().ready()
    points = [item(5100, 40, 5, 20, mission_type=2), item(5100, 400, 0, 20, mission_type=2)]
    assert upload(station, points, 2) == 0
    station.take_off(10)
    station.setpoint(POSITION, (45.0, 0.0, -10.0))
    station.run(15.0)
    station.mode(RTL)
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    assert math.dist(station.position[:2], (40, 5)) < 0.6


def test_rtl_goes_to_a_rally_point_farther_off_if_home_does_not_count_and_as_high() -> None:
    station = copter(parameters={"RALLY_INCL_HOME": 0.0}).ready()
    assert upload(station, [item(5100, 40, 5, 20, mission_type=2)], 2) == 0
    station.take_off(10)
    station.mode(RTL)
    station.run_until(lambda: math.dist(station.position[:2], (40, 5)) < 0.6, 60.0)
    assert station.position[2] == pytest.approx(-20.0, abs=0.5), "RTL_ALT is 15 m"
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    assert math.dist(station.position[:2], (40, 5)) < 0.6


def test_rtl_goes_home_when_that_is_nearer() -> None:
    station = copter().ready()
    assert upload(station, [item(5100, 40, 5, 20, mission_type=2)], 2) == 0
    station.take_off(10)
    station.setpoint(POSITION, (10.0, 0.0, -10.0))
    station.run(10.0)
    station.mode(RTL)
    station.run_until(lambda: not station.vehicle.firmware.armed, 120.0)
    assert math.hypot(*station.position[:2]) < 0.6


def test_twenty_metres_higher_a_breach_of_the_ceiling_counts_again() -> None:
    """Seen in `copter_fence3`: with FENCE_ACTION changed in between, it acts at 40 m."""
    fence = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 1.0, "FENCE_ALT_MAX": 20.0, "FENCE_ACTION": 0.0}
    station = flying({**fence, "AVOID_ENABLE": 0.0})
    copter = station.vehicle.firmware

    def push() -> None:
        station.setpoint(VELOCITY, velocity=(0.0, 0.0, -2.0))

    while not copter.fence.count:
        station.stream(1.0, 2.0, push)
        assert station.now_s < 60.0
    copter.parameters.set("FENCE_ACTION", 2.0)
    station.stream(6.0, 2.0, push)
    assert copter.mode.spec.number == GUIDED
    while copter.mode.spec.number == GUIDED:
        station.stream(1.0, 2.0, push)
        assert station.now_s < 60.0
    assert copter.mode.spec.number == LAND
    assert -station.position[2] == pytest.approx(41.5, abs=2.0)
    assert copter.fence.count == 2
