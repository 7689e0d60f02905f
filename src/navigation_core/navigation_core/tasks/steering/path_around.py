"""The way to a place that moves, around obstacles: a path, searched again as the place moves."""

from __future__ import annotations

from functools import partial

import numpy as np

from navigation_core.geometry import Vector3, distance
from navigation_core.planning.planner import NoPath, Path, PlanLimits, plan
from navigation_core.searches import Search
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

__all__ = ["PathAround"]

# A place that has moved by less is led to by the same path.
_MOVED_M = 0.5


class PathAround:
    """The way of one vehicle.

    Attributes:
        path_enu_m: the path around obstacles, empty while the way is free or there is none.
        replans: number of paths that were found.
        blocked: why there is no path; empty while there is one, or none is needed.
    """

    def __init__(self, avoidance: AvoidanceConfig | None, traits: Traits) -> None:
        """Prepare.

        Args:
            avoidance: the clearances; None if no obstacles are known or sensed.
            traits: what the vehicle can do.
        """
        self._avoidance = avoidance
        self._flies = traits.flies
        self._turning_radius_m = traits.turning_radius_m
        self._search: Search[Path | NoPath] | None = None
        self._searched_s = -np.inf
        self.path_enu_m: tuple[Vector3, ...] = ()
        self.replans = 0
        self.blocked = ""

    def forget(self) -> None:
        """Look for another path: the vehicle was not led."""
        if self._search is not None:
            self._search.abandon()
        self._search = None
        self._searched_s = -np.inf
        self.path_enu_m, self.blocked = (), ""

    def corner(
        self, here_enu_m: Vector3, place_enu_m: Vector3, observation: Observation
    ) -> Vector3 | None:
        """Return the point to head for; the place itself while the way there is free.

        None while no path is known.

        Args:
            here_enu_m: where the vehicle is.
            place_enu_m: where it is to come to.
            observation: the obstacles, and the time.
        """
        config, obstacles = self._avoidance, observation.obstacles
        if config is None or not len(obstacles):
            return place_enu_m
        if not self._flies:
            place_enu_m = (place_enu_m[0], place_enu_m[1], here_enu_m[2])
        if obstacles.is_clear(here_enu_m, place_enu_m, config.flown_clearance_m):
            if self.path_enu_m or self.blocked or self._search is not None:
                self.forget()
            return place_enu_m
        self._look(config, here_enu_m, place_enu_m, observation)
        return self._next(config, here_enu_m, observation)

    def _look(
        self,
        config: AvoidanceConfig,
        here_enu_m: Vector3,
        place_enu_m: Vector3,
        observation: Observation,
    ) -> None:
        """Search for a path where the last is old, and take one that was found."""
        now, path = observation.time_s, self.path_enu_m
        if self._search is None:
            waited = now - self._searched_s >= config.retry_s
            if not waited or (path and distance(path[-1], place_enu_m) < _MOVED_M):
                return
            limits = PlanLimits(
                config.plan_clearance_m,
                config.heights_m if self._flies else None,
                0.0 if self._flies else self._turning_radius_m,
                None if self._flies else observation.yaw_enu_rad,
                thorough=False,
            )
            obstacles = observation.obstacles
            work = partial(plan, here_enu_m, place_enu_m, obstacles, limits)
            self._search = config.searcher.begin(lambda _is_wanted: work())
            self._searched_s = now
        found = self._search.result()
        if found is None:
            return
        self._search = None
        if isinstance(found, NoPath):
            self.path_enu_m, self.blocked = (), found.reason
            return
        self.path_enu_m, self.blocked = found.points_enu_m, ""
        self.replans += 1

    def _next(
        self, config: AvoidanceConfig, here_enu_m: Vector3, observation: Observation
    ) -> Vector3 | None:
        """Return the farthest point of the path that the vehicle can go to straight."""
        points = self.path_enu_m[1:]
        if not points:
            return None
        starts = np.broadcast_to(np.array(here_enu_m), (len(points), 3))
        clearance_m = config.conflict_clearance_m
        clear = observation.obstacles.are_clear(starts, np.array(points), clearance_m)
        rows = np.flatnonzero(clear)
        return points[int(rows[-1])] if len(rows) else None
