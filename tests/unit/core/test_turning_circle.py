"""The estimate of a turning radius, and how it is learned."""

from __future__ import annotations

import math

import pytest

from navigation_core.tasks.leading.turning_circle import Pursuer, TurningCircle

_DT_S = 0.05


def at(x: float, y: float, yaw_rad: float, speed_m_s: float = 1.0) -> Pursuer:
    velocity = (speed_m_s * math.cos(yaw_rad), speed_m_s * math.sin(yaw_rad), 0.0)
    return Pursuer((x, y, 0.0), velocity, yaw_rad)


def turn(circle: TurningCircle, radius_m: float, away_rad: float, seconds: float) -> None:
    """Let the circle watch a turn to the left, after a second in which the wheels go over."""
    x = y = yaw_rad = now = 0.0
    while now < seconds:
        now += _DT_S
        rate = min(now, 1.0) / radius_m
        yaw_rad += rate * _DT_S
        x += math.cos(yaw_rad) * _DT_S
        y += math.sin(yaw_rad) * _DT_S
        circle.observe(away_rad, at(x, y, yaw_rad), now)


@pytest.mark.parametrize("radius_m", [1.2, 1.6, 3.0])
def test_a_wider_turn_is_learned(radius_m: float) -> None:
    circle = TurningCircle(0.9, 2.0)
    turn(circle, radius_m, 1.4, 6.0)
    assert circle.radius_m == pytest.approx(radius_m, rel=0.1)


def test_a_tighter_turn_is_no_reason_to_count_on_it() -> None:
    circle = TurningCircle(4.0, 2.0)
    turn(circle, 1.0, 1.4, 6.0)
    assert circle.radius_m == 4.0


def test_only_a_turn_with_the_wheels_at_their_stop_counts() -> None:
    circle = TurningCircle(0.9, 2.0)
    turn(circle, 5.0, 0.5, 10.0)
    assert circle.radius_m == 0.9


def test_what_cannot_be_is_not_learned() -> None:
    circle = TurningCircle(0.9, 2.0)
    turn(circle, 40.0, 1.4, 60.0)
    assert circle.radius_m == 0.9, "it goes straight on: the yaw is wrong, or it was pushed"


def test_a_point_in_the_circle_is_left_until_it_is_well_outside() -> None:
    circle = TurningCircle(1.0, 2.0)
    point = (0.0, 1.0, 0.0)
    left = [circle.must_leave(point, at(0.05 * step, 0.0, 0.0)) for step in range(60)]
    assert left[0]
    assert left == sorted(left, reverse=True), "once it is outside, it stays so"
    assert 0.05 * left.index(False) == pytest.approx(1.25, abs=0.06)


@pytest.mark.parametrize("point", [(3.0, 0.0), (-3.0, 0.0), (0.5, 0.1), (0.0, 2.5)])
def test_what_can_be_turned_to_is_not_left(point: tuple[float, float]) -> None:
    assert not TurningCircle(1.0, 2.0).must_leave((*point, 0.0), at(0.0, 0.0, 0.0))


def test_at_speed_the_circle_is_wider() -> None:
    circle = TurningCircle(1.0, 1.0)
    assert not circle.holds((0.0, 3.0, 0.0), at(0.0, 0.0, 0.0, 1.0))
    assert circle.holds((0.0, 3.0, 0.0), at(0.0, 0.0, 0.0, 3.0))


def test_what_turns_on_the_spot_leaves_nothing() -> None:
    assert not TurningCircle(0.0, 1.0).must_leave((0.0, 0.3, 0.0), at(0.0, 0.0, 0.0, 0.0))
