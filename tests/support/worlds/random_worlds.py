"""Seeded random worlds: obstacles, a start, a goal, and whether there is a path between them.

A world is plain data, so that the planner, the simulator and the pictures can all use it. The
answer whether a path exists comes from a fine grid (see :func:`path_exists`), not from the planner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.sparse import csr_array

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import Box, Cylinder, KnownObstacle, Obstacles

CLEARANCE_M = 1.5
"""Clearance of a vehicle from obstacles: worlds are made for this, and judged with it"""

KINDS = ("posts", "blocks", "walls", "gap", "dead end", "maze", "closed")


@dataclass(frozen=True)
class Mover:
    """A cylinder that goes to and fro along straight lines at one speed.

    Attributes:
        cylinder: at its first point.
        path_enu_m: at least two points (east, north), not closed.
        speed_m_s: along the lines.
    """

    cylinder: Cylinder
    path_enu_m: tuple[tuple[float, float], ...]
    speed_m_s: float

    def at(self, time_s: float) -> Cylinder:
        """Return where it is after a time."""
        points = np.array(self.path_enu_m)
        lengths = np.hypot(*np.diff(points, axis=0).T)
        total = float(lengths.sum())
        along = math.fmod(time_s * self.speed_m_s, 2.0 * total)
        along = 2.0 * total - along if along > total else along
        steps = np.concatenate([[0.0], np.cumsum(lengths)])
        centre = (
            float(np.interp(along, steps, points[:, 0])),
            float(np.interp(along, steps, points[:, 1])),
        )
        shape = self.cylinder
        return Cylinder(shape.name, centre, shape.radius_m, shape.bottom_m, shape.top_m)


@dataclass(frozen=True)
class World:
    """One world.

    Attributes:
        seed: that it was made from.
        kind: one of ``KINDS``.
        fixed: what stands still.
        movers: what moves; not looked at by ``path_exists``.
        start_enu_m: clear of all that stands still.
        goal_enu_m: clear of all that stands still.
    """

    seed: int
    kind: str
    fixed: tuple[KnownObstacle, ...]
    movers: tuple[Mover, ...]
    start_enu_m: Vector3
    goal_enu_m: Vector3

    @cached_property
    def obstacles(self) -> Obstacles:
        """The stationary obstacles, as tables."""
        return Obstacles.of(self.fixed)

    @cached_property
    def solvable(self) -> bool:
        """Whether a path with ``CLEARANCE_M`` leads to the goal in the plane; takes a moment."""
        return path_exists(self.obstacles, self.start_enu_m, self.goal_enu_m, CLEARANCE_M)


@dataclass
class _Builder:
    """Collects obstacles, away from start and goal."""

    rng: np.random.Generator
    count: int
    size_m: float
    top_m: float
    start: tuple[float, float]
    goal: tuple[float, float]
    made: list[KnownObstacle] = field(default_factory=list)

    def add(self, obstacle: KnownObstacle) -> bool:
        """Take an obstacle unless it is too near to the start or the goal."""
        one = Obstacles.of((obstacle,))
        ends = np.array([(*self.start, 0.0), (*self.goal, 0.0)])
        if one.clearance_m(ends).min() < 1.3 * CLEARANCE_M:
            return False
        self.made.append(obstacle)
        return True

    def place(self) -> tuple[float, float]:
        """Return a place within the world."""
        half = 0.5 * self.size_m
        east, north = self.rng.uniform(-half, half, 2)
        return float(east), float(north)

    def post(self, least_m: float = 0.2, most_m: float = 2.5) -> None:
        """Put up a cylinder."""
        radius = float(self.rng.uniform(least_m, most_m))
        self.add(Cylinder(f"post {len(self.made)}", self.place(), radius, -1.0, self.top_m))

    def block(self) -> None:
        """Put up a box."""
        length, width = self.rng.uniform(0.5, 6.0, 2)
        yaw = float(self.rng.uniform(-math.pi, math.pi))
        self.add(
            Box(
                f"block {len(self.made)}",
                self.place(),
                (float(length), float(width)),
                yaw,
                -1.0,
                self.top_m,
            )
        )

    def wall(
        self, a: tuple[float, float], b: tuple[float, float], thickness_m: float = 0.3
    ) -> bool:
        """Put up a wall between two points."""
        east, north = b[0] - a[0], b[1] - a[1]
        length = math.hypot(east, north)
        if length < 0.1:
            return False
        middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
        yaw = math.atan2(north, east)
        name = f"wall {len(self.made)}"
        return self.add(Box(name, middle, (length, thickness_m), yaw, -1.0, self.top_m))

    def fill(self) -> None:
        """Scatter posts and blocks until there are enough."""
        for _ in range(4 * self.count):
            if len(self.made) >= self.count:
                return
            if self.rng.random() < 0.6:
                self.post()
            else:
                self.block()

    def at_share(self, share: float, aside_m: float) -> tuple[float, float]:
        """Return a point beside the line from start to goal."""
        east, north = self.goal[0] - self.start[0], self.goal[1] - self.start[1]
        length = math.hypot(east, north)
        along = (east / length, north / length)
        return (
            self.start[0] + share * east - aside_m * along[1],
            self.start[1] + share * north + aside_m * along[0],
        )


def _posts(builder: _Builder) -> None:
    for _ in range(2 * builder.count):
        if len(builder.made) < builder.count:
            builder.post()


def _blocks(builder: _Builder) -> None:
    builder.fill()


def _walls(builder: _Builder) -> None:
    for _ in range(builder.count // 3):
        a = builder.place()
        angle, length = builder.rng.uniform(0.0, math.tau), builder.rng.uniform(4.0, 20.0)
        builder.wall(a, (a[0] + length * math.cos(angle), a[1] + length * math.sin(angle)))
    builder.fill()


def _gap(builder: _Builder) -> None:
    """Walls right across with one gap each, not much wider than twice the clearance."""
    half = 0.75 * builder.size_m
    for share in (0.35, 0.65):
        width = 2.0 * CLEARANCE_M * float(builder.rng.uniform(1.04, 1.5))
        middle = float(builder.rng.uniform(-0.3, 0.3)) * builder.size_m
        builder.wall(builder.at_share(share, -half), builder.at_share(share, middle - 0.5 * width))
        builder.wall(builder.at_share(share, middle + 0.5 * width), builder.at_share(share, half))
    builder.fill()


def _dead_end(builder: _Builder) -> None:
    """A U that is open towards the start, about the straight line."""
    aside = float(builder.rng.uniform(4.0, 0.3 * builder.size_m))
    back, mouth = 0.7, float(builder.rng.uniform(0.25, 0.55))
    builder.wall(builder.at_share(back, -aside), builder.at_share(back, aside))
    for side in (-aside, aside):
        builder.wall(builder.at_share(mouth, side), builder.at_share(back, side))
    builder.fill()


def _maze(builder: _Builder) -> None:
    """Walls across, open on one side and the other in turn, and walls along both sides."""
    half = 0.4 * builder.size_m
    rows = min(max(builder.count // 3, 2), 6)
    for row in range(rows):
        share = (row + 1) / (rows + 1)
        low, high = (-half, half - 5.0) if row % 2 else (5.0 - half, half)
        builder.wall(builder.at_share(share, low), builder.at_share(share, high))
    for side in (-half, half):
        builder.wall(builder.at_share(-0.15, side), builder.at_share(1.15, side))
    builder.fill()


def _closed(builder: _Builder) -> None:
    """A ring of posts or walls about the goal, too tight to pass."""
    radius = float(builder.rng.uniform(5.0, 9.0))
    turn = float(builder.rng.uniform(0.0, math.tau))
    count = 16 if builder.count >= 20 else 4

    def corner(k: int) -> tuple[float, float]:
        angle = turn + math.tau * k / count
        return (
            builder.goal[0] + radius * math.cos(angle),
            builder.goal[1] + radius * math.sin(angle),
        )

    for k in range(count):
        if count == 4:
            builder.wall(corner(k), corner(k + 1))
        else:
            builder.add(Cylinder(f"post {k}", corner(k), 0.8, -1.0, builder.top_m))
    builder.fill()


_MAKERS: dict[str, Callable[[_Builder], None]] = {
    "posts": _posts,
    "blocks": _blocks,
    "walls": _walls,
    "gap": _gap,
    "dead end": _dead_end,
    "maze": _maze,
    "closed": _closed,
}


def random_world(
    seed: int,
    count: int | None = None,
    kind: str | None = None,
    *,
    movers: int = 0,
    top_m: float = math.inf,
) -> World:
    """Make a world; the same arguments give the same one.

    Args:
        seed: decides everything that is not given.
        count: of fixed obstacles, about; drawn from 5 to 200 if None.
        kind: one of ``KINDS``; drawn if None.
        movers: how many obstacles move, on top of the fixed ones.
        top_m: how high obstacles are; they begin at -1 m. Infinite: nothing flies over them.
    """
    rng = np.random.default_rng(seed)
    drawn_count, drawn_kind = int(rng.integers(5, 201)), KINDS[int(rng.integers(len(KINDS)))]
    count, kind = count or drawn_count, kind or drawn_kind
    size_m = 40.0 + 8.0 * math.sqrt(count)
    angle = float(rng.uniform(0.0, math.tau))
    reach = 0.45 * size_m
    start = (-reach * math.cos(angle), -reach * math.sin(angle))
    builder = _Builder(rng, count, size_m, top_m, start, (-start[0], -start[1]))
    _MAKERS[kind](builder)
    height = 3.0
    return World(
        seed,
        kind,
        tuple(builder.made),
        tuple(_mover(builder, k) for k in range(movers)),
        (*builder.start, height),
        (*builder.goal, height),
    )


def _mover(builder: _Builder, index: int) -> Mover:
    """Return something that goes to and fro across the line from start to goal."""
    rng = builder.rng
    share, reach = float(rng.uniform(0.25, 0.75)), float(rng.uniform(5.0, 15.0))
    path = (builder.at_share(share, -reach), builder.at_share(share, reach))
    shape = Cylinder(f"mover {index}", path[0], float(rng.uniform(0.3, 1.0)), -1.0, builder.top_m)
    return Mover(shape, path, float(rng.uniform(0.3, 1.5)))


def path_exists(
    obstacles: Obstacles,
    start_enu_m: Vector3,
    goal_enu_m: Vector3,
    clearance_m: float,
    cell_m: float = 0.1,
) -> bool:
    """Whether a grid with square cells joins two points, in the plane of the start.

    A cell is free if its middle has the clearance. Two free cells side by side may still have
    a line between them that comes nearer by up to a tenth of a cell: too little to matter.
    """
    level = obstacles.between(start_enu_m[2] - clearance_m, start_enu_m[2] + clearance_m)
    free, low = free_grid(level, start_enu_m, goal_enu_m, clearance_m, cell_m)
    patches, _ = label(free)
    (a, b) = (
        patches[tuple(((np.array(p[:2]) - low) / cell_m).astype(int))]
        for p in (start_enu_m, goal_enu_m)
    )
    return bool(a == b and a != 0)


def free_grid(
    level: Obstacles,
    start_enu_m: Vector3,
    goal_enu_m: Vector3,
    clearance_m: float,
    cell_m: float,
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which cells are free, shape (E, N), and the low corner of the grid.

    The grid holds all obstacles, the start and the goal, and a path round all of them.
    """
    ends = np.array([start_enu_m[:2], goal_enu_m[:2]])
    reach = np.concatenate([level.posts[:, 2], np.hypot(*level.boxes[:, 2:4].T)])[:, None]
    middles = np.concatenate([level.posts[:, :2], level.boxes[:, :2]])
    rim = 2.0 * clearance_m + 4.0 * cell_m
    low = np.minimum((middles - reach).min(axis=0, initial=np.inf), ends.min(axis=0)) - rim
    high = np.maximum((middles + reach).max(axis=0, initial=-np.inf), ends.max(axis=0)) + rim
    shape = np.ceil((high - low) / cell_m).astype(int) + 1
    free = np.ones(shape, dtype=bool)
    for row in range(len(level)):
        within = reach[row] + clearance_m
        first = np.maximum(((middles[row] - within - low) / cell_m).astype(int), 0)
        last = ((middles[row] + within - low) / cell_m).astype(int) + 2
        east, north = (low[k] + cell_m * (np.arange(first[k], last[k]) + 0.5) for k in (0, 1))
        gap = _gap_m(level, row, east[:, None] - middles[row, 0], north - middles[row, 1])
        free[first[0] : last[0], first[1] : last[1]] &= gap >= clearance_m
    return free, low


def cell_graph(free: NDArray[np.bool_], cell_m: float) -> csr_array:
    """Return the distances between neighbouring free cells, also across corners, as a graph."""
    cells = np.arange(free.size).reshape(free.shape)
    begins, ends, lengths = [], [], []
    for east, north in ((1, 0), (0, 1), (1, 1), (1, -1)):
        a = (slice(0, free.shape[0] - east), slice(max(-north, 0), free.shape[1] - max(north, 0)))
        b = (slice(east, None), slice(max(north, 0), free.shape[1] - max(-north, 0)))
        joined = free[a] & free[b]
        begins.append(cells[a][joined])
        ends.append(cells[b][joined])
        lengths.append(np.full(int(joined.sum()), cell_m * math.hypot(east, north)))
    pairs = np.concatenate(begins), np.concatenate(ends)
    return csr_array((np.concatenate(lengths), pairs), shape=(free.size, free.size))


def _gap_m(
    level: Obstacles, row: int, east: NDArray[np.float64], north: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far places are from an outline, seen from its middle."""
    if row < len(level.posts):
        return np.asarray(np.hypot(east, north) - level.posts[row, 2])
    half_x, half_y, yaw = level.boxes[row - len(level.posts), 2:5]
    x = np.abs(east * math.cos(yaw) + north * math.sin(yaw)) - half_x
    y = np.abs(north * math.cos(yaw) - east * math.sin(yaw)) - half_y
    return np.asarray(np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)))
