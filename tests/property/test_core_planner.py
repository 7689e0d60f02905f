"""Paths around obstacles in random worlds: always clear, never missed, rarely long."""

from __future__ import annotations

import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.planner import NoPath, Path, PlanLimits, plan
from tests.support.worlds.random_worlds import (
    CLEARANCE_M,
    KINDS,
    World,
    cell_graph,
    free_grid,
    path_exists,
    random_world,
)

_CELL_M = 0.5
_HEIGHTS_M = (1.0, 30.0)

seeds = st.integers(0, 2**32 - 1)
counts = st.integers(1, 60)
kinds = st.sampled_from(KINDS)


def planned(world: World, limits: PlanLimits) -> Path | NoPath:
    """Plan twice, and check what holds for every answer."""
    answer = plan(world.start_enu_m, world.goal_enu_m, world.obstacles, limits)
    # Tables of their own: nothing remembered makes a difference.
    again = plan(world.start_enu_m, world.goal_enu_m, Obstacles.of(world.fixed), limits)
    assert answer == again
    if isinstance(answer, Path):
        assert answer.points_enu_m[0] == world.start_enu_m
        assert answer.points_enu_m[-1] == world.goal_enu_m
        for a, b in itertools.pairwise(answer.points_enu_m):
            assert world.obstacles.is_clear(a, b, limits.clearance_m)
        low, high = limits.heights_m or (world.start_enu_m[2],) * 2
        assert all(low <= point[2] <= high for point in answer.points_enu_m)
    return answer


def grid_length_m(world: World, clearance_m: float) -> float:
    """Return the length of the shortest way from cell to cell, infinity if there is none."""
    free, low = free_grid(
        world.obstacles, world.start_enu_m, world.goal_enu_m, clearance_m, _CELL_M
    )
    cells = np.arange(free.size).reshape(free.shape)
    graph = cell_graph(free, _CELL_M)
    start, goal = (_cell(point, low, cells) for point in (world.start_enu_m, world.goal_enu_m))
    return float(dijkstra(graph, directed=False, indices=np.array([start]))[0, goal])


def _cell(
    point: tuple[float, float, float], low: NDArray[np.float64], cells: NDArray[np.intp]
) -> int:
    row, column = ((np.array(point[:2]) - low) / _CELL_M).astype(int)
    return int(cells[row, column])


@settings(max_examples=30, deadline=None)
@given(seeds, counts, kinds)
def test_a_path_that_a_coarse_grid_finds_is_found_and_no_longer(
    seed: int, count: int, kind: str
) -> None:
    world = random_world(seed, count, kind)
    answer = planned(world, PlanLimits(CLEARANCE_M))
    # With this much more clearance each line between two free cells has enough.
    length_m = grid_length_m(world, CLEARANCE_M + 0.75 * _CELL_M)
    if math.isfinite(length_m):
        assert isinstance(answer, Path)
        assert answer.length_m <= 1.01 * length_m + 2.0 * _CELL_M


@settings(max_examples=12, deadline=None)
@given(seeds, counts, st.sampled_from(["gap", "maze", "closed"]))
def test_no_path_is_said_only_where_there_is_none(seed: int, count: int, kind: str) -> None:
    world = random_world(seed, count, kind)
    answer = planned(world, PlanLimits(CLEARANCE_M))
    ends = world.start_enu_m, world.goal_enu_m
    if isinstance(answer, NoPath):
        assert not path_exists(world.obstacles, *ends, 1.02 * CLEARANCE_M, 0.2)
    else:
        assert path_exists(world.obstacles, *ends, 0.9 * CLEARANCE_M, 0.2)


@settings(max_examples=25, deadline=None)
@given(seeds, counts, kinds, st.floats(2.0, 12.0))
def test_paths_over_low_obstacles_are_clear_and_no_longer_than_around(
    seed: int, count: int, kind: str, top_m: float
) -> None:
    world = random_world(seed, count, kind, top_m=top_m)
    around = plan(world.start_enu_m, world.goal_enu_m, world.obstacles, PlanLimits(CLEARANCE_M))
    answer = planned(world, PlanLimits(CLEARANCE_M, _HEIGHTS_M))
    assert isinstance(answer, Path)
    if isinstance(around, Path):
        # Heights count for more than lengths, so what goes over is never much longer.
        assert answer.length_m <= 1.02 * around.length_m + 0.5


@settings(max_examples=15, deadline=None)
@given(seeds, st.integers(1, 30), kinds, st.floats(0.5, 6.0), st.floats(-3.1, 3.1))
def test_paths_of_what_turns_slowly_are_clear(
    seed: int, count: int, kind: str, radius_m: float, heading_rad: float
) -> None:
    world = random_world(seed, count, kind)
    planned(world, PlanLimits(CLEARANCE_M, None, radius_m, heading_rad))
