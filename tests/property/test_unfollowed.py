"""A motion that is sent so that it ends if no setpoint follows, against the firmware's own law."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.geometry import KinematicState, Vector3, distance, dot, norm, subtract
from navigation_core.safety.late_setpoints import Following, Shaping, held

ROUNDING = 1e-9
HERE = (3.0, -2.0, 9.0)
numbers = st.floats(-12.0, 12.0, allow_nan=False, allow_infinity=False)
vectors = st.tuples(numbers, numbers, st.floats(-3.0, 3.0))
pushes = st.tuples(*[st.floats(-4.0, 4.0)] * 3)
timeouts = st.floats(0.05, 60.0)
shapings = st.builds(Shaping, st.floats(0.5, 9.0), st.floats(1.0, 20.0))


@given(vectors, pushes, timeouts, shapings, shapings)
def test_it_neither_turns_back_nor_gets_faster(
    velocity: Vector3, push: Vector3, timeout_s: float, level: Shaping, upright: Shaping
) -> None:
    sent = held(KinematicState(HERE, velocity, push), Following(level, upright), timeout_s)
    assert sent.is_finite
    for axes in ((0, 1), (2,)):
        was, now, change = (
            [vector[axis] for axis in axes]
            for vector in (velocity, sent.velocity_enu_m_s, sent.acceleration_enu_m_s2)
        )
        then = [v + a * timeout_s for v, a in zip(now, change, strict=True)]
        assert math.hypot(*now) <= math.hypot(*was) + ROUNDING
        assert math.hypot(*then) <= math.hypot(*now) + ROUNDING
        # All three point the same way, so between them there is no other velocity.
        assert sum(a * b for a, b in zip(was, now, strict=True)) >= -ROUNDING
        assert sum(a * b for a, b in zip(now, then, strict=True)) >= -ROUNDING


@given(vectors, timeouts)
def test_a_steady_level_motion_is_sent_as_it_is(velocity: Vector3, timeout_s: float) -> None:
    velocity = (*velocity[:2], 0.0)
    state = KinematicState(HERE, velocity)
    sent = held(state, Following(), timeout_s)
    assert distance(sent.position_enu_m, HERE) < ROUNDING
    assert sent.velocity_enu_m_s == pytest.approx(velocity)
    assert norm(sent.acceleration_enu_m_s2) == 0.0


def approach_m_s(away_m: float, shaping: Shaping) -> float:
    """Return AP_Math's sqrt_controller, with what shape_pos_vel_accel gives it."""
    gain, limit = (
        0.5 * shaping.jerk_m_s3 / shaping.acceleration_m_s2,
        0.5 * shaping.acceleration_m_s2,
    )
    linear_m = limit / (gain * gain)
    if away_m <= linear_m:
        return gain * away_m
    return math.sqrt(2.0 * limit * (away_m - 0.5 * linear_m))


@given(vectors, pushes, st.floats(1.0, 60.0), shapings)
def test_the_firmwares_law_makes_the_same_acceleration_of_it(
    velocity: Vector3, push: Vector3, timeout_s: float, level: Shaping
) -> None:
    velocity, push = (*velocity[:2], 0.0), (*push[:2], 0.0)
    sent = held(KinematicState(HERE, velocity, push), Following(level, level), timeout_s)
    away = subtract(sent.position_enu_m, HERE)
    speed_m_s, away_m = approach_m_s(norm(away), level), max(norm(away), 1e-12)
    # A vehicle that is where it is to be, and as fast.
    made = [
        level.velocity_gain_1_s * (speed_m_s * d / away_m + v - was) + a
        for d, v, was, a in zip(
            away, sent.velocity_enu_m_s, velocity, sent.acceleration_enu_m_s2, strict=True
        )
    ]
    assert made == pytest.approx(push, abs=1e-6)


@given(st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), shapings)
def test_a_climb_or_a_descent_is_led_by_the_position_alone(
    climb_m_s: float, push: float, upright: Shaping
) -> None:
    state = KinematicState(HERE, (0.0, 0.0, climb_m_s), (0.0, 0.0, push))
    sent = held(state, Following(vertical=upright), 3.0)
    assert norm(sent.velocity_enu_m_s) == norm(sent.acceleration_enu_m_s2) == 0.0
    above_m = sent.position_enu_m[2] - HERE[2]
    speed_m_s = math.copysign(approach_m_s(abs(above_m), upright), above_m)
    made = upright.velocity_gain_1_s * (speed_m_s - climb_m_s)
    assert made == pytest.approx(push, abs=1e-6)


def test_the_last_of_a_brake_is_left_to_the_position() -> None:
    state = KinematicState(HERE, (0.6, 0.0, 0.0), (-2.0, 0.0, 0.0))
    sent = held(state, Following(), 3.0)
    assert norm(sent.velocity_enu_m_s) == norm(sent.acceleration_enu_m_s2) == 0.0
    assert dot(subtract(sent.position_enu_m, HERE), (1.0, 0.0, 0.0)) == pytest.approx(-0.4)
