"""Distances and rays among obstacles: arrays over vehicles (N), rays (R) and obstacles (M).

All obstacles are upright prisms over a circle or a turned rectangle, so everything happens
in the plane and heights are compared apart. NED metres from the world's origin.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.world.model import Ground, Obstacle

Array = NDArray[np.float64]


class Shapes:
    """The obstacles of a world at a moment.

    Args:
        obstacles: they.

    Attributes:
        names: of the obstacles, cylinders first; that is the order of every axis M.
        fastest_m_s: of those that move.
    """

    def __init__(self, obstacles: tuple[Obstacle, ...]) -> None:
        """See the class."""
        ordered = sorted(obstacles, key=lambda item: item.radius_m <= 0.0)
        self.names = [item.name for item in ordered]
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
        """How far the sides are, horizontally, 0 within the outline.

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
        """Vectors of shape (..., M boxes, 2) in the boxes' own axes."""
        n, e = vector[..., 0], vector[..., 1]
        return np.stack([n * self._cos + e * self._sin, e * self._cos - n * self._sin], axis=-1)

    def heights_apart(self, down_m: Array) -> Array:
        """How far above its top or below its bottom a height is, 0 between.

        Args:
            down_m: shape (N,).

        Returns:
            Shape (N, M), metres.
        """
        down = down_m[:, None]
        return np.maximum(np.maximum(self.top_down_m - down, down - self.bottom_down_m), 0.0)

    def cast(self, position_ned_m: Array, bearing_rad: Array) -> Array:
        """How far level rays go until they meet an obstacle.

        Args:
            position_ned_m: shape (N, 3).
            bearing_rad: shape (N, R), clockwise from North.

        Returns:
            Shape (N, R), metres; infinity where nothing is.
        """
        if not len(self):
            return np.full(bearing_rad.shape, np.inf)
        ray = np.stack([np.cos(bearing_rad), np.sin(bearing_rad)], axis=-1)[:, :, None, :]
        to = (self._centre - position_ned_m[:, None, :2])[:, None]
        distance = np.concatenate(
            [
                self._cast_circles(to[:, :, : self._round], ray),
                self._cast_boxes(to[:, :, self._round :], ray),
            ],
            axis=2,
        )
        beside = self.heights_apart(position_ned_m[:, 2]) > 0.0
        distance = np.where(beside[:, None, :], np.inf, distance)
        return np.asarray(distance.min(axis=2))

    def _cast_circles(self, to: Array, ray: Array) -> Array:
        along = (to * ray).sum(axis=-1)
        outside = (to * to).sum(axis=-1) - self._radius**2
        under_root = along * along - outside
        entry = along - np.sqrt(np.maximum(under_root, 0.0))
        hit = (under_root >= 0.0) & (entry >= 0.0)
        return np.where(outside <= 0.0, 0.0, np.where(hit, entry, np.inf))

    def _cast_boxes(self, to: Array, ray: Array) -> Array:
        """The slab method: a ray is inside a box while it is inside both pairs of sides."""
        centre, along = self._to_box(to), self._to_box(ray)
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        first, second = (centre - self._half) / along, (centre + self._half) / along
        entry = np.minimum(first, second).max(axis=-1)
        leave = np.maximum(first, second).min(axis=-1)
        return np.where((entry <= leave) & (leave >= 0.0), np.maximum(entry, 0.0), np.inf)


def ground_height_m(ground: Ground, north_m: Array, east_m: Array) -> Array:
    """Height of the ground above the world's origin.

    Args:
        ground: flat, or a grid.
        north_m: shape (N,).
        east_m: shape (N,).

    Returns:
        Shape (N,).
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
