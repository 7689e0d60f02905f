"""Clearances against the simplest calculation: one obstacle, one point of a line at a time."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from navigation_core.mapping.obstacles import Array, Box, Cylinder, KnownObstacle, Obstacles

Point = tuple[float, float, float]

coordinates = st.floats(-20.0, 20.0, allow_nan=False)
sizes = st.floats(0.1, 8.0, allow_nan=False)
points = st.tuples(coordinates, coordinates, coordinates)
# Level, upright and pointlike lines are the ones that go wrong.
lines = st.one_of(
    st.tuples(points, points),
    st.tuples(points, points).map(lambda line: (line[0], (*line[1][:2], line[0][2]))),
    st.tuples(points, coordinates).map(lambda line: (line[0], (*line[0][:2], line[1]))),
    points.map(lambda point: (point, point)),
)
bottoms = st.one_of(st.just(-math.inf), coordinates)
heights = st.one_of(st.just(math.inf), sizes)


@st.composite
def known(draw: st.DrawFn) -> KnownObstacle:
    bottom_m = draw(bottoms)
    top_m = draw(coordinates) if bottom_m == -math.inf else bottom_m + draw(heights)
    centre = (draw(coordinates), draw(coordinates))
    if draw(st.booleans()):
        return Cylinder("cylinder", centre, draw(sizes), bottom_m, top_m)
    width = draw(st.one_of(st.just(0.0), sizes))
    yaw = draw(st.floats(-7.0, 7.0))
    return Box("box", centre, (draw(sizes), width), yaw, bottom_m, top_m)


def gap_m(point: Point, obstacle: KnownObstacle) -> float:
    """Clearance of one point to one obstacle, as the module defines it."""
    east, north = point[0] - obstacle.centre_enu_m[0], point[1] - obstacle.centre_enu_m[1]
    if isinstance(obstacle, Cylinder):
        beside = math.hypot(east, north) - obstacle.radius_m
    else:
        angle = math.atan2(north, east) - obstacle.yaw_enu_rad
        away = math.hypot(east, north)
        x = abs(away * math.cos(angle)) - 0.5 * obstacle.size_m[0]
        y = abs(away * math.sin(angle)) - 0.5 * obstacle.size_m[1]
        beside = math.hypot(max(x, 0.0), max(y, 0.0))
    return max(beside, obstacle.bottom_m - point[2], point[2] - obstacle.top_m, 0.0)


def along(start: Point, end: Point, count: int) -> Array:
    shares = np.linspace(0.0, 1.0, count)[:, None]
    return np.asarray(np.array(start) + shares * (np.array(end) - np.array(start)))


@given(st.lists(known(), min_size=1, max_size=12), st.lists(points, min_size=1, max_size=80))
def test_clearance_is_that_of_the_nearest_taken_one_by_one(
    obstacles: list[KnownObstacle], places: list[Point]
) -> None:
    expected = [min(gap_m(place, obstacle) for obstacle in obstacles) for place in places]
    found = Obstacles.of(tuple(obstacles)).clearance_m(np.array(places))
    np.testing.assert_allclose(found, expected, atol=1e-9)


@settings(max_examples=300)
@given(st.lists(known(), max_size=6), st.lists(lines, min_size=1, max_size=4), st.floats(0.1, 6.0))
def test_a_line_is_clear_exactly_if_all_its_points_are(
    obstacles: list[KnownObstacle], some: list[tuple[Point, Point]], clearance_m: float
) -> None:
    table = Obstacles.of(tuple(obstacles))
    starts, ends = np.array([line[0] for line in some]), np.array([line[1] for line in some])
    for line, clear in zip(some, table.are_clear(starts, ends, clearance_m), strict=True):
        samples = along(*line, 200)
        least_m = table.clearance_m(samples).min()
        step_m = math.dist(*line) / 199
        if clear:
            assert least_m >= clearance_m - 1e-6
        else:
            # Between two samples it may come nearer by half of what lies between them.
            assert least_m <= clearance_m + 0.5 * step_m + 1e-6


@given(st.lists(known(), max_size=8), points, points, st.floats(0.0, 6.0))
def test_what_is_near_is_all_that_matters_within_that_distance(
    obstacles: list[KnownObstacle], start: Point, end: Point, within_m: float
) -> None:
    table = Obstacles.of(tuple(obstacles))
    corners = np.array([start, end])
    low, high = tuple(corners.min(axis=0)), tuple(corners.max(axis=0))
    near = table.near(low, high, within_m)
    samples = along(start, end, 20)
    np.testing.assert_allclose(
        np.minimum(near.clearance_m(samples), within_m),
        np.minimum(table.clearance_m(samples), within_m),
        atol=1e-9,
    )  # fmt: skip
