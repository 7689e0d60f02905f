"""The run-out of a last setpoint that none follows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacle_shapes import Box
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.safety.run_out import run_out_is_clear, safe_speed_beside_m_s

LIMITS = Limits()
CLEARANCE_M, TIMEOUT_S = 0.8, 3.0
HERE = (0.0, 0.0, 5.0)
FORWARD = (1.0, 0.0, 0.0)


def mover(
    place: tuple[float, float], velocity: tuple[float, float], height_m: float = 5.0
) -> Moving:
    return Moving(np.array([(*place, height_m)]), 0.0, velocity)


def safe_m_s(*moving: Moving, velocity: Vector3 = FORWARD) -> float:
    return safe_speed_beside_m_s(HERE, velocity, moving, LIMITS, CLEARANCE_M, TIMEOUT_S)


def is_clear(acceleration_m_s2: float, obstacles: Obstacles, *moving: Moving) -> bool:
    push = (acceleration_m_s2, 0.0, 0.0)
    setpoint = KinematicState(HERE, FORWARD, push)
    return run_out_is_clear(HERE, setpoint, obstacles, moving, LIMITS, CLEARANCE_M, TIMEOUT_S)


def wall_at(x: float) -> Obstacles:
    return Obstacles.of((Box("wall", (x, 0.0), (0.2, 40.0)),))


def test_what_crosses_the_run_out_later_makes_it_slower() -> None:
    # Nothing stands on the path; in three seconds something will.
    crossing = mover((3.0, -3.0), (0.0, 1.0))
    speed = safe_m_s(crossing)
    assert 0.0 < speed < 1.0
    # At that speed they truly keep apart until the vehicle has come to rest.
    rest_s = TIMEOUT_S + speed / LIMITS.acceleration_horizontal_m_s2
    for time_s in np.arange(0.0, rest_s, 0.05):
        gone_m = speed * min(time_s, TIMEOUT_S)
        apart = math.hypot(3.0 - gone_m, -3.0 + time_s)
        assert apart > CLEARANCE_M - 0.1


@pytest.mark.parametrize(
    "moving",
    [
        mover((3.0, -3.0), (0.0, -1.0)),
        mover((-3.0, 0.0), (-0.5, 0.0)),
        mover((3.0, -3.0), (0.0, 1.0), height_m=1.0),
    ],
    ids=["goes away", "behind", "far below"],
)
def test_what_does_not_meet_it_allows_any_speed(moving: Moving) -> None:
    assert safe_m_s(moving) == math.inf


def test_what_comes_straight_at_it_is_not_approached_but_fled() -> None:
    coming = mover((2.0, 0.0), (-1.0, 0.0))
    assert safe_m_s(coming) < 0.5
    assert safe_m_s(coming, velocity=(-1.0, 0.0, 0.0)) == math.inf
    assert safe_m_s(coming, velocity=(0.0, 1.0, 0.0)) == math.inf


def test_who_leaves_what_is_too_near_may_go() -> None:
    near = mover((-0.5, 0.0), (0.3, 0.0))
    assert safe_m_s(near) == math.inf


def test_a_brake_that_nobody_ends_leads_backwards_and_has_to_end_clear() -> None:
    # 1 m/s forward, 1.5 m/s² backward: after 3 s it is 3.75 m behind, at 3.5 m/s, and brakes for
    # another 3.1 m.
    assert not is_clear(-1.5, wall_at(-7.0))
    assert is_clear(-1.5, wall_at(-9.0))
    assert not is_clear(-1.5, wall_at(-3.0))


def test_the_path_to_a_position_beside_has_to_be_clear() -> None:
    beside = KinematicState((0.0, 3.0, 5.0), (0.0, 1.0, 0.0))
    wall = Obstacles.of((Box("wall", (0.0, 1.5), (4.0, 0.2)),))
    bounds = (LIMITS, CLEARANCE_M, TIMEOUT_S)
    assert run_out_is_clear(beside.position_enu_m, beside, wall, (), *bounds)
    assert not run_out_is_clear(HERE, beside, wall, (), *bounds)


def test_an_acceleration_that_nobody_ends_has_to_end_clear() -> None:
    assert not is_clear(1.0, wall_at(10.0))
    assert is_clear(1.0, wall_at(14.0))


def test_a_brake_that_nobody_ends_must_not_meet_what_moves() -> None:
    assert is_clear(-1.5, NOTHING)
    assert not is_clear(-1.5, NOTHING, mover((-4.0, -3.0), (0.0, 1.0)))
    assert is_clear(-1.5, NOTHING, mover((-4.0, -3.0), (0.0, -1.0)))
