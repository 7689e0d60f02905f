"""Static obstacles: those of a file, and the bounds of fence and flight volume as walls. No ROS.

A path may come as close to the fence as targets may (``fence_margin_m``), which differs from the
clearance to obstacles. So each wall is moved outwards by the difference.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import drives
from navigation_core.mapping.obstacles import NOTHING, Box, Cylinder, KnownObstacle, Obstacles
from navigation_core.safety.fences import Area, CircleArea, Fence, Point2
from navigation_core.safety.target_checks import FlightVolume

HEADROOM_M = 2.0
"""Height above its base from which a rover or boat passes below an obstacle."""

# A target right at the limit keeps the clearance to the wall there despite rounding.
_ROUNDING_M = 0.01
# Walls farther away do not affect paths around sensed obstacles, and slow down planning.
_WALLS_REACH_M = 60.0
_WALLS_STEP_M = 10.0
# Within this distance of the flight volume's rim, that has walls.
_RIM_NEAR_M = 2.0 * _WALLS_REACH_M


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
        # A rim that is far away has no wall among those that are looked at.
        rim_m = volume.radius_max_m - math.hypot(*(place or (0.0, 0.0)))
        is_at_rim = 0.0 <= rim_m < _RIM_NEAR_M
        clearance_m = self._config.vehicle_radius_m + self._config.margin_m + _ROUNDING_M
        key = (fence, fence_margin_m, volume, fence_holds, is_at_rim, clearance_m)
        if key != self._walls_key:
            self.fence, self._walls_key, self._walls_about = fence, key, None
            walls: tuple[KnownObstacle, ...] = ()
            if fence is not None and fence_holds:
                walls += fence_walls(fence, clearance_m - fence_margin_m)
            if is_at_rim:
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


# Largest distance of a polygon's corners from the circle that it approximates.
_SAGITTA_M = 0.25
_SIDES_MAX = 180
_LONGER_MAX = 3.0
_NAME = "fence"
_SHORTEST_M = 1e-3


def fence_walls(fence: Fence, shift_m: float) -> tuple[KnownObstacle, ...]:
    """Return the walls around the area that a fence allows, unbounded upwards and downwards.

    Args:
        fence: the vehicle's.
        shift_m: distance by which each wall is moved away from the allowed side.
    """
    walls: list[KnownObstacle] = []
    for area in fence.areas:
        if isinstance(area, CircleArea) and not area.inclusion:
            radius_m = max(area.radius_m - shift_m, 0.1)
            walls.append(Cylinder(_NAME, area.centre_enu_m, radius_m))
        else:
            walls += _walls(_corners(area), area.inclusion, shift_m, ())
    for index, area in enumerate(fence.alternatives):
        others = fence.alternatives[:index] + fence.alternatives[index + 1 :]
        walls += _walls(_corners(area), True, shift_m, others)
    return tuple(walls)


def _corners(area: Area) -> tuple[Point2, ...]:
    """Return corners in counter-clockwise order; the sides of a circle are tangents."""
    if isinstance(area, CircleArea):
        sides = _SIDES_MAX
        if area.radius_m > _SAGITTA_M:
            sides = math.ceil(math.pi / math.acos(1.0 - _SAGITTA_M / area.radius_m))
        sides = min(max(sides, 8), _SIDES_MAX)
        radius_m = area.radius_m / math.cos(math.pi / sides)
        angles = [math.tau * i / sides for i in range(sides)]
        x, y = area.centre_enu_m
        return tuple((x + radius_m * math.cos(a), y + radius_m * math.sin(a)) for a in angles)
    corners = area.corners_enu_m
    turned = corners[1:] + corners[:1]
    twice = math.fsum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(corners, turned, strict=True))
    return corners if twice >= 0.0 else corners[::-1]


def _walls(
    corners: tuple[Point2, ...], inclusion: bool, shift_m: float, others: tuple[Area, ...]
) -> list[Box]:
    outwards_m = shift_m if inclusion else -shift_m
    nexts = corners[1:] + corners[:1]
    # Sides that are moved apart meet elsewhere: farther out at a convex corner.
    longer_m = [
        outwards_m * _half_turn(corners[i - 1], corner, nexts[i])
        for i, corner in enumerate(corners)
    ]
    walls: list[Box | None] = []
    for i, (start, end) in enumerate(zip(corners, nexts, strict=True)):
        before_m, after_m = longer_m[i], longer_m[i + 1 - len(corners)]
        if not others:
            walls.append(_wall(start, end, outwards_m, before_m, after_m))
            continue
        walls += [
            _wall(
                a,
                b,
                outwards_m,
                before_m if a == start else 0.0,
                after_m if b == end else 0.0,
            )
            for a, b in _outside_of(start, end, others)
        ]
    return [wall for wall in walls if wall is not None]


def _wall(a: Point2, b: Point2, right_m: float, before_m: float, after_m: float) -> Box | None:
    """Return a side moved to its right and extended at both ends; None if none of it is left."""
    length_m = math.dist(a, b)
    if length_m < _SHORTEST_M or length_m + before_m + after_m < _SHORTEST_M:
        return None
    along = (b[0] - a[0]) / length_m, (b[1] - a[1]) / length_m
    middle_m = 0.5 * (length_m + after_m - before_m)
    middle = (
        a[0] + along[0] * middle_m + along[1] * right_m,
        a[1] + along[1] * middle_m - along[0] * right_m,
    )
    size_m = (length_m + before_m + after_m, 0.0)
    return Box(_NAME, middle, size_m, math.atan2(along[1], along[0]))


def _half_turn(before: Point2, corner: Point2, after: Point2) -> float:
    """Return the tangent of half the turn to the left at a corner, at most 3 in size."""
    first = math.atan2(corner[1] - before[1], corner[0] - before[0])
    second = math.atan2(after[1] - corner[1], after[0] - corner[0])
    turn = math.remainder(second - first, math.tau)
    return min(max(math.tan(0.5 * turn), -_LONGER_MAX), _LONGER_MAX)


def _outside_of(
    start: Point2, end: Point2, others: tuple[Area, ...]
) -> list[tuple[Point2, Point2]]:
    """Return the pieces of a side that are in none of the alternative areas."""
    cuts = {0.0, 1.0}
    for other in others:
        cuts |= {share for share in other.crossings(start, end) if 0.0 < share < 1.0}

    def at(share: float) -> Point2:
        if share == 1.0:
            return end
        return start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])

    return [
        (at(first), at(last))
        for first, last in itertools.pairwise(sorted(cuts))
        if not any(other.contains(at((first + last) / 2.0)) for other in others)
    ]
