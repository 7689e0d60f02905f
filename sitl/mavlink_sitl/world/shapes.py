"""Distances and rays among obstacles: arrays over vehicles (N), rays (R) and obstacles (M).

All obstacles are upright prisms over a circle or a turned rectangle, so everything happens
in the plane and heights are compared apart. NED metres from the world's origin.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.world.model import Ground, Obstacle

Array = NDArray[np.float64]

_TINY = 1e-9
"""Components of a ray smaller than this count as this: nothing is divided by 0"""
_STEPS_MAX = 200
_HALVINGS = 14


class Shapes:
    """The obstacles of a world at a moment.

    Attributes:
        names: of the obstacles, cylinders first; that is the order of every axis M.
        moves: which of them move.
        fastest_m_s: of those that move.
    """

    def __init__(self, obstacles: tuple[Obstacle, ...]) -> None:
        ordered = sorted(obstacles, key=lambda item: item.radius_m <= 0.0)
        self.names = [item.name for item in ordered]
        self.moves = [item.path is not None for item in ordered]
        self.fastest_m_s = max((o.path.speed_m_s for o in ordered if o.path), default=0.0)
        self._round = sum(item.radius_m > 0.0 for item in ordered)
        self._moving = [(i, item.path) for i, item in enumerate(ordered) if item.path]
        self._centre = np.array([item.at_m for item in ordered], dtype=np.float64).reshape(-1, 2)
        self._radius = np.array([item.radius_m for item in ordered[: self._round]])
        boxes = ordered[self._round :]
        self._half = np.array([item.size_m for item in boxes]).reshape(-1, 2) / 2.0
        self._cos = np.cos([item.yaw_rad for item in boxes])
        self._sin = np.sin([item.yaw_rad for item in boxes])
        self.top_down_m = np.array([-item.top_m for item in ordered], dtype=np.float64)
        self.bottom_down_m = np.array([-item.bottom_m for item in ordered], dtype=np.float64)
        self.move_to(0.0)

    def __len__(self) -> int:
        """How many obstacles."""
        return len(self.names)

    def move_to(self, time_s: float) -> None:
        """Put those that move where they are at a time."""
        for i, path in self._moving:
            self._centre[i] = path.at(time_s)

    def gaps(self, position_ned_m: Array) -> Array:
        """The horizontal distances to the sides, 0 within the outline.

        Args:
            position_ned_m: shape (N, 3).

        Returns:
            Shape (N, M), metres.
        """
        offset = position_ned_m[:, None, :2] - self._centre
        far = np.hypot(offset[:, : self._round, 0], offset[:, : self._round, 1]) - self._radius
        local = np.abs(self._to_box(offset[:, self._round :])) - self._half
        local = np.maximum(local, 0.0)
        return np.concatenate(
            [np.maximum(far, 0.0), np.hypot(local[..., 0], local[..., 1])], axis=1
        )

    def _to_box(self, vector: Array) -> Array:
        """Vectors of shape (..., boxes, 2) in the own axes of the boxes."""
        n, e = vector[..., 0], vector[..., 1]
        return np.stack([n * self._cos + e * self._sin, e * self._cos - n * self._sin], axis=-1)

    def heights_apart(self, down_m: Array) -> Array:
        """The distance of a height above its top or below its bottom, 0 between.

        Args:
            down_m: shape (N,).

        Returns:
            Shape (N, M), metres.
        """
        down = down_m[:, None]
        return np.maximum(np.maximum(self.top_down_m - down, down - self.bottom_down_m), 0.0)

    def cast(self, origin_ned_m: Array, ray: Array, reach_m: float) -> Array:
        """The lengths of rays to an obstacle.

        Args:
            origin_ned_m: shape (N, 3), where each vehicle's rays begin.
            ray: shape (N, R, 3), NED unit vectors.
            reach_m: what is farther away need not be found.

        Returns:
            Shape (N, R), metres along the ray, 0 within an obstacle; infinity where nothing is.
        """
        near = np.asarray((self.gaps(origin_ned_m) <= reach_m).any(axis=0))
        if not near.any():
            return np.full(ray.shape[:2], np.inf)
        north, east = ray[:, :, None, 0], ray[:, :, None, 1]
        to = (self._centre[near] - origin_ned_m[:, None, :2])[:, None]
        among_round, among_boxes = near[: self._round], near[self._round :]
        count = int(among_round.sum())
        spans = [
            self._cross_circles(to[:, :, :count], north, east, among_round),
            self._cross_boxes(to[:, :, count:], north, east, among_boxes),
        ]
        entry, leave = (np.concatenate(part, axis=2) for part in zip(*spans, strict=True))
        # A prism is where its outline is and its heights are.
        down, fall = origin_ned_m[:, 2, None, None], _no_zero(ray[:, :, None, 2])
        top, bottom = self.top_down_m[near] - down, self.bottom_down_m[near] - down
        first, second = top / fall, bottom / fall
        entry = np.maximum(np.maximum(entry, np.minimum(first, second)), 0.0)
        leave = np.minimum(leave, np.maximum(first, second))
        return np.asarray(np.where(entry <= leave, entry, np.inf).min(axis=2))

    # In what follows the two parts of a vector are apart: NumPy takes several times as long for a
    # sum or a maximum over an axis of two.

    def _cross_circles(
        self, to: Array, north: Array, east: Array, which: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Where rays come into circles and leave them; a ray that passes by leaves before."""
        to_north, to_east = to[..., 0], to[..., 1]
        speed2 = np.maximum(north * north + east * east, _TINY**2)
        along = to_north * north + to_east * east
        outside = (to_north * to_north + to_east * to_east) - self._radius[which] ** 2
        under_root = along * along - speed2 * outside
        half = np.sqrt(np.maximum(under_root, 0.0))
        entry, leave = (along - half) / speed2, (along + half) / speed2
        return np.where(under_root >= 0.0, entry, np.inf), leave

    def _cross_boxes(
        self, to: Array, north: Array, east: Array, which: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """The slab method: a ray is inside a box while it is inside both pairs of sides."""
        half, cosine, sine = self._half[which], self._cos[which], self._sin[which]
        to_north, to_east = to[..., 0], to[..., 1]
        x, y = to_north * cosine + to_east * sine, to_east * cosine - to_north * sine
        along_x = _no_zero(north * cosine + east * sine)
        along_y = _no_zero(east * cosine - north * sine)
        first_x, second_x = (x - half[:, 0]) / along_x, (x + half[:, 0]) / along_x
        first_y, second_y = (y - half[:, 1]) / along_y, (y + half[:, 1]) / along_y
        entry = np.maximum(np.minimum(first_x, second_x), np.minimum(first_y, second_y))
        leave = np.minimum(np.maximum(first_x, second_x), np.maximum(first_y, second_y))
        return entry, leave


def _no_zero(value: Array) -> Array:
    """The same, away from 0 so that one can divide by it."""
    return np.where(np.abs(value) < _TINY, _TINY, value)


def cast_on_ground(ground: Ground, origin_ned_m: Array, ray: Array, reach_m: float) -> Array:
    """The lengths of rays to the ground.

    On a grid the rays are walked along in steps of half its spacing, and the place between two
    steps is then found by halving.

    Args:
        ground: flat, or a grid.
        origin_ned_m: shape (N, 3).
        ray: shape (N, R, 3), NED unit vectors.
        reach_m: what is farther away need not be found.

    Returns:
        Shape (N, R), metres along the ray, 0 below the ground; infinity where it is not met.
    """
    if not ground.heights_m:
        room = -ground.height_m - origin_ned_m[:, 2:3]
        fall = np.where(ray[:, :, 2] > _TINY, ray[:, :, 2], np.nan)
        return np.where(room <= 0.0, 0.0, np.nan_to_num(room / fall, nan=np.inf))

    def below(along: Array) -> NDArray[np.bool_]:
        place = origin_ned_m[:, None, None, :] + along[..., None] * ray[:, :, None, :]
        return np.asarray(-ground_height_m(ground, place[..., 0], place[..., 1]) <= place[..., 2])

    count = min(math.ceil(2.0 * reach_m / ground.spacing_m), _STEPS_MAX)
    steps = np.broadcast_to(np.linspace(0.0, reach_m, count + 1), (*ray.shape[:2], count + 1))
    met = below(steps)
    found = met.any(axis=2)
    far = np.take_along_axis(steps, met.argmax(axis=2)[:, :, None], axis=2)
    near = np.maximum(far - reach_m / count, 0.0)
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        under = below(middle)
        near, far = np.where(under, near, middle), np.where(under, middle, far)
    return np.where(found, far[:, :, 0], np.inf)


def ground_height_m(ground: Ground, north_m: Array, east_m: Array) -> Array:
    """Height of the ground above the world's origin.

    Args:
        ground: flat, or a grid.
        north_m: any shape.
        east_m: the same shape.
    """
    if not ground.heights_m:
        return np.full(np.shape(north_m), ground.height_m)
    grid = np.array(ground.heights_m)
    row, north_part = _cell(north_m, ground.corner_m[0], ground.spacing_m, grid.shape[0])
    column, east_part = _cell(east_m, ground.corner_m[1], ground.spacing_m, grid.shape[1])
    south = grid[row, column] * (1.0 - east_part) + grid[row, column + 1] * east_part
    north = grid[row + 1, column] * (1.0 - east_part) + grid[row + 1, column + 1] * east_part
    return np.asarray(ground.height_m + south * (1.0 - north_part) + north * north_part)


def _cell(
    value: Array, corner: float, spacing: float, count: int
) -> tuple[NDArray[np.intp], Array]:
    """Which cell of the grid, and where in it, 0..1."""
    place = np.clip((value - corner) / spacing, 0.0, count - 1.0)
    cell = np.minimum(place.astype(np.intp), count - 2)
    return cell, place - cell
