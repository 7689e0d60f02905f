"""Errors of tracking, as Nav2 defines them: left of the path is positive."""

from __future__ import annotations

import math

import pytest

from drone_navigation.nav2.tracking import tracking_errors

EAST = ((0.0, 0.0, 5.0), (10.0, 0.0, 5.0))


@pytest.mark.parametrize(
    ("position", "left_m"),
    [((4.0, 1.5, 5.0), 1.5), ((4.0, -1.5, 5.0), -1.5), ((12.0, 1.0, 5.0), 1.0)],
)
def test_left_of_a_path_is_positive(position: tuple[float, float, float], left_m: float) -> None:
    assert tracking_errors(EAST, position) == (pytest.approx(left_m), 0.0)


def test_the_leg_that_is_nearest_counts() -> None:
    path = (*EAST, (10.0, 10.0, 5.0))
    errors = tracking_errors(path, (10.5, 6.0, 5.0))
    assert errors == (pytest.approx(-0.5), pytest.approx(math.pi / 2.0))


def test_of_two_legs_above_each_other_that_at_the_vehicles_height_counts() -> None:
    path = (*EAST, (10.0, 0.0, 9.0), (0.0, 0.0, 9.0))
    errors = tracking_errors(path, (5.0, 1.0, 9.0))
    assert errors == (pytest.approx(-1.0), pytest.approx(math.pi))


@pytest.mark.parametrize("path", [(), EAST[:1], ((0.0, 0.0, 0.0), (0.0, 0.0, 5.0))])
def test_a_path_that_leads_nowhere_has_none(path: tuple[tuple[float, float, float], ...]) -> None:
    assert tracking_errors(path, (0.0, 1.0, 0.0)) is None
