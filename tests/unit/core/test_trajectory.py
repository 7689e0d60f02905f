"""Limits, and single trajectories with known properties."""

import dataclasses
import math
from itertools import pairwise

import pytest

from navigation_core.geometry import KinematicState, distance, horizontal_norm, norm
from navigation_core.trajectories.trajectory import (
    Limits,
    LimitsError,
    TrajectoryError,
    plan_stop,
    plan_to,
)

LIMITS = Limits(
    speed_horizontal_m_s=5.0,
    speed_up_m_s=2.0,
    speed_down_m_s=1.5,
    acceleration_horizontal_m_s2=2.0,
    acceleration_vertical_m_s2=1.0,
    jerk_m_s3=4.0,
)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(Limits)])
def test_a_limit_that_cannot_be_flown_is_named(name: str, bad: float) -> None:
    with pytest.raises(LimitsError, match=f"{name} is {bad}; give a positive"):
        Limits(**{name: bad})


def test_another_speed_changes_what_goes_with_it() -> None:
    slow = LIMITS.with_speed(1.0)
    assert (slow.speed_horizontal_m_s, slow.speed_up_m_s, slow.speed_down_m_s) == (1.0, 1.0, 1.0)
    fast = LIMITS.with_speed(9.0)
    assert (fast.speed_horizontal_m_s, fast.speed_up_m_s, fast.speed_down_m_s) == (9.0, 2.0, 1.5)
    # A slow flight is a gentle one, a fast one no harsher than configured.
    assert slow.acceleration_horizontal_m_s2 < 1.0
    assert slow.jerk_m_s3 < 4.0
    assert fast.acceleration_horizontal_m_s2 == 2.0
    assert fast.jerk_m_s3 == 4.0
    assert LIMITS.with_speed(None) is LIMITS
    assert LIMITS.with_speed(0.0) is LIMITS


def test_what_is_faster_than_a_slow_goal_brakes_as_usual() -> None:
    slow = LIMITS.with_speed(0.5)
    brake = slow.slowing_from(5.0, LIMITS)
    assert brake == dataclasses.replace(slow, acceleration_horizontal_m_s2=2.0, jerk_m_s3=4.0)
    assert slow.slowing_from(0.5, LIMITS) is slow
    assert LIMITS.slowing_from(50.0, LIMITS) == LIMITS


def test_limits_along_a_direction() -> None:
    up = LIMITS.along((0.0, 0.0, 1.0))
    assert (up.speed_forward_m_s, up.speed_backward_m_s) == (2.0, 1.5)
    assert up.acceleration_m_s2 == 1.0
    down = LIMITS.along((0.0, 0.0, -1.0))
    assert (down.speed_forward_m_s, down.speed_backward_m_s) == (1.5, 2.0)
    slope = LIMITS.along((0.8, 0.0, 0.6))
    assert slope.speed_forward_m_s == pytest.approx(2.0 / 0.6)
    assert slope.speed_backward_m_s == pytest.approx(1.5 / 0.6)
    assert slope.acceleration_m_s2 == pytest.approx(1.0 / 0.6)


def test_the_course_goal_from_a_hover() -> None:
    trajectory = plan_to(KinematicState((0.0, 0.0, 2.0)), (10.0, 5.0, 2.0), LIMITS)
    # 11.18 m: up to 2 m/s2 at 4 m/s3, without reaching 5 m/s.
    assert trajectory.duration_s == pytest.approx(0.5 + math.sqrt(0.25 + 2 * 11.18034), abs=1e-4)
    middle = trajectory.sample(trajectory.duration_s / 2)
    assert middle.position_enu_m == pytest.approx((5.0, 2.5, 2.0), abs=1e-6)
    assert middle.acceleration_enu_m_s2 == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert trajectory.end_position_enu_m == (10.0, 5.0, 2.0)


def test_no_distance_takes_no_time() -> None:
    here = KinematicState((3.0, 4.0, 5.0))
    trajectory = plan_to(here, (3.0, 4.0, 5.0), LIMITS)
    assert trajectory.duration_s == 0.0
    assert trajectory.sample(0.0) == here
    assert trajectory.sample(1.0) == here
    assert trajectory.remaining_distance_m(0.0) == 0.0


def test_sampling_is_clamped_at_both_ends() -> None:
    start = KinematicState((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.5, 0.0, 0.0))
    trajectory = plan_to(start, (20.0, 0.0, 2.0), LIMITS)
    assert trajectory.sample(-1.0) == start
    assert trajectory.sample(1e9) == KinematicState((20.0, 0.0, 2.0))


def test_the_same_goal_again_changes_nothing() -> None:
    first = plan_to(KinematicState((0.0, 0.0, 2.0)), (30.0, 10.0, 6.0), LIMITS)
    for share in (0.1, 0.5, 0.9, 0.97):
        t = share * first.duration_s
        again = plan_to(first.sample(t), (30.0, 10.0, 6.0), LIMITS)
        assert again.duration_s == pytest.approx(first.duration_s - t, abs=1e-3)


def test_a_lower_speed_in_flight_is_braked_to() -> None:
    slow = dataclasses.replace(LIMITS, speed_horizontal_m_s=2.0)
    start = KinematicState((0.0, 0.0, 10.0), (5.0, 0.0, 0.0))
    trajectory = plan_to(start, (50.0, 30.0, 10.0), slow)
    # 3 m/s less at 2 m/s2 and 4 m/s3 take 2 s.
    assert horizontal_norm(trajectory.sample(2.0).velocity_enu_m_s) == pytest.approx(2.0, abs=1e-3)
    speeds = [
        horizontal_norm(trajectory.sample(2.0 + 0.05 * i).velocity_enu_m_s) for i in range(500)
    ]
    assert max(speeds) <= 2.0 * 1.001


def test_a_goal_behind_is_turned_to() -> None:
    start = KinematicState((0.0, 0.0, 10.0), (5.0, 0.0, 0.0))
    trajectory = plan_to(start, (-20.0, 1.0, 10.0), LIMITS)
    xs = [trajectory.sample(0.05 * i).position_enu_m[0] for i in range(400)]
    # To a standstill from 5 m/s takes 7.5 m.
    assert max(xs) == pytest.approx(7.5, abs=0.5)
    assert trajectory.duration_s < 15.0


def test_a_stop_takes_what_the_limits_say() -> None:
    trajectory = plan_stop(KinematicState((1.0, 2.0, 3.0), (3.0, 4.0, 0.0)), LIMITS)
    assert trajectory.duration_s == pytest.approx(5.0 / 2.0 + 2.0 / 4.0)
    assert trajectory.end_position_enu_m == pytest.approx((1.0 + 4.5, 2.0 + 6.0, 3.0))


def test_a_stop_from_rest_takes_no_time() -> None:
    trajectory = plan_stop(KinematicState((1.0, 2.0, 3.0)), LIMITS)
    assert trajectory.duration_s == 0.0
    assert trajectory.end_position_enu_m == (1.0, 2.0, 3.0)


def test_far_from_the_origin_precision_holds() -> None:
    start = KinematicState((10_000.0, -20_000.0, 500.0), (2.0, 3.0, -1.0))
    trajectory = plan_to(start, (10_100.0, -20_050.0, 480.0), LIMITS)
    end = trajectory.sample(trajectory.duration_s - 1e-9)
    assert end.position_enu_m == pytest.approx((10_100.0, -20_050.0, 480.0), abs=1e-5)


def test_noise_of_a_hover_hardly_bends_the_path() -> None:
    start = KinematicState((0.0, 0.0, 2.5), (0.03, -0.05, 0.02))
    trajectory = plan_to(start, (20.0, 0.0, 6.5), LIMITS)
    points = [trajectory.sample(0.05 * i).position_enu_m for i in range(300)]
    assert max(abs(y) for _, y, _ in points) < 0.1
    assert max(abs(z - 2.5 - 0.2 * x) for x, _, z in points) < 0.1


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_finite_is_rejected(bad: float) -> None:
    origin = KinematicState((0.0, 0.0, 0.0))
    with pytest.raises(TrajectoryError, match="NaN or infinite"):
        plan_to(origin, (bad, 0.0, 0.0), LIMITS)
    with pytest.raises(TrajectoryError, match="NaN or infinite"):
        plan_to(KinematicState((0.0, bad, 0.0)), (1.0, 0.0, 0.0), LIMITS)
    with pytest.raises(TrajectoryError, match="NaN or infinite"):
        plan_stop(KinematicState((0.0, 0.0, 0.0), (bad, 0.0, 0.0)), LIMITS)


def test_all_derivatives_are_continuous_where_pieces_meet() -> None:
    start = KinematicState((0.0, 0.0, 10.0), (4.0, -6.0, 1.0), (1.0, 1.0, -0.5))
    trajectory = plan_to(start, (-30.0, 12.0, 4.0), LIMITS)
    dt = 1e-4
    for i in range(int(trajectory.duration_s / dt)):
        if i % 50:
            continue
        before, after = trajectory.sample(i * dt), trajectory.sample((i + 1) * dt)
        jump = [after.acceleration_enu_m_s2[k] - before.acceleration_enu_m_s2[k] for k in range(3)]
        assert norm((jump[0], jump[1], jump[2])) <= 2.0 * 4.0 * dt


@pytest.mark.parametrize("size", [1e6, 1e12, 1e100, 1e300])
def test_absurd_numbers_end_in_a_named_error_or_a_finite_trajectory(size: float) -> None:
    starts = [
        KinematicState((size, -size, 0.0)),
        KinematicState((0.0, 0.0, 0.0), (size, size, -size)),
        KinematicState((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (size, 0.0, -size)),
    ]
    for start in starts:
        for goal in ((1.0, 2.0, 3.0), None):
            try:
                trajectory = plan_to(start, goal, LIMITS) if goal else plan_stop(start, LIMITS)
            except TrajectoryError:
                continue
            assert math.isfinite(trajectory.duration_s)
            for i in range(20):
                assert trajectory.sample(trajectory.duration_s * i / 19).is_finite


@pytest.mark.parametrize("share", [0.05, 0.15, 0.3, 0.5, 0.7])
def test_a_sluggish_vehicle_is_redirected_twice_within_its_speed(share: float) -> None:
    # A jerk limit so low that the acceleration itself is worth more than the greatest speed.
    sluggish = dataclasses.replace(
        LIMITS, speed_horizontal_m_s=1.5, acceleration_horizontal_m_s2=4.0, jerk_m_s3=3.0
    )
    first = plan_to(KinematicState((0.0, 0.0, 10.0)), (4.0, 0.0, 10.0), sluggish)
    for degrees in range(0, 360, 15):
        angle = math.radians(degrees)
        goal = (9.0 * math.cos(angle), 9.0 * math.sin(angle), 11.0)
        second = plan_to(first.sample(share * first.duration_s), goal, sluggish)
        third = plan_to(second.sample(0.1 * second.duration_s), (-6.0, 6.0, 9.0), sluggish)
        for trajectory in (second, third):
            for i in range(200):
                state = trajectory.sample(trajectory.duration_s * i / 199)
                assert horizontal_norm(state.velocity_enu_m_s) <= 1.5 * 1.001


@pytest.mark.parametrize("degrees", range(30, 360, 30))
@pytest.mark.parametrize("length_m", [4.0, 8.0, 15.0])
def test_the_approach_after_a_turn_does_not_pass_the_goal(degrees: int, length_m: float) -> None:
    angle = math.radians(degrees)
    goal = (length_m * math.cos(angle), length_m * math.sin(angle), 10.0)
    start = KinematicState((0.0, 0.0, 10.0), (4.0, 0.0, 0.0))
    trajectory = plan_to(start, goal, LIMITS)
    distances = [
        distance(trajectory.sample(trajectory.duration_s * i / 400).position_enu_m, goal)
        for i in range(401)
    ]
    # The last metre is approached once and for good.
    close = max(i for i, d in enumerate(distances) if d > 0.5)
    assert all(b <= a + 1e-6 for a, b in pairwise(distances[close:]))
    assert min(distances[:close]) > 0.4


def test_a_turn_that_would_pass_the_goal_is_not_taken() -> None:
    # Found by search: without the check the fastest candidate goes 3 cm too far.
    start = KinematicState((0.0, 0.0, 10.0), (1.7505322899934779, 3.2919670068076616, 0.0))
    goal = (7.603049522255155, 3.564541620566505, 10.0)
    trajectory = plan_to(start, goal, LIMITS)
    assert trajectory.duration_s < 4.2
    offsets = [
        trajectory.sample(trajectory.duration_s * i / 400).position_enu_m[1] - goal[1]
        for i in range(200, 401)
    ]
    assert min(offsets) * max(offsets) >= -1e-9
