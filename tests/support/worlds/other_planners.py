"""Other ways to plan, to measure the planner beside: OMPL, and a search over a grid.

All of them plan in the plane. Their answers are checked exactly like any other path.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from navigation_core.planning.shortcuts import pulled_tight
from tests.support.worlds.random_worlds import CLEARANCE_M, World, cell_graph, free_grid

OMPL_PLANNERS = {
    "RRT-Connect": og.RRTConnect,
    "BIT*": og.BITstar,
    "Informed RRT*": og.InformedRRTstar,
}

# Half the diagonal of a cell is what a path may come nearer than the middles of its cells.
_FINE_M = 0.1
_COARSE_M = 0.25
_SQUARE = math.sqrt(0.5)
_MARGIN_M = 10.0


@dataclass(frozen=True)
class Checks:
    """How OMPL asks what is clear.

    Attributes:
        state: whether a place (east, north) is.
        motion: whether a line between two places is; None lets OMPL ask for places along it.
    """

    state: Callable[[float, float], bool]
    motion: Callable[[float, float, float, float], bool] | None


def exact_checks(world: World) -> Checks:
    """Return the checks the planner itself uses, through Python."""
    obstacles, height = world.obstacles, world.start_enu_m[2]

    def state(east: float, north: float) -> bool:
        return motion(east, north, east, north)

    def motion(east: float, north: float, to_east: float, to_north: float) -> bool:
        return obstacles.is_clear((east, north, height), (to_east, to_north, height), CLEARANCE_M)

    return Checks(state, motion)


def table_checks(world: World) -> Checks:
    """Return the quickest check in Python: a look into a table of small cells, made before."""
    clearance_m = CLEARANCE_M + _SQUARE * _FINE_M
    ends = world.start_enu_m, world.goal_enu_m
    free, low = free_grid(world.obstacles, *ends, clearance_m, _FINE_M)
    rows = [bytes(row) for row in free.astype(np.uint8)]
    east_0, north_0 = float(low[0]), float(low[1])
    east_n, north_n = free.shape

    def state(east: float, north: float) -> bool:
        column, row = int((east - east_0) / _FINE_M), int((north - north_0) / _FINE_M)
        if not (0 <= column < east_n and 0 <= row < north_n):
            return True
        return rows[column][row] == 1

    return Checks(state, None)


def ompl_path(
    world: World, name: str, seconds: float, seed: int, checks: Checks
) -> NDArray[np.float64] | None:
    """Return the points of a path by OMPL, shape (N, 3), shortened by its own means.

    Args:
        world: where.
        name: one of ``OMPL_PLANNERS``.
        seconds: of processor time to find a path; planners that continue to shorten it use all.
        seed: of its random numbers; OMPL takes one for a whole process only.
        checks: of what is clear.
    """
    ou.setLogLevel(ou.LOG_NONE)
    if seed:
        ou.RNG.setSeed(seed)
    space = ob.RealVectorStateSpace(2)
    space.setBounds(_bounds(world))
    setup = og.SimpleSetup(space)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(lambda state: checks.state(state[0], state[1]))
    if checks.motion is not None:
        information.setMotionValidator(_Motions(information, checks.motion))
    else:
        information.setStateValidityCheckingResolution(_FINE_M / space.getMaximumExtent())
    ends = []
    for point in (world.start_enu_m, world.goal_enu_m):
        state = space.allocState()
        state[0], state[1] = point[0], point[1]
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(OMPL_PLANNERS[name](information))
    # Its own limit is in wall time, and would be unfair on a busy machine.
    end_s = time.thread_time() + seconds
    late = ob.PlannerTerminationCondition(lambda: time.thread_time() > end_s)
    if not setup.solve(late) or not setup.haveExactSolutionPath():
        return None
    setup.simplifySolution(seconds)
    states = setup.getSolutionPath().getStates()
    return np.array([(state[0], state[1], world.start_enu_m[2]) for state in states])


class _Motions(ob.MotionValidator):  # type: ignore[misc]
    def __init__(
        self, information: object, clear: Callable[[float, float, float, float], bool]
    ) -> None:
        super().__init__(information)
        self._clear = clear

    def checkMotion(self, begin: list[float], end: list[float]) -> bool:  # noqa: N802
        return self._clear(begin[0], begin[1], end[0], end[1])


def _bounds(world: World) -> object:
    bounds = ob.RealVectorBounds(2)
    obstacles = world.obstacles
    reach = np.concatenate([obstacles.posts[:, 2], np.hypot(*obstacles.boxes[:, 2:4].T)])[:, None]
    middles = np.concatenate([obstacles.posts[:, :2], obstacles.boxes[:, :2]])
    ends = np.array([world.start_enu_m[:2], world.goal_enu_m[:2]])
    low = np.concatenate([middles - reach, ends]).min(axis=0) - _MARGIN_M
    high = np.concatenate([middles + reach, ends]).max(axis=0) + _MARGIN_M
    for axis in (0, 1):
        bounds.setLow(axis, float(low[axis]))
        bounds.setHigh(axis, float(high[axis]))
    return bounds


def grid_path(world: World) -> NDArray[np.float64] | None:
    """Return the points of a path over the cells of a grid, pulled tight, shape (N, 3)."""
    clearance_m = CLEARANCE_M + 0.5 * _COARSE_M
    ends = world.start_enu_m, world.goal_enu_m
    free, low = free_grid(world.obstacles, *ends, clearance_m, _COARSE_M)
    graph = cell_graph(free, _COARSE_M)
    cells = np.arange(free.size).reshape(free.shape)
    rows = [int(cells[tuple(((np.array(p[:2]) - low) / _COARSE_M).astype(int))]) for p in ends]
    _, before = dijkstra(
        graph, directed=False, indices=np.array(rows[:1]), return_predecessors=True
    )
    path = [rows[1]]
    while path[-1] != rows[0]:
        path.append(int(before[0, path[-1]]))
        if path[-1] < 0:
            return None
    column = np.array(path[::-1])
    places = low + _COARSE_M * (np.stack(np.unravel_index(column, free.shape), axis=1) + 0.5)
    points = np.column_stack([places, np.full(len(places), ends[0][2])])
    points[0], points[-1] = ends
    return pulled_tight(points, world.obstacles, CLEARANCE_M)
