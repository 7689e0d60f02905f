"""Vehicles in a world: wind on them, ground below them, what they hit, what they see.

Part of `simulation` (the same layer): joins `world` with the lanes of `physics`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.exchange import RangeReading, Vector
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.physics.copter_pipeline import Physics
from mavlink_sitl.world import disturbance, range_finder, shapes
from mavlink_sitl.world.model import RangeSensor, World

DRAW_S = 0.2
"""Gusts and drop-outs are thrown this often"""
VEHICLE_RADIUS_M = 0.3
VEHICLE_HALF_HEIGHT_M = 0.1
FASTEST_M_S = 40.0
"""No vehicle moves faster; so far from everything, nothing can be hit for a while"""

Array = NDArray[np.float64]


class Hit(NamedTuple):
    """A vehicle has flown into something."""

    lane: int
    obstacle: str
    speed_m_s: float


class TrueClearance(NamedTuple):
    """The true distance of a vehicle to the nearest obstacle.

    Attributes:
        distance_m: from the vehicle's place to the obstacle's surface, 0 within; infinity where
            there is no obstacle.
        obstacle: its name.
        moves: whether it is one that moves.
    """

    distance_m: float
    obstacle: str
    moves: bool


class Environment:
    """The world as the vehicles of a simulation feel it.

    Args:
        physics: the bodies of a fleet; wind and ground are given to them here.
        rows: the places of the fleet's vehicles in the simulation.
        frames: the local frames with which all vehicles of the simulation begin.
        seed: of gusts, noise and drop-outs.

    Attributes:
        collided: shape (N,), vehicles that have hit something; replaced when it changes.
        still: without gusts, obstacles and slopes: `step` would do nothing.
    """

    def __init__(
        self,
        world: World,
        physics: Physics,
        rows: Sequence[int],
        frames: Sequence[LocalFrame],
        seed: int,
    ) -> None:
        self.world = world
        self.collided = np.zeros(physics.count, dtype=np.bool_)
        self._physics = physics
        self._seed = seed
        self._rows = rows
        # The fleet's firmware counts the metres of the world.
        origin = world.origin or self._below(frames[0].origin)
        self._frame = LocalFrame(origin, frames[rows[0]].projection)
        self._offset = np.zeros((physics.count, 3))
        for lane, row in enumerate(rows):
            self.move_origin(lane, frames[row].origin)
        self._shapes = shapes.Shapes(world.obstacles)
        self._gusts = disturbance.Gusts(world.wind, seed, physics.o, DRAW_S, rows)
        self._own_wind = np.zeros((physics.count, 3))
        self._dropouts = disturbance.Dropouts(world.gps, seed, rows)
        self._draw_ticks = round(DRAW_S / physics.dt_s)
        self._check_tick = 0
        self._tick = 0
        self._uneven = bool(world.obstacles or world.ground.heights_m)
        self.still = not (self._uneven or world.wind.gust_m_s or world.range_sensor)
        self._seen: tuple[int, Array] | None = None
        physics.sensor_model = physics.sensor_model._replace(position_sigma_m=world.gps.noise_m)
        self._feel_wind(0.0)
        self._stand_on_ground()

    def _below(self, home: GeoPoint) -> GeoPoint:
        """The world's origin when it has none: the ground under the first home is as high."""
        zero = np.zeros(1)
        height = float(shapes.ground_height_m(self.world.ground, zero, zero)[0])
        return home._replace(altitude_amsl_m=home.altitude_amsl_m - height)

    def move_origin(self, index: int, origin: GeoPoint) -> None:
        """A vehicle's local frame begins somewhere else now."""
        self._offset[index] = self._frame.to_local(origin)

    def positions(self) -> Array:
        """The positions of the vehicles in the world, shape (N, 3), NED metres."""
        return self._physics.table("north_m", "east_m", "down_m") + self._offset

    def velocities(self) -> Array:
        """Their velocities, shape (N, 3), NED m/s."""
        return self._physics.table("velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s")

    def stands(self) -> Array:
        """Which of them are on the ground, shape (N, 1)."""
        return np.asarray(self._physics.table("on_ground"), dtype=np.float64)

    def _ground_down(self, position: Array) -> Array:
        """Height of what a vehicle would come down on, in its own frame, shape (N,)."""
        down = -shapes.ground_height_m(self.world.ground, position[:, 0], position[:, 1])
        if len(self._shapes):
            above = self._shapes.top_down_m >= position[:, 2:3] - VEHICLE_HALF_HEIGHT_M
            roof = above & (self._shapes.gaps(position) <= 0.0)
            tops = np.where(roof, self._shapes.top_down_m, np.inf)
            down = np.minimum(down, tops.min(axis=1))
        return np.asarray(down - self._offset[:, 2])

    def _stand_on_ground(self) -> None:
        physics = self._physics
        ground = self._ground_down(self.positions())
        physics.ground_down_m = physics.o.pack(ground.tolist())
        physics.body = physics.body._replace(down_m=physics.o.pack(ground.tolist()))

    # Time.

    def step(self, tick: int) -> list[Hit]:
        """The world's part of a tick, after the bodies have moved; returns the collisions."""
        self._tick = tick
        if self.world.wind.gust_m_s:
            if tick % self._draw_ticks == 0:
                self._gusts.draw()
            self._feel_wind(tick % self._draw_ticks / self._draw_ticks)
        if not self._uneven or tick < self._check_tick:
            return []
        self._shapes.move_to(tick * self._physics.dt_s)
        position = self.positions()
        ground = self._ground_down(position)
        self._physics.ground_down_m = self._physics.o.pack(ground.tolist())
        return self._collide(tick, position)

    def gps_changes(self, time_s: float) -> list[tuple[int, bool]]:
        """Vehicles whose receivers lose (False) or regain (True) their fix at random, by row."""
        return self._dropouts.changes(time_s)

    def blow(self, index: int, velocity_ned_m_s: Vector) -> None:
        """A wind on one vehicle, on top of the world's."""
        self._own_wind[index] = velocity_ned_m_s
        self._feel_wind(self._tick % self._draw_ticks / self._draw_ticks)

    def _feel_wind(self, part: float) -> None:
        o, (n, e, d) = self._physics.o, self._gusts.velocity(part)
        own = [o.pack(column) for column in self._own_wind.T.tolist()]
        self._physics.wind = (o.full(0.0) + n + own[0], e + own[1], d + own[2])

    def _collide(self, tick: int, position: Array) -> list[Hit]:
        if not len(self._shapes):
            self._check_tick = tick + 1
            return []
        found = self._shapes
        gaps = found.gaps(position)
        apart = found.heights_apart(position[:, 2])
        room = np.hypot(np.maximum(gaps - VEHICLE_RADIUS_M, 0.0), apart)
        fastest = FASTEST_M_S + found.fastest_m_s
        self._check_tick = tick + max(1, int(float(room.min()) / (fastest * self._physics.dt_s)))
        touching = (gaps < VEHICLE_RADIUS_M) & (apart < VEHICLE_HALF_HEIGHT_M)
        # On a roof one stands, one does not hit it.
        touching &= position[:, 2:3] > found.top_down_m + 1e-3
        hits = []
        for index in np.flatnonzero(touching.any(axis=1) & ~self.collided):
            which = int(np.argmin(np.where(touching[index], gaps[index], np.inf)))
            speed_m_s = float(np.linalg.norm(self.velocities()[index]))
            hits.append(Hit(int(index), found.names[which], speed_m_s))
        for hit in hits:
            self.wreck(hit.lane)
        return hits

    def wreck(self, index: int) -> None:
        """A vehicle has hit something: it stops at once and flies no more."""
        # Another array: snapshots of the truth keep the old one.
        self.collided = self.collided.copy()
        self.collided[index] = True
        self._physics.stop_dead(index)

    def clearance(self, index: int) -> TrueClearance:
        """The distance of one vehicle to its nearest obstacle."""
        found = self._shapes
        if not len(found):
            return TrueClearance(math.inf, "", False)
        found.move_to(self._tick * self._physics.dt_s)
        place = self.positions()[index : index + 1]
        apart = np.hypot(found.gaps(place), found.heights_apart(place[:, 2]))[0]
        nearest = int(apart.argmin())
        return TrueClearance(float(apart[nearest]), found.names[nearest], found.moves[nearest])

    # Sensors.

    def pose(self, index: int) -> tuple[Array, Array]:
        """One vehicle's true position in the world, and the matrix from its axes to NED."""
        motion = self._physics.motion(index, truth=True)
        turn = range_finder.to_ned(*np.array([motion[6:9]]).T)[0]
        return np.array(motion[:3]) + self._offset[index], turn

    def measure_ranges(self, index: int) -> RangeReading | None:
        """One vehicle's range sensors, or None when it has none."""
        sensor = self.world.range_sensor
        if sensor is None:
            return None
        if self._seen is None or self._seen[0] != self._tick:
            self._seen = (self._tick, self._look(sensor))
        seed = f"range:{self._seed}:{self._rows[index]}:{self._tick}"
        return range_finder.measure(sensor, self._seen[1][index], seed)

    def _look(self, sensor: RangeSensor) -> Array:
        """The truth for all vehicles, shape (N, 361): along `range_finder.BODY_RAYS`."""
        physics = self._physics
        self._shapes.move_to(self._tick * self._physics.dt_s)
        motions = np.array([physics.motion(lane, truth=True) for lane in range(physics.count)])
        turn = range_finder.to_ned(*motions[:, 6:9].T)
        rays = np.einsum("nij,rj->nri", turn, range_finder.BODY_RAYS)
        scanner = self.positions() - range_finder.MOUNT_M * turn[:, :, 2]
        reach_m = max(sensor.reach_m, sensor.reach_down_m) + range_finder.MOUNT_M
        seen = self._shapes.cast(scanner, rays, reach_m)
        # Simulated rovers stay level on a slope, so their sensors would look into the hill.
        sees_ground = slice(None) if physics.flies else slice(-1, None)
        on_ground = shapes.cast_on_ground(self.world.ground, scanner, rays[:, sees_ground], reach_m)
        seen[:, sees_ground] = np.minimum(seen[:, sees_ground], on_ground)
        return seen
