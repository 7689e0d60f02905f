"""The traffic as one vehicle sees it: the shared reservations, in its own map frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.observation import Observation, OtherVehicles
from navigation_core.tasks.traffic.entries import TrafficWait
from navigation_core.tasks.traffic.intruders import Intruders
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.volumes import Array, Volume

__all__ = ["TrafficFrame", "TrafficView"]


@dataclass(frozen=True, eq=False)
class TrafficFrame:
    """How a map frame lies in the traffic frame.

    Attributes:
        axes: shape (3, 3): map metres to traffic metres.
        origin_m: the map's origin in the traffic frame, shape (3,).
    """

    axes: Array
    origin_m: Array

    @classmethod
    def level(cls, origin_m: Vector3 = (0.0, 0.0, 0.0)) -> TrafficFrame:
        """Return that of a map with the same axes, begun elsewhere."""
        return cls(np.eye(3), np.array(origin_m, dtype=np.float64))

    def traffic(self, points_enu_m: Array) -> Array:
        """Return points (N, 3) of the map in the traffic frame."""
        return np.asarray(points_enu_m @ self.axes.T + self.origin_m)

    def map(self, points_m: Array) -> Array:
        """Return points (N, 3) of the traffic frame in the map."""
        return np.asarray((points_m - self.origin_m) @ np.linalg.inv(self.axes).T)


@dataclass(frozen=True, eq=False)
class TrafficView(OtherVehicles):
    """The other traffic, as a task sees it.

    Attributes:
        reservations: shared by all vehicles of the server.
        name: of the vehicle in it.
        traffic_frame: how its map lies in the traffic frame.
        radius_m: by how much it may stray from its path, level.
        rise_m: the same in height.
        heights_m: lowest and highest map z of a detour; None for what drives.
        reach_m: farthest from the map origin that a detour may lead.
        timeout_s: longest time that it may have to wait.
        searcher: looks for detours.
    """

    reservations: TrafficReservations
    name: str
    traffic_frame: TrafficFrame
    radius_m: float = 1.0
    rise_m: float = 0.5
    heights_m: tuple[float, float] | None = None
    reach_m: float = np.inf
    timeout_s: float = 120.0
    searcher: Searcher = AT_ONCE

    @staticmethod
    def of(observation: Observation) -> TrafficView | None:
        """Return the traffic in an observation; None where nobody keeps apart."""
        view = observation.traffic
        return view if isinstance(view, TrafficView) else None

    def volume(self, points_enu_m: Array) -> Volume:
        """Return the volume that the vehicle occupies along points (N, 3) of the map."""
        return Volume.along(self.traffic_frame.traffic(points_enu_m), self.radius_m, self.rise_m)

    def admits(self, line: Array, ends_where_asked: bool = True) -> bool:
        """Whether a line of points (N, 3) of the map keeps within allowed heights and reach.

        Args:
            line: the points.
            ends_where_asked: whether it may end at any height.
        """
        if self.heights_m is not None:
            low, high = self.heights_m
            # Its present height and that of its target are allowed.
            for place in (0, -1) if ends_where_asked else (0,):
                low, high = min(low, float(line[place, 2])), max(high, float(line[place, 2]))
            if (line[:, 2] < low - 0.01).any() or (line[:, 2] > high + 0.01).any():
                return False
        return not bool((np.hypot(line[:, 0], line[:, 1]) > self.reach_m).any())

    def intruders(
        self,
        here_enu_m: Vector3,
        speed_m_s: float,
        now: float,
        room_m: tuple[float, float] | None = None,
        with_standing: bool = False,
    ) -> Intruders:
        """Return the intruders that may come near within their horizon.

        Args:
            here_enu_m: its position, in the map frame.
            speed_m_s: its maximum speed.
            now: time in seconds.
            room_m: by how much it strays from its path, level and in height; None for the usual.
            with_standing: whether also those that stand.
        """
        found = self.reservations.intruders(self.name, with_standing)
        here_m = self.traffic_frame.traffic(np.array([here_enu_m]))[0]
        room_m = room_m or (self.radius_m, self.rise_m)
        all_of_them = Intruders.of(found, self.reservations.separation, room_m, now)
        return all_of_them.near(here_m, speed_m_s)

    @property
    def waiting(self) -> TrafficWait | None:
        """The vehicle that this one waits for, and why; or None."""
        return self.reservations.entry(self.name).waiting

    def must_give_way(self, now: float) -> bool:
        """Whether it is the one to find another way."""
        return self.reservations.must_give_way(self.name, now)
