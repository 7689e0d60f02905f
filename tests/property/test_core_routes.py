"""Routes: continuous, within the limits, close to their corners, without needless stops."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navigation_core.geometry import KinematicState, Vector3, distance, norm, subtract
from navigation_core.limits import Limits
from navigation_core.trajectories.route_trajectory import RoutePoint, RouteTrajectory, plan_route
from navigation_core.trajectories.trajectory import TrajectoryError

LIMITS = Limits(
    speed_horizontal_m_s=5.0,
    speed_up_m_s=2.0,
    speed_down_m_s=1.5,
    acceleration_vertical_m_s2=1.5,
    jerk_m_s3=4.0,
)
_STEP_S = 0.02

coordinates = st.floats(-60.0, 60.0, allow_nan=False).map(lambda value: round(value, 1))
heights = st.floats(2.0, 30.0, allow_nan=False).map(lambda value: round(value, 1))
places = st.tuples(coordinates, coordinates, heights)
speeds = st.floats(-4.0, 4.0, allow_nan=False)


def points(*positions: Vector3, corner_m: float = 1.0) -> list[RoutePoint]:
    return [RoutePoint(position, corner_m, LIMITS) for position in positions]


def speed_at(route: RouteTrajectory, index: int) -> float:
    return norm(route.trajectory.sample(route.passed_s[index]).velocity_enu_m_s)


def _to_polyline(place: Vector3, corners: list[Vector3]) -> float:
    return min(_to_segment(place, a, b) for a, b in itertools.pairwise(corners))


def _to_segment(place: Vector3, a: Vector3, b: Vector3) -> float:
    line, offset = subtract(b, a), subtract(place, a)
    length = sum(part * part for part in line)
    share = sum(p * q for p, q in zip(line, offset, strict=True)) / length if length else 0.0
    share = min(max(share, 0.0), 1.0)
    nearest = (a[0] + share * line[0], a[1] + share * line[1], a[2] + share * line[2])
    return distance(place, nearest)


def test_points_on_a_line_are_passed_at_full_speed() -> None:
    route = plan_route(
        KinematicState((0.0, 0.0, 5.0)),
        points((30.0, 0.0, 5.0), (60.0, 0.0, 5.0), (90.0, 0.0, 5.0)),
    )
    assert speed_at(route, 0) == pytest.approx(LIMITS.speed_horizontal_m_s, rel=0.01)
    assert speed_at(route, 1) == pytest.approx(LIMITS.speed_horizontal_m_s, rel=0.01)
    assert speed_at(route, 2) == pytest.approx(0.0, abs=1e-6)


def test_a_right_angle_is_flown_without_a_stop_and_near_its_corner() -> None:
    corner = (30.0, 0.0, 5.0)
    route = plan_route(KinematicState((0.0, 0.0, 5.0)), points(corner, (30.0, 30.0, 5.0)))
    assert speed_at(route, 0) > 1.0
    place = route.trajectory.sample(route.passed_s[0]).position_enu_m
    assert distance(place, corner) == pytest.approx(1.0, abs=0.01)


def test_a_wider_corner_is_taken_faster() -> None:
    positions = ((30.0, 0.0, 5.0), (30.0, 30.0, 5.0))
    start = KinematicState((0.0, 0.0, 5.0))
    narrow = plan_route(start, points(*positions, corner_m=0.2))
    wide = plan_route(start, points(*positions, corner_m=3.0))
    assert speed_at(wide, 0) > speed_at(narrow, 0) > 0.0
    assert wide.trajectory.duration_s < narrow.trajectory.duration_s


def test_a_point_without_a_corner_and_a_reversal_are_stops() -> None:
    start = KinematicState((0.0, 0.0, 5.0))
    stop = plan_route(start, points((30.0, 0.0, 5.0), (60.0, 0.0, 5.0), corner_m=0.0))
    back = plan_route(start, points((30.0, 0.0, 5.0), (0.0, 0.0, 5.0)))
    assert speed_at(stop, 0) == pytest.approx(0.0, abs=1e-6)
    # Turning round on the spot: hardly any speed is left where the direction is reversed.
    assert speed_at(back, 0) < 0.1


def test_a_leg_keeps_to_its_own_limits() -> None:
    slow = LIMITS.with_speed(1.0)
    route = plan_route(
        KinematicState((0.0, 0.0, 5.0)),
        [RoutePoint((30.0, 0.0, 5.0), 1.0, LIMITS), RoutePoint((60.0, 0.0, 5.0), 1.0, slow)],
    )
    assert speed_at(route, 0) <= 1.0 + 1e-6
    middle = route.trajectory.sample(0.5 * route.passed_s[0])
    assert norm(middle.velocity_enu_m_s) > 3.0


def test_a_slow_leg_is_neither_entered_nor_left_too_fast() -> None:
    limits = (LIMITS, LIMITS.with_speed(1.0), LIMITS)
    corners = ((30.0, 0.0, 5.0), (30.0, 30.0, 5.0), (60.0, 30.0, 5.0))
    legs = [RoutePoint(at, 1.0, of) for at, of in zip(corners, limits, strict=True)]
    route = plan_route(KinematicState((0.0, 0.0, 5.0)), legs)
    trajectory = route.trajectory
    for time_s in np.arange(0.0, trajectory.duration_s, 0.01):
        speed_m_s = norm(trajectory.sample(time_s).velocity_enu_m_s)
        leg = sum(passed_s < time_s for passed_s in route.passed_s)
        assert speed_m_s <= limits[leg].speed_horizontal_m_s + 1e-6
        assert speed_m_s <= trajectory.at(time_s)[1].speed_horizontal_m_s + 1e-6
    middle = trajectory.sample(0.5 * route.passed_s[0])
    assert norm(middle.velocity_enu_m_s) > 3.0


def test_no_point_and_a_number_that_is_not_finite_are_rejected() -> None:
    start = KinematicState((0.0, 0.0, 5.0))
    with pytest.raises(TrajectoryError, match="at least one point"):
        plan_route(start, [])
    with pytest.raises(TrajectoryError, match="NaN"):
        plan_route(start, points((math.nan, 0.0, 5.0)))


@settings(deadline=None)
@given(places, st.lists(places, min_size=1, max_size=5), speeds, speeds)
def test_every_route_is_continuous_and_within_its_limits(
    start: Vector3, positions: list[Vector3], east: float, north: float
) -> None:
    state = KinematicState(start, (0.0, 0.0, 0.0) if east < 0.0 else (east, north * 0.5, 0.0))
    route = plan_route(state, points(*positions))
    trajectory = route.trajectory
    assert list(route.passed_s) == sorted(route.passed_s)
    assert distance(trajectory.sample(trajectory.duration_s).position_enu_m, positions[-1]) < 1e-3
    for position, passed_s in zip(positions, route.passed_s, strict=True):
        assert distance(trajectory.sample(passed_s).position_enu_m, position) <= 1.0 + 1e-3
    before = trajectory.sample(0.0)
    speed_max = max(LIMITS.speed_horizontal_m_s, math.hypot(east, north)) + 1e-3
    for i in range(1, int(trajectory.duration_s / _STEP_S)):
        now = trajectory.sample(i * _STEP_S)
        assert distance(now.position_enu_m, before.position_enu_m) <= speed_max * 1.3 * _STEP_S
        change = norm(subtract(now.velocity_enu_m_s, before.velocity_enu_m_s))
        assert change <= 3.0 * _STEP_S
        assert math.hypot(*now.velocity_enu_m_s[:2]) <= speed_max
        before = now


@settings(deadline=None)
@given(places, st.lists(places, min_size=2, max_size=5))
def test_from_rest_a_route_stays_near_its_lines(start: Vector3, positions: list[Vector3]) -> None:
    route = plan_route(KinematicState(start), points(*positions))
    corners = [start, *positions]
    trajectory = route.trajectory
    for i in range(int(trajectory.duration_s / 0.1)):
        assert _to_polyline(trajectory.sample(i * 0.1).position_enu_m, corners) <= 1.0 + 1e-3


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=6))
def test_a_level_route_keeps_to_acceleration_and_jerk(corners: list[tuple[float, float]]) -> None:
    """Also where a turn begins before the brake ahead of it has ended."""
    start, *positions = [(east, north, 5.0) for east, north in corners]
    trajectory = plan_route(KinematicState(start), points(*positions)).trajectory
    times_s = np.arange(0.0, trajectory.duration_s, _STEP_S)
    if len(times_s) < 2:
        return
    places, velocities, accelerations = trajectory.samples(times_s)
    assert np.linalg.norm(accelerations, axis=1).max() <= LIMITS.acceleration_horizontal_m_s2 + 1e-6
    jerks = np.linalg.norm(np.diff(accelerations, axis=0), axis=1) / _STEP_S
    assert jerks.max() <= 1.01 * LIMITS.jerk_m_s3 + 1e-6
    # The given acceleration must be the derivative of velocity, and velocity that of position.
    for of, changes in ((velocities, accelerations), (places, velocities)):
        middle = 0.5 * (changes[1:] + changes[:-1])
        assert np.abs(np.diff(of, axis=0) - _STEP_S * middle).max() <= LIMITS.jerk_m_s3 * _STEP_S**2
    states = list(zip(times_s, places, velocities, accelerations, strict=True))
    for time_s, *state in states[::10]:
        one = trajectory.sample(float(time_s))
        alone = (one.position_enu_m, one.velocity_enu_m_s, one.acceleration_enu_m_s2)
        assert np.allclose(alone, state, atol=1e-6)


def test_a_turn_begins_before_the_brake_ahead_of_it_has_ended() -> None:
    start = KinematicState((0.0, 0.0, 5.0))
    for turn_deg, overlaps in ((30.0, False), (60.0, True), (90.0, True), (170.0, True)):
        angle = math.radians(turn_deg)
        beyond = (30.0 + 30.0 * math.cos(angle), 30.0 * math.sin(angle), 5.0)
        route = plan_route(start, points((30.0, 0.0, 5.0), beyond, corner_m=0.2))
        times_s = np.arange(1.0, route.trajectory.duration_s - 1.0, 0.01)
        _, velocities, accelerations = route.trajectory.samples(times_s)
        is_slower = np.linalg.norm(velocities, axis=1) < 0.99 * LIMITS.speed_horizontal_m_s
        free = np.linalg.norm(accelerations, axis=1) < 0.05
        assert (free & is_slower).any() != overlaps, turn_deg
