"""Cylinders and boxes: shapes, and distances of points and lines to them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from navigation_core.mapping.obstacles import NOTHING, Box, Cylinder, ObstacleError, Obstacles

POST = Cylinder("post", (10.0, 0.0), 1.0, 0.0, 5.0)
# A wall of 20 m from west to east, north of the origin.
WALL = Box("wall", (0.0, 10.0), (20.0, 0.0), 0.0, -math.inf, 8.0)
BOTH = Obstacles.of((POST, WALL))


def clearance(obstacles: Obstacles, *point: float) -> float:
    return float(obstacles.clearance_m(np.array([point]))[0])


@pytest.mark.parametrize(
    ("point", "expected_m"),
    [
        ((10.0, 0.0, 2.0), 0.0),
        ((7.0, 0.0, 2.0), 2.0),
        ((10.0, 0.0, 9.0), 4.0),
        ((10.0, 0.0, -3.0), 3.0),
        ((8.0, 0.0, 9.0), 4.0),
        ((5.0, 0.0, 6.0), 4.0),
    ],
)
def test_clearance_is_the_greater_of_beside_and_above(
    point: tuple[float, float, float], expected_m: float
) -> None:
    assert clearance(Obstacles.of((POST,)), *point) == pytest.approx(expected_m)


@pytest.mark.parametrize(
    ("point", "expected_m"),
    [
        ((0.0, 7.0, 0.0), 3.0),
        ((13.0, 14.0, 0.0), 5.0),
        ((0.0, 10.0, -1e6), 0.0),
        ((0.0, 10.0, 10.0), 2.0),
    ],
)
def test_a_wall_is_a_box_without_thickness(
    point: tuple[float, float, float], expected_m: float
) -> None:
    assert clearance(Obstacles.of((WALL,)), *point) == pytest.approx(expected_m)


def test_a_box_is_turned_counter_clockwise_from_east() -> None:
    turned = Obstacles.of((Box("box", (0.0, 0.0), (10.0, 2.0), math.radians(90.0)),))
    assert clearance(turned, 0.0, 4.0, 0.0) == pytest.approx(0.0)
    assert clearance(turned, 4.0, 0.0, 0.0) == pytest.approx(3.0)


def test_the_nearest_obstacle_counts() -> None:
    assert clearance(BOTH, 10.0, 4.0, 2.0) == pytest.approx(3.0)
    assert clearance(BOTH, 10.0, 7.0, 2.0) == pytest.approx(3.0)


def test_without_obstacles_everything_is_clear() -> None:
    assert clearance(NOTHING, 0.0, 0.0, 0.0) == math.inf
    assert NOTHING.is_clear((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 100.0)
    assert len(NOTHING.clearance_m(np.empty((0, 3)))) == 0
    assert len(BOTH.clearance_m(np.empty((0, 3)))) == 0
    assert len(BOTH.are_clear(np.empty((0, 3)), np.empty((0, 3)), 1.0)) == 0


@pytest.mark.parametrize(
    ("start", "end", "clear"),
    [
        ((0.0, 0.0, 2.0), (20.0, 0.0, 2.0), False),
        ((0.0, -2.5, 2.0), (20.0, -2.5, 2.0), True),
        ((0.0, -1.5, 2.0), (20.0, -1.5, 2.0), False),
        ((0.0, 0.0, 6.0), (20.0, 0.0, 6.0), True),
        ((0.0, 0.0, 5.5), (20.0, 0.0, 5.5), False),
        # It climbs beside the post, and is above it by the time that it is there.
        ((0.0, 0.0, 2.0), (10.0, 0.0, 12.0), True),
        ((10.0, 0.0, 20.0), (10.0, 0.0, 7.0), True),
        ((10.0, 0.0, 20.0), (10.0, 0.0, 4.0), False),
        # Neither end is near the wall, the line goes through.
        ((1.0, 5.0, 2.0), (2.0, 15.0, 2.0), False),
        ((1.0, 5.0, 9.5), (2.0, 15.0, 9.5), True),
        ((1.0, 8.5, 2.0), (2.0, 8.5, 2.0), True),
        ((1.0, 9.5, 2.0), (1.0, 9.5, 2.0), False),
    ],
)
def test_a_line_is_clear_only_if_all_of_it_is(
    start: tuple[float, float, float], end: tuple[float, float, float], clear: bool
) -> None:
    assert BOTH.is_clear(start, end, 1.0) is clear


def test_nothing_that_is_not_a_number_is_clear() -> None:
    nowhere = np.array([[math.nan, 0.0, 2.0]])
    assert math.isnan(BOTH.clearance_m(nowhere)[0])
    assert not BOTH.are_clear(nowhere, nowhere, 1.0)[0]
    assert not BOTH.are_clear(np.array([[0.0, 0.0, math.nan]]), np.array([[20.0, 0.0, 1.0]]), 1.0)


def test_near_keeps_what_is_within_reach_of_a_cuboid() -> None:
    near = BOTH.near((0.0, 0.0, 0.0), (8.0, 1.0, 2.0), 1.0)
    assert (len(near.posts), len(near.boxes)) == (1, 1)
    assert len(BOTH.near((0.0, -1.0, 0.0), (7.0, -0.5, 2.0), 1.0).posts) == 0
    assert len(BOTH.near((10.0, 0.0, 6.5), (10.0, 0.0, 7.5), 1.0).posts) == 0
    assert len(BOTH.near((10.0, 0.0, 9.5), (10.0, 0.0, 9.7), 1.0)) == 0


def test_between_keeps_what_has_a_part_between_two_heights() -> None:
    assert len(BOTH.between(5.0, 7.0).posts) == 0
    assert len(BOTH.between(4.0, 7.0)) == 2
    assert len(BOTH.between(-9.0, -1.0)) == 1
    assert len(BOTH.between(8.0, 9.0)) == 0


def test_joined_holds_both_and_does_not_copy_in_vain() -> None:
    posts, boxes = Obstacles.of((POST,)), Obstacles.of((WALL,))
    joined = posts.joined(boxes)
    assert (len(joined.posts), len(joined.boxes), len(joined)) == (1, 1, 2)
    assert posts.joined(NOTHING) is posts
    assert NOTHING.joined(posts) is posts


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: Cylinder("c", (0.0, math.nan), 1.0), "finite"),
        (lambda: Cylinder("c", (0.0, 0.0), math.inf), "finite"),
        (lambda: Cylinder("c", (0.0, 0.0), 0.0), "more than 0"),
        (lambda: Cylinder("c", (0.0, 0.0), 1.0, 3.0, 3.0), "not below its top"),
        (lambda: Cylinder("c", (0.0, 0.0), 1.0, math.nan), "not below its top"),
        (lambda: Box("b", (0.0, 0.0), (0.0, 0.0)), "more than 0"),
        (lambda: Box("b", (0.0, 0.0), (1.0, -1.0)), "give 0 or more"),
        (lambda: Box("b", (0.0, 0.0), (1.0, math.nan)), "finite"),
        (lambda: Box("b", (0.0, 0.0), (1.0, 1.0), math.inf), "finite"),
        (lambda: Box("b", (0.0, 0.0), (1.0, 1.0), 0.0, 4.0, 3.0), "not below its top"),
    ],
)  # fmt: skip
def test_a_shape_that_is_none_is_rejected_with_a_sentence(build: object, sentence: str) -> None:
    assert callable(build)
    with pytest.raises(ObstacleError, match=sentence):
        build()
