"""The room that motions keep to what moves, and the brakes that leave its way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from navigation_core.geometry import ZERO, KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacle_shapes import Cylinder
from navigation_core.mapping.obstacles import NOTHING, Array, Obstacles
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.safety.keeping_apart import moments_with_room_m, without_moving
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.leading.path_search import Evasion
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.trajectory import plan_stop
from tests.support.models.observations import HOVERING

LIMITS, AVOIDANCE, ENOUGH_M = Limits(), AvoidanceConfig(), 5.0
START = KinematicState((0.0, 0.0, 5.0), (5.0, 0.0, 0.0))
TIMES_S = np.arange(0.0, 3.01, 0.2)


def crosser(at: tuple[float, float], velocity: tuple[float, float], z: float = 5.0) -> Moving:
    return Moving(np.array([(*at, z)]), 0.0, velocity)


def observed(*moving: Moving, standing: Obstacles = NOTHING) -> Observation:
    posts = [
        Cylinder("crosser", (float(x), float(y)), 0.3)
        for one in moving
        for x, y, _ in one.points_enu_m
    ]
    seen = standing.joined(Obstacles.of(tuple(posts)))
    ahead = [
        Cylinder("ahead", (float(x), float(y)), 0.3)
        for one in moving
        for in_s in (0.6, 1.2, 1.8)
        for x, y in one.points_enu_m[:, :2] + in_s * np.array(one.velocity_enu_m_s)
    ]
    known = seen.joined(Obstacles.of(tuple(ahead)))
    return replace(HOVERING, obstacles=known, obstacles_seen=seen, moving=moving)


def apart_m(path: CheckedPath, moving: Moving) -> float:
    """Return how near a path comes to a moving obstacle in 3 s, each at its time."""
    places = [path.trajectory.sample(time_s).position_enu_m for time_s in TIMES_S]
    at = moving.points_enu_m[0, :2] + TIMES_S[:, None] * np.array(moving.velocity_enu_m_s)
    return float(np.linalg.norm(np.array(places)[:, :2] - at, axis=1).min())


def test_what_may_go_anywhere_is_nearer_by_as_far_as_it_may_have_come() -> None:
    sure = crosser((6.0, 0.0), (0.0, 0.0))
    unsure = replace(sure, uncertain_m_s=1.5)
    places = np.tile((0.0, 0.0, 5.0), (5, 1))
    in_s = np.array([0.0, 1.0, 2.0, 3.0, 9.0])

    def room_m(moving: Moving) -> Array:
        return moments_with_room_m(in_s, places, (moving,), NOTHING, 9.0)

    assert room_m(sure).tolist() == [6.0] * 5
    # After two seconds more will be known.
    assert room_m(unsure).tolist() == [6.0, 4.5, 3.0, 3.0, 3.0]


def stop(observation: Observation, traits: Traits | None = None) -> CheckedPath:
    return Evasion(AVOIDANCE, traits or Traits(), LIMITS).stop(START, observation)


def straight(start: Vector3, velocity: Vector3) -> Array:
    return np.asarray(np.array(start) + TIMES_S[:, None] * np.array(velocity))


@pytest.mark.parametrize(("y", "is_free"), [(-3.0, False), (3.0, True)])
def test_a_place_is_taken_only_for_a_time(y: float, is_free: bool) -> None:
    # Both cross the way of the vehicle at x = 6; one leaves it as the vehicle comes.
    moving = (crosser((6.0, y), (0.0, 2.0)),)
    places = straight((0.0, 0.0, 5.0), (4.0, 0.0, 0.0))
    room_m = moments_with_room_m(TIMES_S, places, moving, NOTHING, ENOUGH_M)
    assert bool(room_m.min() > 1.9) is is_free


def test_one_at_another_height_takes_no_room() -> None:
    places = straight((0.0, 0.0, 5.0), (4.0, 0.0, 0.0))
    moving = (crosser((6.0, -3.0), (0.0, 2.0), z=9.0),)
    assert moments_with_room_m(TIMES_S, places, moving, NOTHING, ENOUGH_M).min() == ENOUGH_M


def test_the_hits_of_what_moves_do_not_stand() -> None:
    wall = Obstacles.of((Cylinder("pole", (0.0, 9.0), 0.5),))
    observation = observed(crosser((6.0, 0.0), (0.0, 1.0)), standing=wall)
    left = without_moving(observation.obstacles_now, observation.moving)
    assert [tuple(post[:2]) for post in left.posts] == [(0.0, 9.0)]


def test_a_brake_does_not_end_where_something_comes_to() -> None:
    crossing = crosser((4.2, 2.8), (-0.2, -1.5))
    chosen = stop(observed(crossing))
    hard = plan_stop(START, replace(LIMITS, acceleration_horizontal_m_s2=4.0, jerk_m_s3=20.0))
    assert apart_m(CheckedPath(hard, (), MotionSamples.of(hard)), crossing) < 0.3
    assert apart_m(chosen, crossing) > 1.2
    end = chosen.trajectory.sample(chosen.trajectory.duration_s)
    assert end.velocity_enu_m_s == pytest.approx(ZERO, abs=1e-6)


@pytest.mark.parametrize(("reach_m", "is_hard"), [(math.inf, False), (15.0, True)])
def test_a_brake_near_what_a_sensor_sees_is_hard_because_it_may_move(
    reach_m: float, is_hard: bool
) -> None:
    pole = Obstacles.of((Cylinder("pole", (10.0, 0.0), 0.3),))
    chosen = stop(replace(observed(standing=pole), obstacles_reach_m=reach_m))
    assert (chosen.trajectory.end_position_enu_m[0] < 5.0) is is_hard


def test_a_rover_brakes_straight_on() -> None:
    chosen = stop(observed(crosser((4.6, 3.2), (-0.2, -1.5))), Traits(flies=False))
    assert abs(chosen.trajectory.end_position_enu_m[1]) < 0.01


def test_a_brake_among_what_stands_stays_straight() -> None:
    pole = Obstacles.of((Cylinder("pole", (5.0, 0.0), 0.3),))
    chosen = stop(observed(standing=pole))
    assert abs(chosen.trajectory.end_position_enu_m[1]) < 0.01
