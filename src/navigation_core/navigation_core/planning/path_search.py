"""The shortest path through a roadmap, with every line of it checked exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.planar_shapes import Indices
from navigation_core.planning.roadmap import Net

__all__ = ["CLIMB_COST", "cost_m", "path_cost_m", "shortest_path"]

# A metre up or down takes about as long as this many metres along.
CLIMB_COST = 2.5
# How many points of a net one is joined to, first and if that gives no path.
_NEIGHBOURS = 40
_CHECKS_MAX = 40
# How many points near each end may be left upwards or downwards.
_STEPS = 40


def cost_m(lines: Array) -> Array:
    """Return what lines cost: their length, with heights counting more.

    Args:
        lines: vectors, shape (..., 3).
    """
    east, north, up = lines[..., 0], lines[..., 1], lines[..., 2] * CLIMB_COST
    return np.asarray(np.sqrt(east * east + north * north + up * up))


def path_cost_m(path: Array) -> float:
    """Return what a path costs, shape (N, 3): the sum over its lines."""
    return float(cost_m(np.diff(path, axis=0)).sum())


@dataclass
class _Graph:
    """Points, and the lines between them that may be clear."""

    points: Array
    begins: Indices
    ends: Indices

    def __post_init__(self) -> None:
        self.checked = np.zeros(len(self.begins), dtype=np.bool_)
        costs = cost_m(self.points[self.ends] - self.points[self.begins]) + 1e-9
        count = len(self.points)
        numbers = np.arange(len(costs), dtype=np.float64)
        self._graph = scipy.sparse.csr_array(
            (numbers, (self.begins, self.ends)), shape=(count, count)
        )
        self._order = self._graph.data.astype(np.intp)
        self._graph.data = costs[self._order]
        self._place = np.empty_like(self._order)
        self._place[self._order] = np.arange(len(costs))

    def shortest(self, start: int, goal: int) -> list[int] | None:
        """Return the rows of points from start to goal."""
        far, before = scipy.sparse.csgraph.dijkstra(
            self._graph, directed=False, indices=np.array([start]), return_predecessors=True
        )
        if not np.isfinite(far[0, goal]):
            return None
        path = [goal]
        while path[-1] != start:
            path.append(int(before[0, path[-1]]))
        return path[::-1]

    def close(self, path: Indices, obstacles: Obstacles, clearance_m: float) -> bool:
        """Close the lines at a path that are not clear; whether the path is clear."""
        on_path = np.zeros(len(self.points), dtype=np.bool_)
        on_path[path] = True
        rows = np.flatnonzero(on_path[self.begins] & on_path[self.ends] & ~self.checked)
        clear = obstacles.are_clear(
            self.points[self.begins[rows]], self.points[self.ends[rows]], clearance_m
        )
        self._graph.data[self._place[rows[~clear]]] = np.inf
        self.checked[rows] = True
        return bool(clear.all())


def shortest_path(
    nets: list[Net],
    ends_enu_m: Array,
    obstacles: Obstacles,
    clearance_m: float,
    *,
    thorough: bool,
) -> Array | None:
    """Return the points of the shortest path from one point to another, shape (N, 3).

    Args:
        nets: from the lowest to the highest; one changes between them where it is clear above
            the start, above the goal, or above points near to these.
        ends_enu_m: start and goal, shape (2, 3).
        obstacles: all that count.
        clearance_m: that each line of the path keeps.
        thorough: whether to try many lines from the start and the goal if few give no path.
    """
    for neighbours in (_NEIGHBOURS, 10 * _NEIGHBOURS) if thorough else (_NEIGHBOURS,):
        graph = _graph(nets, ends_enu_m, obstacles, clearance_m, neighbours)
        for _ in range(_CHECKS_MAX):
            path = graph.shortest(0, 1)
            if path is None:
                break
            rows = np.array(path, dtype=np.intp)
            if graph.close(rows, obstacles, clearance_m):
                return np.asarray(graph.points[rows])
    return None


def _graph(
    nets: list[Net], ends_enu_m: Array, obstacles: Obstacles, clearance_m: float, neighbours: int
) -> _Graph:
    points, begins, ends, firsts = [ends_enu_m], [], [], []
    count = 2
    for net in nets:
        # Below or above the ends, at the height of the net.
        feet = np.array([(end[0], end[1], net.height_m) for end in ends_enu_m])
        points += [feet, net.points_enu_m]
        begins += [np.array([0, 1, count]), net.begins + count + 2]
        ends += [np.array([count, count + 1, count + 1]), net.ends + count + 2]
        for row, foot in enumerate(feet):
            near = _visible(net, foot, obstacles, clearance_m, neighbours)
            begins.append(np.full(len(near), count + row))
            ends.append(near + count + 2)
        firsts.append(count + 2)
        count += 2 + len(net.points_enu_m)
    for k in range(len(nets) - 1):
        lower, upper = _steps(nets[k], nets[k + 1], ends_enu_m)
        begins.append(lower + firsts[k])
        ends.append(upper + firsts[k + 1])
    return _Graph(np.concatenate(points), np.concatenate(begins), np.concatenate(ends))


def _steps(lower: Net, upper: Net, ends_enu_m: Array) -> tuple[Indices, Indices]:
    """Return rows of points of two nets between which it may be clear, near the ends."""
    if not len(lower.points_enu_m) or not len(upper.points_enu_m):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    plane = lower.points_enu_m[:, :2]
    near = [_nearest(plane - end[:2], _STEPS) for end in ends_enu_m]
    rows = np.unique(np.concatenate(near))
    others = scipy.spatial.cKDTree(upper.points_enu_m[:, :2]).query(plane[rows], k=1)[1]
    return rows, np.asarray(others, dtype=np.intp)


def _visible(
    net: Net, point: Array, obstacles: Obstacles, clearance_m: float, neighbours: int
) -> Indices:
    """Return the rows of the nearest points of a net that one has a clear line to."""
    near = _nearest(net.points_enu_m - point, neighbours)
    starts = np.broadcast_to(point, (len(near), 3))
    clear = obstacles.are_clear(starts, net.points_enu_m[near], clearance_m)
    return near[clear]


def _nearest(offsets: Array, count: int) -> Indices:
    far = np.einsum("ij,ij->i", offsets, offsets)
    if len(far) <= count:
        return np.arange(len(far))
    return np.asarray(np.sort(np.argpartition(far, count)[:count]))
