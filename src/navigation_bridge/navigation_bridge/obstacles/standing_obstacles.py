"""Static obstacles: those of a file, and the bounds of the flight volume. No ROS."""

from __future__ import annotations

import math
from dataclasses import replace

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.obstacles.fence_walls import fence_walls
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import drives
from navigation_core.mapping.obstacles import NOTHING, KnownObstacle, Obstacles
from navigation_core.safety.fences import CircleArea, Fence
from navigation_core.safety.target_checks import FlightVolume

HEADROOM_M = 2.0
"""Height above its base from which a rover or boat passes below an obstacle."""

# A target right at the limit keeps the clearance to the wall there despite rounding.
_ROUNDING_M = 0.01
# Walls farther away do not affect paths around sensed obstacles, and slow down planning.
_WALLS_REACH_M = 60.0
_WALLS_STEP_M = 10.0


class StandingObstacles:
    """Places static obstacles in the map.

    Attributes:
        known: the obstacles of the file as tables: the same object until something changes.
        known_by_name: the same by themselves.
        on_ground: whether the vehicle is known to stay on the ground.
        fence: the vehicle's own, if known.
        walls: walls of the allowed area that are near the vehicle.
    """

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame, config: ObstacleConfig) -> None:
        """Start with the configured obstacles."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._config = config
        self._placed_key: object = None
        self._placed_for: tuple[object, object, object] = (None, None, None)
        self.known = NOTHING
        self.known_by_name: tuple[KnownObstacle, ...] = ()
        self.on_ground = False
        self.fence: Fence | None = None
        self._all_walls = self.walls = NOTHING
        self._walls_key: object = None
        self._walls_about: tuple[int, int] | None = None

    def configure(self, config: ObstacleConfig) -> None:
        """Apply other settings."""
        self._config = config

    def place(self) -> None:
        """Place the known obstacles for the map frame and the kind of vehicle."""
        known, frame, profile = self._config.known, self._map_frame.frame, self._vehicle.profile
        last = self._placed_for
        if last[0] is known and last[1] is frame and last[2] is profile:
            return
        self._placed_for = (known, frame, profile)
        on_ground = self.on_ground = drives(profile)
        key = (known, frame if known.needs_origin else None, on_ground)
        if key == self._placed_key:
            return
        self._placed_key = key
        placed: tuple[KnownObstacle, ...] = ()
        if frame is not None or not known.needs_origin:
            placed = known.placed(self._map_frame.enu)
        if on_ground:
            # Its height is that of the ground, which the map of heights above the origin lacks.
            placed = tuple(
                replace(obstacle, bottom_m=-math.inf, top_m=math.inf)
                for obstacle in placed
                if obstacle.bottom_m < HEADROOM_M
            )
        self.known_by_name, self.known = placed, Obstacles.of(placed)

    def bound(
        self,
        fence: Fence | None,
        fence_margin_m: float,
        volume: FlightVolume,
        place: tuple[float, float] | None,
    ) -> None:
        """Make walls of the boundaries of the vehicle's fence and of the flight volume.

        Paths may come as close to them as targets may. A vehicle outside must be able to come back
        in, so then there is no wall.

        Args:
            fence: the vehicle's own, or None while it is not known.
            fence_margin_m: minimum distance of targets from it.
            volume: where targets are accepted.
            place: position of the vehicle, east and north.
        """
        fence_holds = fence is not None and (place is None or fence.allows(place))
        volume_holds = place is None or math.hypot(*place) <= volume.radius_max_m
        clearance_m = self._config.vehicle_radius_m + self._config.margin_m + _ROUNDING_M
        key = (fence, fence_margin_m, volume, fence_holds, volume_holds, clearance_m)
        if key != self._walls_key:
            self.fence, self._walls_key, self._walls_about = fence, key, None
            walls: tuple[KnownObstacle, ...] = ()
            if fence is not None and fence_holds:
                walls += fence_walls(fence, clearance_m - fence_margin_m)
            if volume_holds:
                rim = Fence(areas=(CircleArea((0.0, 0.0), volume.radius_max_m),))
                walls += fence_walls(rim, clearance_m)
            self._all_walls = Obstacles.of(walls)
        self._see_walls(place or (0.0, 0.0))

    def _see_walls(self, place: tuple[float, float]) -> None:
        """Select nearby walls; the same object until the vehicle has moved on."""
        about = round(place[0] / _WALLS_STEP_M), round(place[1] / _WALLS_STEP_M)
        if about != self._walls_about:
            self._walls_about = about
            centre = about[0] * _WALLS_STEP_M, about[1] * _WALLS_STEP_M, 0.0
            self.walls = self._all_walls.near(centre, centre, _WALLS_REACH_M)
