"""Angles and vectors."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.geometry import (
    KinematicState,
    across,
    distance,
    dot,
    limit_norm,
    norm,
    slew_angle,
    unit_between,
    wrap_angle,
)

angles = st.floats(-100.0, 100.0)


@given(angles)
def test_a_wrapped_angle_is_the_same_angle(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


def test_half_a_turn_wraps_to_plus_pi() -> None:
    assert wrap_angle(math.pi) == math.pi
    assert wrap_angle(-math.pi) == math.pi
    assert wrap_angle(3.0 * math.pi) == pytest.approx(math.pi)


@given(angles, angles, st.floats(0.01, 1.0))
def test_a_slew_takes_the_shorter_direction_and_arrives_exactly(
    angle: float, target: float, step: float
) -> None:
    start = abs(wrap_angle(target - angle))
    for _ in range(math.ceil(start / step) + 1):
        before = angle
        angle = slew_angle(angle, target, step)
        assert abs(wrap_angle(angle - before)) <= step + 1e-9
        assert abs(wrap_angle(target - angle)) <= abs(wrap_angle(target - before)) + 1e-9
    assert angle == wrap_angle(target)


def test_a_slew_crosses_the_south_west_seam() -> None:
    assert slew_angle(3.0, -3.0, 0.2) == pytest.approx(3.0 + 0.2 - math.tau)


def test_vectors() -> None:
    assert norm((2.0, 3.0, 6.0)) == 7.0
    assert limit_norm((2.0, 3.0, 6.0), 3.5) == pytest.approx((1.0, 1.5, 3.0))
    assert limit_norm((2.0, 3.0, 6.0), 8.0) == (2.0, 3.0, 6.0)
    assert across((1.0, 2.0, 3.0), (0.0, 1.0, 0.0)) == (1.0, 0.0, 3.0)
    assert unit_between((1.0, 1.0, 1.0), (1.0, 1.0, 4.0)) == (0.0, 0.0, 1.0)
    assert unit_between((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)) is None
    assert distance((0.0, 0.0, 0.0), (0.0, 3.0, 4.0)) == 5.0
    assert dot((1.0, 2.0, 3.0), (3.0, 2.0, 1.0)) == 10.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_state_knows_that_it_is_not_finite(bad: float) -> None:
    assert KinematicState((0.0, 0.0, 0.0)).is_finite
    assert not KinematicState((0.0, bad, 0.0)).is_finite
    assert not KinematicState((0.0, 0.0, 0.0), (bad, 0.0, 0.0)).is_finite
    assert not KinematicState((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, bad)).is_finite
