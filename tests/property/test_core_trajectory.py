"""Trajectories from any state to any point, under any limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    across,
    distance,
    horizontal_norm,
    norm,
    subtract,
    unit_between,
)
from navigation_core.trajectories.trajectory import Limits, Trajectory, plan_stop, plan_to
from tests.support.models.core_strategies import fractions, limits, points, states

# Examples cost half a millisecond to some milliseconds each.
quickly = settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
_TOLERANCE = 1.0 + 1e-3


def _samples(trajectory: Trajectory, count: int = 200) -> list[tuple[float, KinematicState]]:
    times = [trajectory.duration_s * i / count for i in range(count + 1)]
    return [(t, trajectory.sample(t)) for t in times]


def _assert_ends_at(trajectory: Trajectory, goal: Vector3) -> None:
    for t in (trajectory.duration_s, trajectory.duration_s + 1.0, math.inf):
        end = trajectory.sample(t)
        assert distance(end.position_enu_m, goal) < 1e-6
        assert norm(end.velocity_enu_m_s) < 1e-6
        assert norm(end.acceleration_enu_m_s2) < 1e-6
    before = trajectory.sample(trajectory.duration_s - 1e-6)
    assert distance(before.position_enu_m, goal) < 1e-4
    assert norm(before.velocity_enu_m_s) < 1e-3


def _assert_within(state: KinematicState, bounds: Limits) -> None:
    assert horizontal_norm(state.velocity_enu_m_s) <= bounds.speed_horizontal_m_s * _TOLERANCE
    up = state.velocity_enu_m_s[2]
    assert -bounds.speed_down_m_s * _TOLERANCE <= up <= bounds.speed_up_m_s * _TOLERANCE


def _assert_continuous(trajectory: Trajectory, bounds: Limits, start: KinematicState) -> None:
    """Hold the derivatives of 20 Hz samples to what the limits allow."""
    dt = 0.05
    jerk = math.sqrt(3.0) * bounds.jerk_m_s3
    a_max = math.sqrt(2.0) * max(
        bounds.acceleration_horizontal_m_s2, horizontal_norm(start.acceleration_enu_m_s2)
    )
    a_max += max(bounds.acceleration_vertical_m_s2, abs(start.acceleration_enu_m_s2[2]))
    before = trajectory.sample(0.0)
    for i in range(1, min(int(trajectory.duration_s / dt) + 2, 400)):
        after = trajectory.sample(i * dt)
        assert after.is_finite
        a_step = distance(before.acceleration_enu_m_s2, after.acceleration_enu_m_s2)
        v_step = distance(before.velocity_enu_m_s, after.velocity_enu_m_s)
        x_step = distance(before.position_enu_m, after.position_enu_m)
        v_top = max(norm(before.velocity_enu_m_s), norm(after.velocity_enu_m_s))
        assert a_step <= jerk * dt * _TOLERANCE + 1e-5
        assert v_step <= a_max * dt * _TOLERANCE + 1e-5
        assert x_step <= (v_top + a_max * dt) * dt * _TOLERANCE + 1e-5
        before = after


def _minimum_time_s(length: float, speed: float, acceleration: float, jerk: float) -> float:
    """Shortest jerk-limited time from rest to rest, from the textbook's cases.

    Biagiotti and Melchiorri, "Trajectory Planning for Automatic Machines and Robots",
    2008, section 3.4 (double S profile).
    """
    ramp = acceleration / jerk
    if speed < acceleration * ramp:  # the speed is reached before the acceleration
        run_up = 2.0 * math.sqrt(speed / jerk)
    else:
        run_up = speed / acceleration + ramp
    if speed * run_up <= length:
        return 2.0 * run_up + (length - speed * run_up) / speed
    if 2.0 * acceleration * ramp**2 >= length:  # four equal ramps
        return 4.0 * math.pow(length / (2.0 * jerk), 1.0 / 3.0)
    return ramp + math.sqrt(ramp * ramp + 4.0 * length / acceleration)


@quickly
@given(points, points, limits)
def test_from_rest_the_path_is_straight_and_minimal_in_time(
    start: Vector3, goal: Vector3, bounds: Limits
) -> None:
    trajectory = plan_to(KinematicState(start), goal, bounds)
    _assert_ends_at(trajectory, goal)
    course = unit_between(start, goal)
    assume(course is not None)
    assert course is not None
    travelled = -1e-9
    along = bounds.along(course)
    for _, state in _samples(trajectory):
        _assert_within(state, bounds)
        offset = subtract(state.position_enu_m, start)
        assert norm(across(offset, course)) < 1e-6
        assert norm(offset) >= travelled - 1e-9
        travelled = norm(offset)
        assert norm(state.acceleration_enu_m_s2) <= along.acceleration_m_s2 * _TOLERANCE
    expected = _minimum_time_s(
        distance(start, goal), along.speed_forward_m_s, along.acceleration_m_s2, along.jerk_m_s3
    )
    assert math.isclose(trajectory.duration_s, expected, rel_tol=1e-6, abs_tol=1e-6)


@quickly
@given(points, st.lists(st.tuples(points, fractions), min_size=2, max_size=5), limits)
def test_however_often_redirected_the_speed_keeps_to_its_limit(
    start: Vector3, legs: list[tuple[Vector3, float]], bounds: Limits
) -> None:
    state = KinematicState(start)
    for goal, fraction in legs:
        trajectory = plan_to(state, goal, bounds)
        assert trajectory.sample(0.0) == state
        for _, sample in _samples(trajectory, 100):
            _assert_within(sample, bounds)
        _assert_continuous(trajectory, bounds, state)
        _assert_ends_at(trajectory, goal)
        state = trajectory.sample(fraction * trajectory.duration_s)


@quickly
@given(states, points, limits)
def test_any_start_comes_within_the_limits_and_ends_at_the_goal(
    start: KinematicState, goal: Vector3, bounds: Limits
) -> None:
    trajectory = plan_to(start, goal, bounds)
    _assert_ends_at(trajectory, goal)
    _assert_continuous(trajectory, bounds, start)
    a0 = norm(start.acceleration_enu_m_s2)
    gain = a0 * a0 / bounds.jerk_m_s3
    unavoidable = norm(start.velocity_enu_m_s) + gain
    acceleration = min(bounds.acceleration_horizontal_m_s2, bounds.acceleration_vertical_m_s2)
    settled_s = 3.0 * (a0 + acceleration) / bounds.jerk_m_s3 + unavoidable / acceleration
    for t, state in _samples(trajectory):
        speed = horizontal_norm(state.velocity_enu_m_s)
        assert speed <= max(unavoidable, bounds.speed_horizontal_m_s) * _TOLERANCE
        if t > settled_s:
            _assert_within(state, bounds)


@quickly
@given(states, limits)
def test_a_stop_is_short_and_does_not_speed_up(start: KinematicState, bounds: Limits) -> None:
    trajectory = plan_stop(start, bounds)
    _assert_ends_at(trajectory, trajectory.end_position_enu_m)
    _assert_continuous(trajectory, bounds, start)
    a0 = norm(start.acceleration_enu_m_s2)
    top = norm(start.velocity_enu_m_s) + a0 * a0 / bounds.jerk_m_s3
    acceleration = min(bounds.acceleration_horizontal_m_s2, bounds.acceleration_vertical_m_s2)
    assert trajectory.duration_s <= (
        3.0 * (a0 + acceleration) / bounds.jerk_m_s3 + top / acceleration + 1e-3
    )
    for _, state in _samples(trajectory, 60):
        assert norm(state.velocity_enu_m_s) <= top * _TOLERANCE + 1e-9


@quickly
@given(points, points, points, fractions, limits)
def test_a_redirected_descent_sinks_hardly_deeper_than_its_brake(
    start: Vector3, goal: Vector3, other: Vector3, fraction: float, bounds: Limits
) -> None:
    first = plan_to(KinematicState(start), goal, bounds)
    state = first.sample(fraction * first.duration_s)
    # On the very same line it turns round on that line, never deeper than the first goal.
    line = unit_between(start, goal) or (1.0, 0.0, 0.0)
    assume(norm(across(subtract(other, start), line)) > 1e-3)
    second = plan_to(state, other, bounds)
    fall = max(-state.velocity_enu_m_s[2], 0.0)
    pull = max(-state.acceleration_enu_m_s2[2], 0.0)
    jerk, acceleration = bounds.jerk_m_s3, bounds.acceleration_vertical_m_s2
    # The acceleration is taken away, then the fall is braked.
    deepest = fall * pull / jerk + pull**3 / jerk**2
    fall += 0.5 * pull * pull / jerk
    deepest += fall * (fall / acceleration + 2.0 * acceleration / jerk)
    floor = min(state.position_enu_m[2] - deepest, other[2])
    # Axes that keep in step brake later than one alone: one start in a thousand sinks deeper, by
    # 0.13 m at most in 31,000. From about rest the little sinking lasts longer.
    moves = norm(state.velocity_enu_m_s) > 0.3
    slack = 0.2 if moves else max(0.2, 0.5 * 0.3 * second.duration_s)
    for _, sample in _samples(second):
        assert sample.position_enu_m[2] >= floor - slack


@quickly
@given(points, points, points, fractions, limits)
def test_the_remaining_distance_falls_to_zero(
    start: Vector3, goal: Vector3, other: Vector3, fraction: float, bounds: Limits
) -> None:
    first = plan_to(KinematicState(start), goal, bounds)
    straight_m = distance(start, goal)
    assert math.isclose(first.remaining_distance_m(0.0), straight_m, abs_tol=1e-6)
    state = first.sample(fraction * first.duration_s)
    assert math.isclose(
        first.remaining_distance_m(fraction * first.duration_s),
        distance(state.position_enu_m, goal),
        abs_tol=0.1,
    )
    second = plan_to(state, other, bounds)
    before = math.inf
    for t, sample in _samples(second):
        remaining = second.remaining_distance_m(t)
        assert distance(sample.position_enu_m, other) <= remaining + 0.1
        assert remaining <= before
        before = remaining
    assert second.remaining_distance_m(second.duration_s) == 0.0
    assert second.remaining_distance_m(second.duration_s + 5.0) == 0.0


# Ruckig finds no solution from an acceleration that is next to nothing.
_NEXT_TO_NOTHING = KinematicState((0.0,) * 3, (0.0,) * 3, (0.0, 1.0, 1.1873723838401382e-159))


@pytest.mark.night
@quickly
@given(states, points, limits)
@example(_NEXT_TO_NOTHING, (1.0, 0.0, 0.0), Limits(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0))
def test_many_times_have_the_states_of_each(
    start: KinematicState, goal: Vector3, bounds: Limits
) -> None:
    for trajectory in (plan_to(start, goal, bounds), plan_stop(start, bounds)):
        end_s = trajectory.duration_s
        times_s = np.array([-1.0, 0.0, *np.linspace(0.0, end_s, 40)[1:-1], end_s, end_s + 1.0])
        samples = np.array(trajectory.samples(times_s))
        for row, time_s in enumerate(times_s):
            one = trajectory.sample(float(time_s))
            wanted = (one.position_enu_m, one.velocity_enu_m_s, one.acceleration_enu_m_s2)
            assert np.abs(samples[:, row] - wanted).max() < 1e-5
