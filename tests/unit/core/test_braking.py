"""The brake, which acts independently of the planned path."""

from __future__ import annotations

import numpy as np
import pytest

from navigation_core.geometry import KinematicState, distance
from navigation_core.limits import Limits
from navigation_core.mapping.obstacle_shapes import Box, Cylinder
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.safety.braking import must_brake, stopping_ends
from navigation_core.trajectories.trajectory import plan_stop

LIMITS = Limits()
CLEARANCE_M, REACTION_S = 0.7, 0.3
# Its side that is met first is at x = 10.
WALL = Obstacles.of((Box("wall", (10.5, 0.0), (1.0, 40.0)),))


def brakes(state: KinematicState, obstacles: Obstacles = WALL, reaction_s: float = 0.3) -> bool:
    return bool(must_brake(MotionSamples.at(state), obstacles, LIMITS, CLEARANCE_M, reaction_s)[0])


def moving(x: float, speed: float, direction: float = 0.0) -> KinematicState:
    velocity = (speed * np.cos(direction), speed * np.sin(direction), 0.0)
    return KinematicState((x, 0.0, 5.0), velocity)


@pytest.mark.parametrize("speed", [0.3, 1.0, 2.0, 5.0, 8.0])
@pytest.mark.parametrize("direction", [0.0, 0.7, 2.5])
@pytest.mark.parametrize("acceleration", [0.0, 1.5])
def test_the_line_is_as_long_as_the_brake_of_the_trajectories(
    speed: float, direction: float, acceleration: float
) -> None:
    course = np.array([np.cos(direction), np.sin(direction), 0.0])
    state = KinematicState(
        (1.0, 2.0, 3.0),
        (float(speed * course[0]), float(speed * course[1]), 0.0),
        (float(acceleration * course[0]), float(acceleration * course[1]), 0.0),
    )
    end = stopping_ends(MotionSamples.at(state), LIMITS, 0.0)[0]
    stop = plan_stop(state, LIMITS).end_position_enu_m
    assert distance((end[0], end[1], end[2]), stop) < 0.02 * distance(stop, state.position_enu_m)


def test_the_reaction_time_is_flown_at_speed() -> None:
    state = moving(0.0, 4.0)
    without = stopping_ends(MotionSamples.at(state), LIMITS, 0.0)[0]
    with_ = stopping_ends(MotionSamples.at(state), LIMITS, 0.5)[0]
    assert with_[0] - without[0] == pytest.approx(2.0)


def test_it_acts_in_time_to_stop_and_not_much_earlier() -> None:
    speed = 5.0
    way_m = float(stopping_ends(MotionSamples.at(moving(0.0, speed)), LIMITS, REACTION_S)[0, 0])
    last_m = 10.0 - CLEARANCE_M - way_m
    assert not brakes(moving(last_m - 0.05, speed))
    assert brakes(moving(last_m + 0.05, speed))
    # A vehicle commanded to stop then, and moving on for the reaction time, keeps the clearance.
    begin = moving(last_m + speed * REACTION_S, speed)
    assert plan_stop(begin, LIMITS).end_position_enu_m[0] < 10.0 - CLEARANCE_M + 0.01


def test_what_lies_beside_or_behind_is_passed() -> None:
    post = Obstacles.of((Cylinder("post", (10.0, 2.0), 0.5),))
    assert not brakes(moving(8.0, 5.0), post)
    assert brakes(moving(5.0, 5.0), Obstacles.of((Cylinder("post", (10.0, 1.0), 0.5),)))
    assert not brakes(moving(8.0, -5.0))


def test_what_lies_below_or_above_is_passed() -> None:
    low = Obstacles.of((Box("low", (10.0, 0.0), (4.0, 4.0), 0.0, 0.0, 4.2),))
    assert not brakes(moving(7.0, 5.0), low)
    assert brakes(
        moving(7.0, 5.0), Obstacles.of((Box("b", (10.0, 0.0), (4.0, 4.0), 0.0, 0.0, 4.5),))
    )


def test_who_stands_need_not_brake_however_near() -> None:
    assert not brakes(moving(9.9, 0.1))


def test_who_is_too_near_may_leave_but_not_come_nearer() -> None:
    assert not brakes(moving(9.6, -2.0))
    assert brakes(moving(9.6, 1.0))


def test_nothing_in_the_way_never_brakes() -> None:
    assert not brakes(moving(0.0, 8.0), NOTHING)
