"""The traffic as one vehicle sees it: the shared picture, in its own map frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.traffic.picture import TrafficPicture
from navigation_core.traffic.right_of_way import TrafficWait
from navigation_core.traffic.volumes import Array, Volume

__all__ = ["Footing", "TrafficView"]


@dataclass(frozen=True, eq=False)
class Footing:
    """How a map frame lies in the traffic frame.

    Attributes:
        axes: shape (3, 3): map metres to traffic metres.
        origin_m: the map's origin in the traffic frame, shape (3,).
    """

    axes: Array
    origin_m: Array

    @classmethod
    def level(cls, origin_m: Vector3 = (0.0, 0.0, 0.0)) -> Footing:
        """Return that of a map with the same axes, begun elsewhere."""
        return cls(np.eye(3), np.array(origin_m, dtype=np.float64))

    def traffic(self, points_enu_m: Array) -> Array:
        """Return points (N, 3) of the map in the traffic frame."""
        return np.asarray(points_enu_m @ self.axes.T + self.origin_m)

    def map(self, points_m: Array) -> Array:
        """Return points (N, 3) of the traffic frame in the map."""
        return np.asarray((points_m - self.origin_m) @ np.linalg.inv(self.axes).T)


@dataclass(frozen=True, eq=False)
class TrafficView:
    """What a task needs of the traffic.

    Attributes:
        picture: shared by all vehicles of the server.
        name: of the vehicle in it.
        footing: how its map lies in the traffic frame.
        radius_m: by how much it may stray from its path, level.
        rise_m: the same in height.
        heights_m: lowest and highest map z of a detour; None for what drives.
        reach_m: farthest from the map origin that a detour may lead.
        timeout_s: longest time that it may have to wait.
        searcher: looks for detours.
    """

    picture: TrafficPicture
    name: str
    footing: Footing
    radius_m: float = 1.0
    rise_m: float = 0.5
    heights_m: tuple[float, float] | None = None
    reach_m: float = np.inf
    timeout_s: float = 120.0
    searcher: Searcher = AT_ONCE

    def volume(self, points_enu_m: Array) -> Volume:
        """Return what is taken up along points (N, 3) of the map."""
        return Volume.along(self.footing.traffic(points_enu_m), self.radius_m, self.rise_m)

    @property
    def waiting(self) -> TrafficWait | None:
        """What the vehicle waits for, or None."""
        return self.picture.entry(self.name).waiting

    def must_give_way(self, now: float) -> bool:
        """Whether it is the one to find another way."""
        return self.picture.must_give_way(self.name, now)
