"""A range sensor of a vehicle of an exploration that ROS publishes: a scanner, or a point cloud."""

from __future__ import annotations

import array
import math
import random
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl import Obstacle, Shapes, SimulatedVehicle
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.obstacles.sensor_messages import points_of, scan_of

__all__ = ["RosSensor"]

Array = NDArray[np.float64]
_PERIOD_S, _REACH_M, _NEAREST_M, _NOISE_M = 0.1, 20.0, 0.3, 0.02
_BEARINGS = 180
# Elevations of a cloud's rings; a scanner has the one of 0.
_RINGS_DEG = (-40.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0, 40.0)
# sensor_msgs/PointField: FLOAT32.
_FLOAT32 = 7


@dataclass
class RosSensor:
    """Measures the obstacles around a vehicle at 10 Hz, from its middle, along its own axes.

    Attributes:
        sim: the vehicle.
        kind: "scan" or "cloud".
        obstacles: those of the world.
        seed: of the noise.
    """

    sim: SimulatedVehicle
    kind: str
    obstacles: tuple[Obstacle, ...]
    seed: int
    _due_s: float = field(default=-math.inf, init=False)

    def __post_init__(self) -> None:
        """Aim the rays."""
        self._shapes = Shapes(self.obstacles)
        self._rng = np.random.default_rng(random.Random(f"sensor {self.seed}").randrange(2**32))
        bearings = np.arange(_BEARINGS) * math.tau / _BEARINGS - math.pi
        rings = np.radians(_RINGS_DEG if self.kind == "cloud" else (0.0,))
        level = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(_BEARINGS)], axis=1)
        self._rays_flu: Array = np.concatenate(
            [math.cos(up) * level + np.array([0.0, 0.0, math.sin(up)]) for up in rings.tolist()]
        )

    def turn(self, feed: ObstacleFeed, now_s: float) -> None:
        """Publish, if that is due."""
        if now_s < self._due_s:
            return
        self._due_s = now_s + _PERIOD_S - 1e-9
        ranges_m = self._ranges_m()
        if self.kind == "scan":
            feed.take_scan(scan_of(_laser_scan(ranges_m)), now_s)
        else:
            seen = np.isfinite(ranges_m)
            points_m = self._rays_flu[seen] * ranges_m[seen, None]
            feed.take_points(points_of(_point_cloud(points_m)), now_s)

    def _ranges_m(self) -> Array:
        """Return how far each ray goes; infinite where nothing is within reach."""
        motion = self.sim.truth()
        rays_ned = (self._rays_flu * (1.0, -1.0, -1.0)) @ _to_ned(*motion[6:9]).T
        place = np.array([motion[:3]])
        found = self._shapes.cast(place, rays_ned[None], _REACH_M)[0]
        down = rays_ned[:, 2]
        ground = np.where(down > 1e-6, -motion[2] / np.maximum(down, 1e-6), np.inf)
        found = np.minimum(found, ground)
        found += self._rng.normal(0.0, _NOISE_M, len(found))
        return np.where((found < _REACH_M) & (found > _NEAREST_M), found, np.inf)


def _to_ned(roll: float, pitch: float, yaw: float) -> Array:
    """Return the matrix from the axes forward, right, down to north, east, down."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def _laser_scan(ranges_m: Array) -> Any:
    return SimpleNamespace(
        header=SimpleNamespace(frame_id="base_link"), angle_min=-math.pi,
        angle_increment=math.tau / _BEARINGS, range_min=_NEAREST_M, range_max=_REACH_M,
        ranges=ranges_m.tolist(),
    )  # fmt: skip


def _point_cloud(points_m: Array) -> Any:
    fields = [SimpleNamespace(name=n, offset=4 * i, datatype=_FLOAT32) for i, n in enumerate("xyz")]
    return SimpleNamespace(
        header=SimpleNamespace(frame_id="base_link"), fields=fields, is_bigendian=False,
        width=len(points_m), height=1, point_step=12, row_step=12 * len(points_m),
        data=array.array("B", points_m.astype("<f4").tobytes()),
    )  # fmt: skip
