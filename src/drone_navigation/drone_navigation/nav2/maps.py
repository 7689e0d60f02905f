"""Obstacles of the server's topic as a map to plan in, and as costs. No ROS calls."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from numpy.typing import NDArray
from visualization_msgs.msg import MarkerArray

from drone_navigation.console.page_values import obstacle_rows
from mavlink_vehicle.positions import frames
from navigation_core.geometry import Vector3, distance
from navigation_core.mapping.obstacles import BOX_COLUMNS, POST_COLUMNS, Obstacles

# Values of costmap_2d: in an obstacle, nearer to one than the vehicle's radius, free.
LETHAL, INSCRIBED, FREE = 254, 253, 0
# Obstacles within this above and below the vehicle count.
_LEVEL_M = 0.5
_TILE = 20
_POSES_M = 0.5


def obstacles_of(message: MarkerArray | None) -> Obstacles:
    """Return what markers of the topic `obstacles` show."""
    if message is None:
        return Obstacles()
    rows = obstacle_rows(message)
    return Obstacles(
        np.array([*rows["posts"], *rows["seen"]]).reshape(-1, POST_COLUMNS),
        np.array(rows["boxes"]).reshape(-1, BOX_COLUMNS),
    )


@dataclass(frozen=True)
class Costs:
    """A square of cells.

    Attributes:
        values: as of costmap_2d, shape (N, N): rows from south to north, each from west to east.
        corner_m: east and north of its south-western corner, in the map.
        cell_m: length of a cell's sides.
    """

    values: NDArray[np.uint8]
    corner_m: tuple[float, float]
    cell_m: float


def costs(
    obstacles: Obstacles,
    centre: Vector3,
    extent_m: tuple[float, float],
    radii_m: tuple[float, float],
) -> Costs:
    """Return the costs about the vehicle, at its height.

    Args:
        obstacles: known and sensed.
        centre: the vehicle in the map.
        extent_m: length of the sides of the square, and of a cell's.
        radii_m: the vehicle's, and the clearance that paths keep; costs fall between the two.
    """
    size_m, cell_m = extent_m
    count = round(size_m / cell_m)
    west_m, south_m = (math.floor(c / cell_m) * cell_m - 0.5 * size_m for c in centre[:2])
    level = obstacles.between(centre[2] - _LEVEL_M, centre[2] + _LEVEL_M).endless()
    clear_m: NDArray[np.float64] = np.full((count, count), np.inf)
    # Obstacles far from a tile are not looked at.
    for row, column in itertools.product(range(0, count, _TILE), repeat=2):
        tile = clear_m[row : row + _TILE, column : column + _TILE]
        rows, columns = np.indices(tile.shape)
        east_m = west_m + (columns + column + 0.5) * cell_m
        north_m = south_m + (rows + row + 0.5) * cell_m
        points = np.stack([east_m, north_m, np.full(tile.shape, centre[2])], axis=-1)
        tile[:] = level.clearance_m(points.reshape(-1, 3)).reshape(tile.shape)
    radius_m, wide_m = radii_m
    falling = (wide_m - clear_m) / max(wide_m - radius_m, 1e-6) * (INSCRIBED - 1)
    values = np.where(clear_m < radius_m, INSCRIBED, np.clip(falling, FREE, INSCRIBED - 1))
    # A cell that an obstacle touches.
    values[clear_m <= 0.5 * cell_m] = LETHAL
    return Costs(values.astype(np.uint8), (west_m, south_m), cell_m)


def path(corners: Sequence[Vector3], header: object) -> Path:
    """Return poses along straight lines, which face along them."""
    message = Path(header=header)
    for a, b in itertools.pairwise(corners):
        steps = max(math.ceil(distance(a, b) / _POSES_M), 1)
        yaw_rad = math.atan2(b[1] - a[1], b[0] - a[0])
        last = 1 if b == corners[-1] else 0
        for step in range(steps + last):
            share = step / steps
            pose = PoseStamped(header=header)
            position, orientation = pose.pose.position, pose.pose.orientation
            position.x, position.y, position.z = (
                p + share * (q - p) for p, q in zip(a, b, strict=True)
            )
            orientation.w, _, _, orientation.z = frames.quaternion_from_yaw(yaw_rad)
            message.poses.append(pose)
    return message
