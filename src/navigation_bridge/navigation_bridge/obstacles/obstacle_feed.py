"""All obstacle sources, combined in the map frame. No ROS.

Sensors of the vehicle (MAVLink) and of ROS feed an obstacle map; known obstacles and the boundary
of the vehicle's fence are added to it.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions.frames import Geodetic
from mavlink_vehicle.ranges import RangeAxes, RangesMeasured, RangeSource
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.sensor_poses import Carrier, SensorPose, carrier_at
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.obstacles.standing_obstacles import HEADROOM_M, StandingObstacles
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_bridge.vehicle.traits import drives
from navigation_core.geometry import Vector3
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacle_map import ObstacleMap, RayScan
from navigation_core.mapping.obstacles import NOTHING, Obstacles

Array: TypeAlias = NDArray[np.float64]

LASER_SCAN, POINT_CLOUD = "LaserScan", "PointCloud2"
# A beam that points farther down measures the ground (sine of 30 degrees).
_DOWNWARDS = 0.5
_ORIGIN_MOVED_M = 0.1
# A cloud takes 3 ms, several times that on a small computer; the same thread sends setpoints.
_LEAST_PERIOD_S = 0.08


@dataclass(frozen=True)
class SensorScan:
    """A scan in the sensor's axes (forward, left, up), or in the map frame from its origin.

    Attributes:
        in_map: whether directions are those of the map frame, seen from the map origin.
        directions: unit vectors, shape (N, 3).
        ranges_m: shape (N,); infinity: nothing within range; NaN: no reading.
        range_min_m: minimum range.
        range_max_m: maximum range.
        half_angle_rad: half of the width of each reading.
    """

    in_map: bool
    directions: Array
    ranges_m: Array
    range_min_m: float
    range_max_m: float
    half_angle_rad: float


@dataclass(frozen=True)
class SensorPoints:
    """A point cloud in the sensor's axes (forward, left, up), or in the map frame.

    Attributes:
        in_map: whether points are in the map frame.
        points_m: shape (N, 3), finite.
    """

    in_map: bool
    points_m: Array


@dataclass(frozen=True)
class JoinedObstacles:
    """All obstacles, joined: each the same object until something changes.

    Attributes:
        obstacles: all.
        seen: all where they are, without where something that moves is about to be; None for a
            vehicle that flies.
        sensed: the sensed ones.
        known: those of the configuration.
        parts: what they are joined from.
    """

    obstacles: Obstacles
    seen: Obstacles | None
    sensed: Obstacles
    known: Obstacles
    parts: tuple[Obstacles, Obstacles, Obstacles, bool]


# Slower than this, a vehicle flies nowhere; and by how much more it is said to see from then on.
_FLIES_M_S, _SEES_ON_M_S = 0.5, 3.0
# Joined from what no source returns, so that the first look joins anew.
_NO_PART = Obstacles()
_NONE_AROUND = JoinedObstacles(
    NOTHING, None, NOTHING, NOTHING, (_NO_PART, _NO_PART, _NO_PART, False)
)


class ObstacleFeed:
    """Obstacles of one vehicle, from all sources.

    Attributes:
        standing: static obstacles: the known ones, and the limits of the flight.
        reach_m: how far the scan that came last sees where the vehicle flies; infinite if unknown.
        moving: moving obstacles among the sensed ones.
        corners_enu_m: ends of what hides something, east and north.
        heard_s: when the kind of sensor with the longest silence was heard; None without sensors.
    """

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame, config: ObstacleConfig) -> None:
        """Start with the configured obstacles only."""
        self._vehicle = vehicle
        self._map_frame = map_frame
        self._config = config
        self.standing = StandingObstacles(vehicle, map_frame, config)
        self._map = ObstacleMap(config.map_size_m, config.cell_m, config.vehicle_radius_m)
        self._origin: Geodetic | None = None
        self._stood_m: float | None = None
        self._heard_s: dict[str, float] = {}
        self._taken_s: dict[str, float] = {}
        self._scans_until_s = -math.inf
        self.reach_m, self._looked_s = math.inf, -math.inf
        self.moving: tuple[Moving, ...] = ()
        self.corners_enu_m: tuple[tuple[float, float], ...] = ()
        self.heard_s: float | None = None
        self._assumed = NOTHING
        self._around = _NONE_AROUND
        self._placed_for: tuple[object, object, object] = (None, None, None)

    def start(self, now: float) -> None:
        """Start the silence timers of the configured sensors."""
        for topic, kind in (
            (self._config.scan_topic, LASER_SCAN),
            (self._config.points_topic, POINT_CLOUD),
        ):
            if topic:
                self._hear_of(kind, self._heard_s.get(kind, now))

    def configure(self, config: ObstacleConfig) -> None:
        """Apply other settings; size and cells of the map stay as they are."""
        self._config = config
        self.standing.configure(config)

    def assume(self, sensed: Obstacles) -> None:
        """Count obstacles as sensed that no sensor here has seen: those of a rehearsal."""
        self._assumed = sensed
        self._around = _NONE_AROUND

    # --- the obstacles ---------------------------------------------------------------

    def look(self) -> JoinedObstacles:
        """Return all obstacles: the same object until something changes."""
        standing, last = self.standing, self._around
        placed, place_for = (
            self._placed_for,
            (
                self._config.known,
                self._map_frame.frame,
                self._vehicle.profile,
            ),
        )
        if not all(map(operator.is_, placed, place_for)):
            self._placed_for = place_for
            standing.place()
        # Without any sensor the map is empty.
        sensed = NOTHING if self.heard_s is None else self._map.obstacles()
        known, walls = standing.known, standing.walls
        was_known, was_sensed, were_walls, on_ground = last.parts
        if (
            known is was_known
            and sensed is was_sensed
            and walls is were_walls
            and standing.on_ground is on_ground
        ):
            return last
        parts = (known, sensed, walls, standing.on_ground)
        kept = sensed is was_sensed and on_ground
        sensed, seen = sensed.joined(self._assumed), None
        if standing.on_ground:
            sensed = last.sensed if kept else sensed.endless()
            shown = self._map.seen().joined(self._assumed).endless()
            seen = known.joined(shown).joined(walls)
        joined = known.joined(sensed).joined(walls)
        self._around = JoinedObstacles(joined, seen, sensed, known, parts)
        return self._around

    @property
    def obstacles(self) -> Obstacles:
        """All obstacles: the same object until something changes."""
        return self.look().obstacles

    @property
    def has_sensor(self) -> bool:
        """True if a sensor has ever reported, or is configured."""
        return self.heard_s is not None

    @property
    def map_size_and_cell_m(self) -> tuple[float, float]:
        """Sides of the map of sensed obstacles and of its cells."""
        return self._config.map_size_m, self._config.cell_m

    @property
    def sensor_pose(self) -> SensorPose:
        """Pose of the sensors of ROS topics on the vehicle."""
        return self._config.sensor_pose

    @property
    def clearance_m(self) -> float:
        """Clearance that paths are planned with, from the vehicle's middle."""
        return self._config.vehicle_radius_m + self._config.margin_m

    @property
    def timeout_s(self) -> float:
        """Silence after which a sensor counts as lost."""
        return self._config.sensor_timeout_s

    def ages_s(self, now: float) -> dict[str, float]:
        """Return the age of the last reading of each kind of sensor, by its name."""
        return {kind: now - heard_s for kind, heard_s in self._heard_s.items()}

    def age_s(self, now: float) -> float:
        """Return the longest silence of any kind of sensor; 0 without sensors."""
        return 0.0 if self.heard_s is None else now - self.heard_s

    # --- sensor readings -------------------------------------------------------------

    def take_ranges(self, measured: RangesMeasured, now: float) -> None:
        """Process a measurement of a sensor of the vehicle."""
        beam = measured.source is RangeSource.DISTANCE_SENSOR
        if beam and abs(measured.directions[0][2]) > _DOWNWARDS:
            return
        carrier = self._hear(measured.source.value, now)
        if carrier is None:
            return
        if not beam:
            self._scans_until_s = now + self._config.sensor_timeout_s
        elif now < self._scans_until_s:
            return  # a scan has the same in finer resolution
        scan = RayScan(
            carrier.position_enu_m,
            np.array(measured.directions, dtype=np.float64) @ _to_map(carrier, measured.axes).T,
            np.array(measured.ranges_m, dtype=np.float64),
            measured.range_min_m,
            measured.range_max_m,
            0.5 * measured.width_rad,
        )
        self._integrate(scan, now)

    def _integrate(self, scan: RayScan, now: float) -> None:
        ground_m = self._ground_m()
        self._look_ahead(scan, ground_m, now)
        self._map.integrate(scan, ground_m, now)
        self.moving, self.corners_enu_m = self._map.moving, self._map.corners_enu_m

    def _look_ahead(self, scan: RayScan, ground_m: float | None, now: float) -> None:
        """Take how far a scan sees in the direction of flight; more only little by little.

        The speed depends on it, and the tilt on the speed.
        """
        position, reach_m = self._vehicle.state.global_position, scan.range_max_m
        if position is not None and math.hypot(*position.velocity_ned_m_s[:2]) > _FLIES_M_S:
            north, east, _ = position.velocity_ned_m_s
            reach_m = scan.sight_m(math.atan2(north, east), ground_m)
        passed_s, self._looked_s = now - self._looked_s, now
        self.reach_m = min(reach_m, self.reach_m + _SEES_ON_M_S * passed_s)

    def take_scan(self, scan: SensorScan, now: float) -> None:
        """Process a scan from ROS, unless it follows another within 0.08 s."""
        carrier = None if self._is_soon(LASER_SCAN, now) else self._hear(LASER_SCAN, now)
        if carrier is None:
            return
        origin, turned = self._mounted(carrier)
        if scan.in_map:
            origin, turned = (0.0, 0.0, 0.0), np.eye(3)
        rays = RayScan(
            origin,
            scan.directions @ turned.T,
            scan.ranges_m,
            scan.range_min_m,
            scan.range_max_m,
            scan.half_angle_rad,
        )
        self._integrate(rays, now)

    def take_points(self, cloud: SensorPoints, now: float) -> None:
        """Process a point cloud from ROS, unless it follows another within 0.08 s."""
        carrier = None if self._is_soon(POINT_CLOUD, now) else self._hear(POINT_CLOUD, now)
        if carrier is None:
            return
        origin, turned = self._mounted(carrier)
        if cloud.in_map:
            points = cloud.points_m - (0.0, 0.0, carrier.height_m - carrier.position_enu_m[2])
        else:
            points = cloud.points_m @ turned.T + np.array(origin)
        ground_m = self._ground_m()
        if ground_m is None:
            ground_m = carrier.position_enu_m[2]
            points = points[points[:, 2] < ground_m + HEADROOM_M]
        self._map.integrate_points(origin, points, ground_m, now)
        self.moving, self.corners_enu_m = self._map.moving, self._map.corners_enu_m

    def _is_soon(self, kind: str, now: float) -> bool:
        taken_s = self._taken_s.get(kind, -math.inf)
        if now - taken_s < _LEAST_PERIOD_S:
            return True
        self._taken_s[kind] = now
        return False

    def _hear(self, kind: str, now: float) -> Carrier | None:
        """Return the pose of the vehicle, if known, and centre the map on it.

        From the first reading on, only readings that can be placed count as heard.
        """
        self._hear_of(kind, self._heard_s.get(kind, now))
        state, origin = self._vehicle.state, self._map_frame.origin
        carrier = carrier_at(state, self._map_frame, drives(self._vehicle.profile), now)
        if carrier is None or origin is None:
            return None
        before = self._origin or origin
        if origin != before and math.hypot(*self._map_frame.enu(before)) > _ORIGIN_MOVED_M:
            self._map.clear()
            self.moving, self.corners_enu_m = (), ()
            self._stood_m = None
        self._origin = origin
        self._hear_of(kind, now)
        if state.landed_state is LandedState.ON_GROUND:
            self._stood_m = carrier.height_m
        self._map.recentre(carrier.position_enu_m)
        return carrier

    def _hear_of(self, kind: str, heard_s: float) -> None:
        self._heard_s[kind] = heard_s
        self.heard_s = min(self._heard_s.values())

    def _mounted(self, carrier: Carrier) -> tuple[Vector3, Array]:
        """Return position of the topics' sensor, and rotation from its axes to the map's."""
        pose = self._config.sensor_pose
        offset = carrier.from_flu @ np.array(pose.position_flu_m)
        x, y, z = (carrier.position_enu_m + offset).tolist()
        return (x, y, z), np.asarray(carrier.from_flu @ pose.to_body())

    def _ground_m(self) -> float | None:
        """Return the map z of the ground, None for rovers and boats.

        It is the height at which the vehicle last stood. The home of a PX4 moves, by a metre in a
        minute (observed), so it is only the second choice.
        """
        if drives(self._vehicle.profile):
            return None
        if self._stood_m is not None:
            return self._stood_m
        return self._map_frame.ground_enu_m(self._vehicle.state)


def _to_map(carrier: Carrier, axes: RangeAxes) -> Array:
    """Return the matrix that rotates a measurement's axes into those of the map."""
    if axes is RangeAxes.BODY:
        return carrier.from_body
    return carrier.from_level if axes is RangeAxes.LEVEL else carrier.from_north
