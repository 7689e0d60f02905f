"""Turns a scan or a point cloud into rays: hits and free space.

A scanner that turns about its upright axis gives one ray for each bearing, a cloud has many
above each other. Both become a fan: for each bearing the rays by their slope, each free as far
as it goes. A column of the map then looks up the rays of its own bearing, which costs nothing
for the empty space between, and leaves out no column between two rays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import Vector3

__all__ = ["Fan", "Hits", "RayScan", "Readings", "cloud_fan"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

# A ray steeper than this says what is above or below the vehicle, not what is beside it: it has
# no bearing to speak of, and a range finder that looks down finds the ground.
_STEEP_SLOPE = math.tan(math.radians(60.0))
# A sector wider than this is a narrow beam with its neighbours missing (four or eight sensors
# about a vehicle), or a sonar, which hears least at its edges: only the core says anything.
_HALF_ANGLE_MAX_RAD = math.radians(5.0)
# A sector's range is that of the nearest obstacle in it, somewhere on the arc. Close to the sensor
# all of the arc is taken to be hit. Farther away only this much to each side of its middle is,
# and that counts for no more than one ray that goes through: enough to find a post, and to leave
# open a gap between two of them. The arc narrows as the vehicle comes nearer, and the parts that
# it leaves are seen to be free.
_ARC_M = 0.5
_ARC_SHARE = 0.5
# Two neighbours that hit at about the same distance, as shares of it and at least in metres,
# have hit one surface: the arc between them is hit, too. Not so where sectors are wider than
# this: what is said there of the place between two hits is a guess, and a target may be there.
_SAME_SURFACE = 0.1
_SAME_SURFACE_M = 0.75
_SECTOR_MAX_M = 2.5
_HALF_DIAGONAL = math.sqrt(0.5)
# Bearings and slopes into which a cloud is sorted, finer than a vehicle is wide within 25 m.
_CLOUD_STEP_RAD = math.radians(2.0)
# Beams this far to each side of a course look along it; less of a fall is none.
_AHEAD_RAD, _LEAST_FALL = math.radians(10.0), 1e-6


@dataclass(frozen=True)
class RayScan:
    """One turn, sector or beam of a range sensor that looks about itself, or one way.

    Attributes:
        origin_enu_m: where the sensor is in the map frame, shape (3,).
        directions_enu: unit vectors along the middles of the beams, shape (N, 3), in the map
            frame: the attitude of vehicle and sensor is in them. No two have the same bearing.
        ranges_m: along them, shape (N,). Infinity, or more than the reach: nothing is there.
            NaN: no reading, neither free nor hit.
        range_min_m: what is nearer is no reading: the sensor does not see it rightly.
        range_max_m: the reach.
        half_angle_rad: half of what a beam or sector is wide; the range is that of the nearest
            thing in there.
    """

    origin_enu_m: Vector3
    directions_enu: Array
    ranges_m: Array
    range_min_m: float
    range_max_m: float
    half_angle_rad: float

    def sight_m(self, course_enu_rad: float, ground_enu_m: float | None) -> float:
        """Return how far it sees along a course: to its reach, or to where it meets the ground.

        A vehicle that has its nose down to be fast looks at the ground with what points ahead.

        Args:
            course_enu_rad: counter-clockwise from east.
            ground_enu_m: map z of the ground; None if it is not known, or the sensor is level.
        """
        if ground_enu_m is None or not len(self.directions_enu):
            return self.range_max_m
        bearing, slope, level = _polar(np.asarray(self.directions_enu, dtype=np.float64))
        aside = np.abs((bearing - course_enu_rad + math.pi) % math.tau - math.pi)
        ahead = aside <= max(_AHEAD_RAD, float(np.nanmin(aside)))
        height_m = max(self.origin_enu_m[2] - ground_enu_m, 0.0)
        falls = np.maximum(-slope[ahead], _LEAST_FALL)
        reach_m = np.minimum(self.range_max_m * level[ahead], height_m / falls)
        return float(np.nanmin(reach_m))


@dataclass(frozen=True)
class Fan:
    """Free rays from a point.

    Attributes:
        bearings_rad: ascending, counter-clockwise from east, shape (B,).
        half_angle_rad: how far to each side of its bearing a ray is free.
        slopes: rise per metre of path in the plane, shape (B, K).
        free_m: how far it is free in the plane, shape (B, K); 0 where there is no ray.
    """

    bearings_rad: Array
    half_angle_rad: float
    slopes: Array
    free_m: Array

    def passes(self, away_m: Array, bearing_rad: Array, cell_m: float) -> tuple[Array, Mask]:
        """Return the rays that go through columns and beyond.

        Args:
            away_m: from the origin to the columns in the plane, shape (N,).
            bearing_rad: of the columns, counter-clockwise from east, shape (N,).
            cell_m: side of a column.

        Returns:
            How far above the origin the rays are there, and whether there is such a ray, both
            of shape (N, K).
        """
        ray, aside = _nearest_bearing(self.bearings_rad, bearing_rad)
        # A beam frees each column that it touches, as it would fill each that it hits.
        width = self.half_angle_rad + _HALF_DIAGONAL * cell_m / np.maximum(away_m, cell_m)
        # A hit may lie in the next column already, so the last column's diagonal is not freed.
        beyond = self.free_m[ray] - 1.5 * cell_m
        seen = (aside <= width)[:, None] & (away_m[:, None] < beyond)
        return away_m[:, None] * self.slopes[ray], np.asarray(seen)


@dataclass(frozen=True)
class Readings:
    """The valid readings of a scan, in the order of their bearings.

    Attributes:
        scan: of which they are.
        bearings_rad: ascending, counter-clockwise from east, shape (N,).
        slopes: rise per metre in the plane, shape (N,).
        away_m: range in the plane, infinity for all that hit nothing, shape (N,).
        free_m: how far the ray is free in the plane, shape (N,).
    """

    scan: RayScan
    bearings_rad: Array
    slopes: Array
    away_m: Array
    free_m: Array

    @classmethod
    def of(cls, scan: RayScan, own_radius_m: float) -> Readings:
        """Return the readings of a scan.

        Args:
            scan: the scan.
            own_radius_m: what is nearer than this is the vehicle itself.
        """
        directions = np.asarray(scan.directions_enu, dtype=np.float64)
        ranges = np.asarray(scan.ranges_m, dtype=np.float64)
        bearing, slope, level = _polar(directions)
        is_valid = ranges >= max(scan.range_min_m, own_radius_m)
        is_valid &= np.isfinite(directions).all(axis=1) & (np.abs(slope) < _STEEP_SLOPE)
        order = bearing.argsort()
        order = order[is_valid[order]]
        ranges, level = ranges[order], level[order]
        away = np.where(ranges > scan.range_max_m, np.inf, ranges * level)
        free = np.minimum(ranges, scan.range_max_m) * level
        return cls(scan, bearing[order], slope[order], away, free)

    @property
    def half_angle_rad(self) -> float:
        """Half of the width of a reading that counts."""
        return min(self.scan.half_angle_rad, _HALF_ANGLE_MAX_RAD)

    def fan(self) -> Fan:
        """Return the free rays."""
        return Fan(
            self.bearings_rad, self.half_angle_rad, self.slopes[:, None], self.free_m[:, None]
        )

    def hits(self) -> Hits:
        """Return the arcs that were hit."""
        hit = np.isfinite(self.away_m)
        away, bearing, half = self.away_m[hit], self.bearings_rad[hit], self.half_angle_rad
        lone = np.minimum(half, _ARC_M / np.maximum(away, _ARC_M))
        before, after = _goes_on(away, bearing, half)
        right, left = np.where(before, half, lone), np.where(after, half, lone)
        return Hits(away, bearing, self.slopes[hit], right, left, before, after)


@dataclass(frozen=True)
class Hits:
    """Arcs that were hit, each of shape (N,).

    Attributes:
        away_m: from the sensor in the plane.
        bearings_rad: of the middles.
        slopes: rise per metre in the plane.
        right_rad: how far each reaches clockwise.
        left_rad: how far each reaches counter-clockwise.
        on_right: whether the same surface was hit clockwise of it.
        on_left: the same counter-clockwise.
    """

    away_m: Array
    bearings_rad: Array
    slopes: Array
    right_rad: Array
    left_rad: Array
    on_right: Mask
    on_left: Mask

    def points(self, step_m: float, which: Mask) -> tuple[Array, Array, Array, Array]:
        """Return points on some of the arcs: east, north and above the sensor, each (M,).

        And how much of a hit each of them is, from 0 to 1, shape (M,).

        Args:
            step_m: how far apart points on an arc are at most.
            which: of the arcs, shape (N,).
        """
        width = self.right_rad + self.left_rad
        steps = math.ceil(float((self.away_m * width).max(initial=0.0)) / step_m) + 1
        away, right = self.away_m[which, None], self.right_rad[which, None]
        aside = width[which, None] * np.arange(steps) / max(steps - 1, 1) - right
        bearing = self.bearings_rad[which, None] + aside
        sure = np.where(aside < 0.0, self.on_right[which, None], self.on_left[which, None])
        sure |= np.abs(aside) * away <= step_m
        above = np.repeat(self.away_m[which] * self.slopes[which], steps)
        east, north = (away * np.cos(bearing)).ravel(), (away * np.sin(bearing)).ravel()
        return east, north, above, np.where(sure, 1.0, _ARC_SHARE).ravel()


def cloud_fan(offsets_m: Array) -> Fan:
    """Return the free rays to points, as offsets from the sensor, shape (N, 3).

    They are sorted by bearing and slope, and the nearest point ends each.
    """
    bearing, slope, _ = _polar(offsets_m)
    away = np.hypot(offsets_m[:, 0], offsets_m[:, 1])
    steep = math.atan(_STEEP_SLOPE)
    bearings, layers = round(math.tau / _CLOUD_STEP_RAD), round(2.0 * steep / _CLOUD_STEP_RAD)
    beside = np.abs(slope) < _STEEP_SLOPE
    row = ((bearing[beside] + math.pi) / _CLOUD_STEP_RAD).astype(np.intp) % bearings
    layer = ((np.arctan(slope[beside]) + steep) / _CLOUD_STEP_RAD).astype(np.intp)
    free = np.full((bearings, layers), np.inf)
    np.minimum.at(free, (row, np.minimum(layer, layers - 1)), away[beside])
    free[np.isinf(free)] = 0.0
    middles = (np.arange(layers) + 0.5) * _CLOUD_STEP_RAD - steep
    return Fan(
        np.asarray((np.arange(bearings) + 0.5) * _CLOUD_STEP_RAD - math.pi),
        0.5 * _CLOUD_STEP_RAD,
        np.tile(np.tan(middles), (bearings, 1)),
        free,
    )


def _polar(directions: Array) -> tuple[Array, Array, Array]:
    """Return bearing, rise per metre in the plane, and length in the plane; each (N,)."""
    level = np.hypot(directions[:, 0], directions[:, 1])
    rise = directions[:, 2] / np.maximum(level, 1e-9)
    return np.arctan2(directions[:, 1], directions[:, 0]), rise, level


def _nearest_bearing(bearings: Array, bearing: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the nearest of ascending bearings to others, and how far aside it is."""
    around = np.concatenate([bearings[-1:] - math.tau, bearings, bearings[:1] + math.tau])
    after = np.minimum(np.maximum(around.searchsorted(bearing), 1), len(around) - 1)
    nearer = after - (bearing - around[after - 1] < around[after] - bearing)
    return (nearer - 1) % len(bearings), np.abs(around[nearer] - bearing)


def _goes_on(away: Array, bearing: Array, half_rad: float) -> tuple[Mask, Mask]:
    """Whether the rays before and after each touch it and have hit the same surface."""
    indices = np.arange(len(away))
    aside = np.abs(bearing[indices - 1] - bearing)
    aside = np.minimum(aside, math.tau - aside)
    touches = (aside > 0.0) & (aside <= 2.5 * half_rad)
    farther = np.abs(away[indices - 1] - away)
    is_narrow = away * 2.0 * half_rad <= _SECTOR_MAX_M
    near = np.maximum(_SAME_SURFACE * away, _SAME_SURFACE_M)
    after = indices - (len(away) - 1)
    return (
        np.asarray(touches & is_narrow & (farther <= near)),
        np.asarray(touches[after] & is_narrow & (farther[after] <= near)),
    )
