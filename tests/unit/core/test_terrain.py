"""Paths over a grid of heights stay near a height above the ground."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from navigation_core.surveys.terrain import (
    Terrain,
    TerrainError,
    TerrainGrid,
    slopes,
    tolerance_m,
)

FLAT = TerrainGrid((-10.0, 5.0), 4.0, 6, np.full(30, 7.0))


def path(grid: TerrainGrid, *places: tuple[float, float], height_m: float = 10.0) -> NDArray:  # type: ignore[type-arg]
    return Terrain(grid).along(np.array(places[0]), np.array(places[1]), height_m, 1000)


@given(
    heights=st.lists(st.floats(-30.0, 30.0), min_size=42, max_size=42),
    places=st.tuples(*[st.floats(0.0, 1.0)] * 4),
    height_m=st.floats(2.0, 60.0),
    resolution_m=st.floats(0.5, 30.0),
)
@settings(max_examples=60, deadline=None)
def test_any_path_is_within_the_tolerance_of_the_ground_everywhere(
    heights: list[float], places: tuple[float, ...], height_m: float, resolution_m: float
) -> None:
    grid = TerrainGrid((3.0, -8.0), resolution_m, 7, np.array(heights))
    x, y = 3.0 + resolution_m * np.arange(7), -8.0 + resolution_m * np.arange(6)
    ground = RegularGridInterpolator(
        (x, y), np.array(heights).reshape(6, 7).T, bounds_error=False, fill_value=None
    )
    first, last = (
        np.array([3.0 + 6.0 * resolution_m * a, -8.0 + 5.0 * resolution_m * b])
        for a, b in (places[:2], places[2:])
    )
    points = Terrain(grid).along(first, last, height_m, 1000)
    assert np.allclose(points[[0, -1], :2], [first, last])
    for begin, end in itertools.pairwise(points):
        flown = begin + np.linspace(0.0, 1.0, 200)[:, None] * (end - begin)
        off_m = flown[:, 2] - height_m - ground(flown[:, :2])
        assert np.abs(off_m).max() <= tolerance_m(height_m) + 1e-6


def test_over_flat_ground_no_waypoint_is_added() -> None:
    assert path(FLAT, (-10.0, 5.0), (10.0, 21.0)).tolist() == [[-10, 5, 17], [10, 21, 17]]


def test_a_ridge_between_two_waypoints_is_climbed_and_a_low_one_is_not() -> None:
    heights = np.zeros((3, 11))
    heights[:, 5] = 3.0
    ridge = TerrainGrid((0.0, 0.0), 10.0, 11, heights.ravel())
    points = path(ridge, (0.0, 10.0), (100.0, 10.0))
    assert [50.0, 10.0, 13.0] in points.tolist()
    assert slopes(points) == (pytest.approx(0.3, abs=0.05), pytest.approx(0.3, abs=0.05))
    # 3 m are within a tenth of 40 m.
    assert len(path(ridge, (0.0, 10.0), (100.0, 10.0), height_m=40.0)) == 2


def test_a_hollow_within_one_cell_is_found() -> None:
    # A saddle: along its diagonal the ground is as high at both ends, and lower between.
    saddle = TerrainGrid((0.0, 0.0), 10.0, 2, np.array([20.0, 0.0, 0.0, 20.0]))
    assert [5.0, 5.0, 20.0] in path(saddle, (0.0, 0.0), (10.0, 10.0)).tolist()


def test_unknown_heights_matter_only_where_they_are_passed() -> None:
    heights = np.full(30, 7.0)
    heights[29] = math.nan
    grid = TerrainGrid((-10.0, 5.0), 4.0, 6, heights)
    assert len(path(grid, (-10.0, 6.0), (10.0, 6.0))) == 2
    with pytest.raises(TerrainError, match=r"unknown at \(8\.0, 20\.0\) m"):
        path(grid, (-10.0, 20.0), (10.0, 20.0))


@pytest.mark.parametrize(
    ("grid", "reason"),
    [
        (TerrainGrid((0.0, 0.0), 0.0, 6, FLAT.heights_m), "more than 0 m"),
        (TerrainGrid((0.0, 0.0), math.nan, 6, FLAT.heights_m), "more than 0 m"),
        (TerrainGrid((math.inf, 0.0), 1.0, 6, FLAT.heights_m), "origin"),
        (TerrainGrid((0.0, 0.0), 1.0, 7, FLAT.heights_m), "30 heights in rows of 7"),
        (TerrainGrid((0.0, 0.0), 1.0, 0, FLAT.heights_m), "rows of 0"),
        (TerrainGrid((0.0, 0.0), 1.0, 30, FLAT.heights_m), "two whole rows"),
        (TerrainGrid((0.0, 0.0), 1.0, 6, FLAT.heights_m), "does not cover the path at"),
    ],
)
def test_what_is_no_grid_for_a_path_is_rejected(grid: TerrainGrid, reason: str) -> None:
    with pytest.raises(TerrainError, match=reason):
        path(grid, (0.0, 1.0), (9.0, 1.0))


def test_a_path_of_too_many_points_is_rejected() -> None:
    rough = TerrainGrid((0.0, 0.0), 10.0, 100, np.tile([0.0, 30.0], 100))
    assert len(Terrain(rough).along(np.zeros(2), np.array([990.0, 0.0]), 20.0, 100)) == 100
    with pytest.raises(TerrainError, match="more than 99 waypoints"):
        Terrain(rough).along(np.zeros(2), np.array([990.0, 0.0]), 20.0, 99)
