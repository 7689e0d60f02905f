"""The drag of a multicopter: learned from lean angles, added where the firmware needs it."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.drag import Drag, push_m_s2
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointNed
from mavlink_vehicle.state.telemetry import Attitude, LocalPosition

_STEP_S = 0.1
_GRAVITY_M_S2 = 9.80665


def lean(time_s: float, north_m_s2: float, east_m_s2: float, yaw_rad: float = 0.0) -> Attitude:
    """Return the attitude that pushes so."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    forward = north_m_s2 * cosine + east_m_s2 * sine
    right = east_m_s2 * cosine - north_m_s2 * sine
    pitch = -math.atan(forward / _GRAVITY_M_S2)
    roll = math.atan(right * math.cos(pitch) / _GRAVITY_M_S2)
    return Attitude(time_s, 0, roll, pitch, yaw_rad, (0.0, 0.0, 0.0))


def fly(
    drag: Drag,
    per_s: float,
    wind_m_s: float = 0.0,
    *,
    begin_s: float = 0.0,
    speed_m_s: float = 4.0,
    yaw_rad: float = 0.0,
) -> float:
    """Hover, speed up, cruise, brake, northwards; return when that has ended."""
    speed, time_s = 0.0, begin_s
    for step in range(160):
        acceleration = 2.0 if 20 <= step < 20 + speed_m_s * 5.0 else 0.0
        acceleration = -2.0 if 120 <= step < 120 + speed_m_s * 5.0 else acceleration
        speed += acceleration * _STEP_S
        time_s = begin_s + step * _STEP_S
        push = acceleration + per_s * (speed - wind_m_s)
        motion = LocalPosition(time_s, 0, (0.0, 0.0, -5.0), (speed, 0.0, 0.0))
        drag.learn(lean(time_s, push, 0.0, yaw_rad), motion)
    return time_s


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
def test_the_push_of_a_lean_is_where_it_leans_to(yaw_rad: float) -> None:
    assert push_m_s2(lean(0.0, 3.0, -2.0, yaw_rad)) == pytest.approx((3.0, -2.0))
    nose_down = Attitude(0.0, 0, 0.0, -0.2, math.radians(90.0), (0.0, 0.0, 0.0))
    assert push_m_s2(nose_down) == pytest.approx((0.0, _GRAVITY_M_S2 * math.tan(0.2)))


@pytest.mark.parametrize("per_s", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("yaw_rad", [0.0, 2.0])
def test_one_flight_is_enough_to_learn_the_drag(per_s: float, yaw_rad: float) -> None:
    drag = Drag()
    fly(drag, per_s, yaw_rad=yaw_rad)
    assert drag.per_s == pytest.approx(per_s, abs=0.1)


@pytest.mark.parametrize("wind_m_s", [-4.0, 4.0])
def test_the_lean_against_a_steady_wind_is_not_taken_for_drag(wind_m_s: float) -> None:
    drag = Drag()
    fly(drag, 0.5, wind_m_s, begin_s=fly(drag, 0.5, wind_m_s))
    assert drag.per_s == pytest.approx(0.5, abs=0.12)


def test_absurd_leans_teach_nothing_absurd() -> None:
    drag = Drag()
    fly(drag, 50.0)
    assert drag.per_s <= 1.2
    fly(drag, -50.0, begin_s=100.0)
    assert drag.per_s >= 0.0


def test_what_is_missing_or_late_teaches_nothing() -> None:
    drag = Drag()
    before = drag.per_s
    still = LocalPosition(0.0, 0, (0.0, 0.0, -5.0), (4.0, 0.0, 0.0))
    for step in range(50):
        time_s = 2.0 * step
        drag.learn(lean(time_s, 9.0, 0.0), still._replace(time_s=time_s))
        drag.learn(None, still)
        drag.learn(lean(time_s, 9.0, 0.0), None)
    for _ in range(50):
        drag.learn(lean(200.0, 9.0, 0.0), still._replace(time_s=200.0))
    assert drag.per_s == before


def test_a_setpoint_pushes_for_its_acceleration_and_against_the_drag_of_its_speed() -> None:
    drag = Drag()
    fly(drag, 0.5)
    setpoint = SetpointNed((1.0, 2.0, 3.0), (4.0, -2.0, 1.0), (0.0, 1.0, 0.5))
    pushed = drag.added_to(setpoint)
    assert pushed.position_ned_m == setpoint.position_ned_m
    assert pushed.velocity_ned_m_s == setpoint.velocity_ned_m_s
    # PX4's MPC_XY_VEL_D_ACC takes a fifth of each acceleration back.
    assert pushed.acceleration_ned_m_s2 == pytest.approx((2.0, 0.2, 0.5), abs=0.3)


def test_a_setpoint_at_rest_or_without_an_acceleration_stays_as_it_is() -> None:
    drag = Drag()
    for setpoint in (
        SetpointNed((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        SetpointNed((1.0, 2.0, 3.0), (4.0, 0.0, 0.0)),
        SetpointNed(acceleration_ned_m_s2=(1.0, 0.0, 0.0)),
    ):
        assert drag.added_to(setpoint) == setpoint


def test_only_a_px4_multicopter_takes_an_acceleration_for_a_push() -> None:
    assert px4.COPTER.setpoints.acceleration_is_push
    for profile in (px4.ROVER, px4.BOAT, px4.PLANE, ardupilot.COPTER, ardupilot.ROVER):
        assert not profile.setpoints.acceleration_is_push


def test_a_push_never_leans_the_vehicle_farther_than_36_degrees() -> None:
    drag = Drag()
    drag.per_s = 1.2
    fast = SetpointNed((0.0, 0.0, -5.0), (12.0, -9.0, 1.0), (4.0, -3.0, 0.5), 0.0, None)
    push = drag.added_to(fast).acceleration_ned_m_s2
    assert push is not None
    assert math.hypot(push[0], push[1]) == pytest.approx(7.0)
    assert push[0] / push[1] == pytest.approx(-4.0 / 3.0)
    assert math.degrees(math.atan(7.0 / _GRAVITY_M_S2)) < 36.0
    assert push[2] == 0.5
