"""Validation and resolution of what a client asks for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_bridge.goals.point_requests import check_request, resolve
from navigation_bridge.goals.requests import NavigateRequest, WaypointRequest
from navigation_bridge.goals.route_requests import check_waypoint
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import FlightVolume, Rejection
from navigation_core.tasks.flying.goto import GotoGoal

VOLUME = FlightVolume(radius_max_m=100.0, altitude_min_m=0.5, altitude_max_m=50.0)
UNIT = (0.0, 0.0, 0.0, 1.0)
ZERO = (0.0, 0.0, 0.0, 0.0)


def request(
    position: tuple[float, float, float] = (10.0, 5.0, 2.0),
    orientation: tuple[float, float, float, float] = UNIT,
    frame: str = "map",
    speed: float = 0.0,
) -> NavigateRequest:
    return NavigateRequest(frame, position, orientation, avoid_obstacles=False, max_speed_m_s=speed)


def pose(x: float = 0.0, y: float = 0.0, z: float = 5.0, yaw: float = 0.0) -> MapPose:
    return MapPose((x, y, z), yaw, (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def enu(place: tuple[float, float, float]) -> tuple[float, float, float]:
    """A world in which a thousandth of a degree is 100 m, and the origin 50 m above the sea."""
    return (place[1] * 1e5, place[0] * 1e5, place[2] - 50.0)


def goal(asked: NavigateRequest, at: MapPose | None = None) -> GotoGoal:
    assert check_request(asked) is None
    result = resolve(asked, at or pose(), enu, 0.0, VOLUME, 10.0)
    assert isinstance(result, GotoGoal), result
    return result


NUMBERS = [*(("position", i) for i in range(3)), *(("orientation", i) for i in range(4))]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("part", "index"), [*NUMBERS, ("speed", 0)])
def test_a_number_that_is_not_finite_is_rejected(part: str, index: int, bad: float) -> None:
    position, orientation, speed = [10.0, 5.0, 2.0], list(UNIT), 0.0
    if part == "position":
        position[index] = bad
    elif part == "orientation":
        orientation[index] = bad
    else:
        speed = bad
    asked = NavigateRequest("map", tuple(position), tuple(orientation), False, speed)  # type: ignore[arg-type]
    rejection = check_request(asked)
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_NUMBER
    axis = "xyzw"[index]
    field = "max_speed" if part == "speed" else f"target_pose.pose.{part}.{axis}"
    assert rejection.message == f"{field} is {bad}; every number must be finite."


@pytest.mark.parametrize("frame", ["odom", "world", "/map", "MAP", "base_footprint", " "])
def test_an_unknown_frame_is_rejected_by_name(frame: str) -> None:
    rejection = check_request(request(frame=frame))
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNKNOWN_FRAME
    assert f"'{frame}'" in rejection.message


def test_negative_and_vanishing_speeds_are_rejected() -> None:
    negative, tiny = check_request(request(speed=-0.5)), check_request(request(speed=1e-9))
    assert negative is not None
    assert negative.code is OutcomeCode.NEGATIVE_SPEED
    assert tiny is not None
    assert "0.05" in tiny.message


def test_speed_zero_means_the_default_and_a_high_one_is_capped() -> None:
    assert goal(request(speed=0.0)).max_speed_m_s is None
    assert goal(request(speed=2.5)).max_speed_m_s == 2.5
    assert goal(request(speed=40.0)).max_speed_m_s == 10.0


def test_an_all_zero_quaternion_faces_the_direction_of_travel() -> None:
    assert goal(request(orientation=ZERO)).yaw_enu_rad is None


@pytest.mark.parametrize("norm", [0.95, 1.05])
def test_a_quaternion_off_by_rounding_is_normalised(norm: float) -> None:
    half = math.radians(30.0) / 2
    orientation = (0.0, 0.0, norm * math.sin(half), norm * math.cos(half))
    assert goal(request(orientation=orientation)).yaw_enu_rad == pytest.approx(math.radians(30.0))


@pytest.mark.parametrize("norm", [0.5, 1.5, 100.0])
def test_a_quaternion_that_is_not_a_rotation_is_rejected(norm: float) -> None:
    rejection = check_request(request(orientation=(0.0, 0.0, 0.0, norm)))
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_ORIENTATION


def test_an_orientation_without_a_heading_is_rejected() -> None:
    half = math.sqrt(0.5)  # pitched straight down
    rejection = check_request(request(orientation=(0.0, half, 0.0, half)))
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_ORIENTATION


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_base_link_is_relative_to_position_and_yaw(vehicle_yaw: float, turn: float) -> None:
    orientation = (0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2))
    asked = request((4.0, 1.0, -2.0), orientation, "base_link")
    resolved = goal(asked, pose(20.0, 30.0, 10.0, vehicle_yaw))
    east, north, up = resolved.position_enu_m
    assert up == pytest.approx(8.0)
    assert math.dist((east, north), (20.0, 30.0)) == pytest.approx(math.hypot(4.0, 1.0))
    forward = (east - 20.0) * math.cos(vehicle_yaw) + (north - 30.0) * math.sin(vehicle_yaw)
    assert forward == pytest.approx(4.0)
    assert resolved.yaw_enu_rad is not None
    difference = resolved.yaw_enu_rad - vehicle_yaw - turn
    assert math.cos(difference) == pytest.approx(1.0)


def test_below_ground_and_outside_the_volume() -> None:
    below = resolve(request((1.0, 1.0, -3.0)), pose(), enu, 0.0, VOLUME, 10.0)
    assert isinstance(below, Rejection)
    assert below.code is OutcomeCode.BELOW_GROUND
    far = resolve(request((99.0, 99.0, 5.0)), pose(), enu, 0.0, VOLUME, 10.0)
    assert isinstance(far, Rejection)
    assert far.code is OutcomeCode.OUTSIDE_VOLUME
    high = resolve(request((1.0, 1.0, 51.0)), pose(), enu, 0.0, VOLUME, 10.0)
    assert isinstance(high, Rejection)
    assert high.code is OutcomeCode.OUTSIDE_VOLUME


def test_heights_are_judged_above_the_ground_not_above_the_origin() -> None:
    below = resolve(request((1.0, 1.0, 2.0)), pose(), enu, 3.0, VOLUME, 10.0)
    assert isinstance(below, Rejection)
    assert below.code is OutcomeCode.BELOW_GROUND


def test_a_geodetic_target_is_latitude_longitude_and_altitude_above_the_sea() -> None:
    target = goal(request((0.0002, -0.0003, 62.0), frame="wgs84"))
    assert target.position_enu_m == pytest.approx((-30.0, 20.0, 12.0))
    assert target.yaw_enu_rad == pytest.approx(0.0)


@pytest.mark.parametrize("place", [(90.1, 0.0, 50.0), (0.0, 180.5, 50.0), (149.2, -35.4, 600.0)])
def test_a_position_that_is_not_on_earth_is_rejected(place: tuple[float, float, float]) -> None:
    rejection = check_request(request(place, frame="wgs84"))
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_NUMBER
    assert "latitude (-90 to" in rejection.message


@pytest.mark.parametrize(
    ("member", "field"),
    [
        ({"position": (1.0, math.nan, 2.0)}, "position.y is nan"),
        ({"hold_time_s": math.inf}, "hold_time is inf"),
        ({"yaw_enu_rad": math.nan}, "yaw is nan"),
    ],
)
def test_a_number_of_a_waypoint_is_named(member: dict[str, Any], field: str) -> None:
    waypoint = replace(WaypointRequest((1.0, 2.0, 3.0)), **member)
    rejection = check_waypoint(waypoint)
    assert rejection is not None
    assert rejection.code is OutcomeCode.INVALID_NUMBER
    assert rejection.message == f"{field}; every number must be finite."
