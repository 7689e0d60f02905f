"""An obstacle map of range readings: evidence accumulates, fades, and moves with the vehicle.

The map is a square window of columns about the vehicle. A scanner that turns in a plane knows
nothing of heights: what it hits is taken to be endless upwards and downwards, until rays are
seen to go over it, which brings its top down to them, or under it, which lifts its bottom. A
cloud of points knows heights, and what it hits reaches one cell up and down. A ray that goes
through at the height of the hits is evidence against them, so what has moved away frees its
place.
"""

from __future__ import annotations

import math

import numpy as np

from navigation_core.geometry import Vector3
from navigation_core.mapping.evidence_columns import Columns, Indices, Mask
from navigation_core.mapping.moving_obstacles import Movers, Moving
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.mapping.sensor_rays import Fan, RayScan, Readings, cloud_fan

__all__ = ["ObstacleMap", "RayScan"]

# A hit no higher than this above the ground, and a share of the distance more, is the ground: it
# is not even, and an attitude error of a degree moves a hit at 30 m by half a metre. Never more
# than half way up to the sensor: one that is close to the ground sees its obstacles close to the
# ground, too.
_GROUND_M = 0.3
_GROUND_PER_M = 0.02
# Times ahead for which a moving obstacle's place is predicted, and the radius of each. It may turn
# at any moment, so the more distant future is left out. The radii get smaller, so that a vehicle
# that is inside already is led out away from the obstacle, and never towards it.
_PREDICTED_AHEAD_S = np.arange(0.3, 2.2, 0.3)
_PREDICTED_RADII_M = 0.5 - 0.2 * _PREDICTED_AHEAD_S


class ObstacleMap:
    """Obstacles about a vehicle, from what its range sensors see; see the module.

    Readings for which no attitude and position are known must be kept from it.
    """

    def __init__(
        self, size_m: float = 80.0, cell_m: float = 0.25, own_radius_m: float = 0.5
    ) -> None:
        """Start without obstacles, about the origin.

        Args:
            size_m: side of the window; what is outside is not kept.
            cell_m: side of a column.
            own_radius_m: hits nearer to the sensor than this are the vehicle itself.
        """
        self._columns = Columns(size_m, cell_m)
        self._movers = Movers()
        self._own_radius_m = own_radius_m
        self._obstacles = self._seen = Obstacles()
        self._version = self._columns.version
        self._moving = self._movers.moving

    def clear(self) -> None:
        """Forget all obstacles."""
        self._columns.clear()
        self._movers.clear()

    def recentre(self, position_enu_m: Vector3) -> None:
        """Roll the window to be about the vehicle; obstacles outside are forgotten."""
        self._columns.recentre(position_enu_m[0], position_enu_m[1])

    def obstacles(self) -> Obstacles:
        """Return the obstacles: the same object as before while nothing has changed.

        Where something that moves is about to be is one, too.
        """
        moving = self._movers.moving
        if self._version != self._columns.version or self._moving != moving:
            self._version, self._moving = self._columns.version, moving
            self._seen = Obstacles(self._columns.posts())
            self._obstacles = self._seen.joined(Obstacles(self._ahead()))
        return self._obstacles

    def seen(self) -> Obstacles:
        """Return the obstacles without where something is about to be."""
        self.obstacles()
        return self._seen

    @property
    def moving(self) -> tuple[Moving, ...]:
        """The detected moving obstacles."""
        return self._movers.moving

    @property
    def corners_enu_m(self) -> tuple[tuple[float, float], ...]:
        """Ends of surfaces that hide something from the last scan, east and north."""
        return self._movers.corners_enu_m

    def integrate(self, scan: RayScan, ground_enu_m: float | None, now: float) -> None:
        """Process a scan, or a single beam.

        Args:
            scan: the reading. Beams within 30 deg of straight up or down are left out.
            ground_enu_m: map z of the ground below the vehicle. None if it is not known, and
                for what drives: its scanner looks along the ground.
            now: time of the reading in seconds.
        """
        readings = Readings.of(scan, self._own_radius_m)
        hits, origin = readings.hits(), scan.origin_enu_m
        stands = _stands(hits.away_m, hits.away_m * hits.slopes, origin, ground_enu_m)
        east, north, above, shares = hits.points(0.7 * self._columns.cell_m, stands)
        columns, inside = self._columns.find(east + origin[0], north + origin[1])
        heights = above[inside] + origin[2]
        hit = self._columns.hit(columns[inside], heights, shares[inside], math.inf)
        fan = readings.fan()
        self._carve(fan, origin, ground_enu_m, hit)
        self._follow(fan, origin, ground_enu_m, scan.range_max_m, now)

    def integrate_points(
        self, origin_enu_m: Vector3, points_enu_m: Array, ground_enu_m: float | None, now: float
    ) -> None:
        """Process a cloud of points.

        Args:
            origin_enu_m: where the sensor is in the map frame.
            points_enu_m: what it has hit, in the map frame, shape (N, 3). Rows that are not
                finite, and what is nearer than the vehicle's own radius, are left out.
            ground_enu_m: map z of the ground below the vehicle; None if it is not known, and
                then the ground is an obstacle, too.
            now: time of the cloud in seconds.
        """
        points = np.asarray(points_enu_m, dtype=np.float64).reshape(-1, 3)
        offsets = points - np.array(origin_enu_m)
        # NaN is not above anything, and infinity is nowhere.
        away = np.sqrt((offsets * offsets).sum(axis=1))
        outside = (away > self._own_radius_m) & np.isfinite(away)
        points, offsets = points[outside], offsets[outside]
        level = np.hypot(offsets[:, 0], offsets[:, 1])
        stands = points[_stands(level, offsets[:, 2], origin_enu_m, ground_enu_m)]
        columns, inside = self._columns.find(stands[:, 0], stands[:, 1])
        heights, shares = stands[inside, 2], np.ones(int(inside.sum()))
        hit = self._columns.hit(columns[inside], heights, shares, self._columns.cell_m)
        fan = cloud_fan(offsets)
        self._carve(fan, origin_enu_m, ground_enu_m, hit)
        self._follow(fan, origin_enu_m, ground_enu_m, math.inf, now)

    def _ahead(self) -> Array:
        """Return posts where what moves will be, as high as it is now."""
        tables = [np.empty((0, 5))]
        for one in self._moving:
            columns, inside = self._columns.find(*one.points_enu_m[:, :2].T)
            bottoms, tops = self._columns.ends_m(columns[inside])
            # The rest of the code takes obstacles to stand still, for as long as it plans ahead.
            for in_s, radius_m in zip(_PREDICTED_AHEAD_S, _PREDICTED_RADII_M, strict=True):
                moved = one.points_enu_m[inside, :2] + in_s * np.array(one.velocity_enu_m_s)
                radii = np.full(len(moved), radius_m)
                tables.append(np.column_stack([moved, radii, bottoms, tops]))
        return np.concatenate(tables)

    def _follow(
        self,
        fan: Fan,
        origin_enu_m: Vector3,
        ground_enu_m: float | None,
        reach_m: float,
        now: float,
    ) -> None:
        """Look for what moves; rays as long as the reach have hit nothing."""
        above = fan.free_m * fan.slopes
        has_hit = (fan.free_m > 0.0) & (np.hypot(fan.free_m, above) < 0.99 * reach_m)
        has_hit &= _stands(fan.free_m, above, origin_enu_m, ground_enu_m)
        self._movers.take(fan, has_hit, origin_enu_m, now)

    def _carve(
        self, fan: Fan, origin_enu_m: Vector3, ground_enu_m: float | None, hit: Indices
    ) -> None:
        east, north = self._columns.middles_m()
        if not len(east) or not len(fan.bearings_rad):
            return
        east, north = east - origin_enu_m[0], north - origin_enu_m[1]
        # No ray goes farther.
        known = (east * east + north * north < fan.free_m.max() ** 2).nonzero()[0]
        east, north = east[known], north[known]
        away = np.hypot(east, north)
        above, seen = fan.passes(away, np.arctan2(north, east), self._columns.cell_m)
        passed = seen.any(axis=1)
        known, away, above, seen = known[passed], away[passed], above[passed], seen[passed]
        # A ray that is as low as the ground has met the ground, which shows in no range.
        seen &= _stands(away[:, None], above, origin_enu_m, ground_enu_m)
        passed = seen.any(axis=1)
        self._columns.pass_by(known[passed], above[passed] + origin_enu_m[2], seen[passed], hit)


def _stands(
    away_m: Array, above_m: Array, origin_enu_m: Vector3, ground_enu_m: float | None
) -> Mask:
    """Whether points at a distance in the plane from a sensor and above it are no ground."""
    if ground_enu_m is None:
        return np.ones(above_m.shape, dtype=np.bool_)
    height_m = max(origin_enu_m[2] - ground_enu_m, 0.0)
    ground = np.minimum(_GROUND_M + _GROUND_PER_M * away_m, 0.5 * height_m) - height_m
    # Only a ray that descends meets the ground.
    return np.asarray((above_m > ground) | (above_m >= 0.0))
