"""Properties of the obstacle map, with any scans from anywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_map import ObstacleMap, RayScan
from navigation_core.mapping.obstacles import NOTHING, Box, Cylinder, Obstacles
from tests.support.worlds.range_scanner import level_ring, pitched, sectors

_SIZE_M = 30.0

angles = st.floats(-4.0, 4.0)
places = st.tuples(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0), st.floats(-2.0, 40.0))
ranges = st.one_of(
    st.floats(0.0, 60.0), st.sampled_from([math.inf, math.nan, -1.0, -math.inf, 0.0])
)
grounds = st.one_of(st.none(), st.floats(-50.0, 50.0), st.just(math.nan))


@st.composite
def scans(draw: st.DrawFn) -> RayScan:
    beams = draw(st.integers(1, 24))
    pitch = draw(st.floats(-1.6, 1.6))
    return RayScan(
        draw(places),
        pitched(level_ring(beams, draw(angles)), pitch),
        np.array(draw(st.lists(ranges, min_size=beams, max_size=beams))),
        draw(st.floats(0.0, 1.0)),
        draw(st.floats(1.0, 50.0)),
        draw(st.floats(0.0, 1.0)),
    )


@pytest.mark.wide
@given(st.lists(st.tuples(scans(), grounds), max_size=12), st.booleans())
def test_whatever_it_reads_its_obstacles_are_sound_few_and_within_the_window(
    told: list[tuple[RayScan, float | None]], as_points: bool
) -> None:
    seen, size_m = ObstacleMap(_SIZE_M, 0.5, 0.4), _SIZE_M
    for scan, ground in told:
        seen.recentre(scan.origin_enu_m)
        for _ in range(2):
            seen.integrate(scan, ground, 0.0)
        if as_points:
            rays = np.where(np.isfinite(scan.ranges_m), scan.ranges_m, np.nan)[:, None]
            points = np.array(scan.origin_enu_m) + rays * scan.directions_enu
            seen.integrate_points(scan.origin_enu_m, points, ground, 0.0)
        posts = seen.obstacles().posts
        assert len(posts) <= (size_m / 0.5) ** 2
        assert not np.isnan(posts).any()
        assert (posts[:, 3] < posts[:, 4]).all()
        aside = np.abs(posts[:, :2] - np.array(scan.origin_enu_m[:2]))
        assert (aside <= 0.5 * size_m + 0.5).all()
        assert seen.obstacles() is seen.obstacles()


@settings(max_examples=20)
@given(angles, st.floats(3.0, 18.0), angles, st.floats(0.1, 1.5), st.floats(-0.1, 0.1))
def test_what_is_there_is_found_wherever_it_stands_and_freed_when_it_is_gone(
    bearing: float, away_m: float, yaw: float, radius_m: float, pitch: float
) -> None:
    at = (away_m * math.cos(bearing), away_m * math.sin(bearing))
    origin: Vector3 = (0.0, 0.0, 5.0)
    seen = ObstacleMap()
    post = Obstacles.of((Cylinder("post", at, radius_m),))
    for _ in range(4):
        seen.integrate(sectors(post, origin, yaw, nose_up_rad=pitch), 0.0, 0.0)
    front = (away_m - radius_m) / away_m
    found = seen.obstacles().clearance_m(np.array([[at[0] * front, at[1] * front, 5.0]]))
    # A thin post may be anywhere on the arc of its sector.
    assert found[0] <= 0.3 + away_m * math.radians(2.5)
    for _ in range(5):
        seen.integrate(sectors(NOTHING, origin, yaw, nose_up_rad=pitch), 0.0, 0.0)
    assert len(seen.obstacles()) == 0


@pytest.mark.wide
@settings(max_examples=20)
@given(st.tuples(st.integers(-400, 400), st.integers(-400, 400)), angles)
def test_everything_is_the_same_a_whole_number_of_columns_further_on(
    moved: tuple[int, int], yaw: float
) -> None:
    # Steps that binary numbers hold exactly, so that nothing is rounded another way.
    east, north = 0.25 * moved[0], 0.25 * moved[1]
    here, there = ObstacleMap(), ObstacleMap()
    there.recentre((east, north, 0.0))
    house = sectors(
        Obstacles.of((Box("house", (9.0, 2.0), (4.0, 3.0), 0.4),)), (0.0, 0.0, 5.0), yaw
    )
    shifted = RayScan(
        (east, north, 5.0), house.directions_enu, house.ranges_m, 0.2, 40.0, house.half_angle_rad
    )
    for _ in range(3):
        here.integrate(house, 0.0, 0.0)
        there.integrate(shifted, 0.0, 0.0)
    expected = here.obstacles().posts + np.array([east, north, 0.0, 0.0, 0.0])
    found = there.obstacles().posts
    assert len(found) == len(expected) > 0
    order, expected_order = np.lexsort(found[:, :2].T), np.lexsort(expected[:, :2].T)
    np.testing.assert_allclose(found[order], expected[expected_order])


@given(st.lists(places, max_size=20))
def test_rolling_forgets_exactly_what_leaves_the_window(steps: list[Vector3]) -> None:
    seen = ObstacleMap(_SIZE_M, 0.5)
    wall = RayScan((0.0, 0.0, 5.0), level_ring(72), np.full(72, 8.0), 0.2, 40.0, 0.04)
    for _ in range(3):
        seen.integrate(wall, 0.0, 0.0)
    kept = seen.obstacles().posts[:, :2]
    for step in steps:
        near = (step[0] / 12.0, step[1] / 12.0, step[2])
        seen.recentre(near)
        first = np.floor(np.array(near[:2]) / 0.5) * 0.5 - 0.5 * _SIZE_M
        kept = kept[((kept > first) & (kept < first + _SIZE_M)).all(axis=1)]
        found = seen.obstacles().posts[:, :2]
        assert sorted(map(tuple, found)) == sorted(map(tuple, kept))
