"""The grid of obstacles: where cells lie, what they hold, and what is not claimed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from navigation_core.mapping.obstacles import Box, Cylinder, Obstacles
from navigation_core.mapping.occupancy import OCCUPIED, UNKNOWN, GridWindow, occupancy

WINDOW = GridWindow.about(10.0, -20.0, 40.0, 0.5)


def occupied(obstacles: Obstacles, window: GridWindow = WINDOW) -> set[tuple[float, float]]:
    """Return east and north of the middles of the occupied cells."""
    cells = occupancy(obstacles, window)
    assert cells.shape == (window.count, window.count)
    assert set(np.unique(cells)) <= {OCCUPIED, UNKNOWN}
    return {
        (
            (window.west_cell + column + 0.5) * window.cell_m,
            (window.south_cell + row + 0.5) * window.cell_m,
        )
        for row, column in np.argwhere(cells == OCCUPIED).tolist()
    }


def cylinder(east_m: float, north_m: float, radius_m: float) -> Cylinder:
    return Cylinder("post", (east_m, north_m), radius_m, 0.0, 5.0)


def test_the_window_is_about_the_place_and_aligned() -> None:
    assert (WINDOW.west_cell, WINDOW.south_cell, WINDOW.count) == (-20, -80, 80)


def test_nothing_is_unknown_and_not_free() -> None:
    assert (occupancy(Obstacles(), WINDOW) == UNKNOWN).all()


def test_rows_go_north_and_columns_east() -> None:
    cells = occupancy(Obstacles.of((cylinder(9.9, -21.1, 0.1),)), WINDOW)
    assert np.argwhere(cells == OCCUPIED).tolist() == [[37, 39]]


@pytest.mark.parametrize("radius_m", [0.18, 0.9, 2.4, 3.6, 12.0])
def test_a_post_fills_its_circle(radius_m: float) -> None:
    found = occupied(Obstacles.of((cylinder(8.3, -18.7, radius_m),)))
    step, low = WINDOW.cell_m, (-9.75, -39.75)
    middles = [(low[0] + i * step, low[1] + j * step) for i in range(80) for j in range(80)]
    inside = {m for m in middles if math.dist(m, (8.3, -18.7)) < radius_m}
    assert found == inside | {(8.25, -18.75)}


def test_a_thin_wall_has_no_gap_and_follows_its_yaw() -> None:
    wall = Box("wall", (10.0, -20.0), (12.0, 0.1), math.radians(30.0), 0.0, 3.0)
    found = occupied(Obstacles.of((wall,)))
    for along_m in np.arange(-5.9, 5.9, 0.1):
        east = 10.0 + along_m * math.cos(math.radians(30.0))
        north = -20.0 + along_m * math.sin(math.radians(30.0))
        assert any(math.dist((east, north), middle) < 0.5 for middle in found)
    assert all(abs((n + 20.0) * math.cos(0.5236) - (e - 10.0) * 0.5) < 0.3 for e, n in found)


def test_what_lies_outside_the_window_is_left_out() -> None:
    outside = (cylinder(100.0, 0.0, 0.2), cylinder(100.0, 0.0, 30.0))
    box = Box("box", (-50.0, -20.0), (10.0, 10.0), 0.3, 0.0, 3.0)
    assert not occupied(Obstacles.of((*outside, box)))
    assert occupied(Obstacles.of((cylinder(-20.0, -20.0, 11.0),)))
