"""Detects moving obstacles by hits in space seen free before, and predicts their motion.

A stationary obstacle is never hit where a ray went through a moment ago, however the vehicle moves:
it comes into view, or was hidden, but nobody has seen its place free. So the hits of a scan are
held against the rays of some scans before. Those whose places were free follow one another
where something moves; a line through them in space and time is its velocity.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import Vector3
from navigation_core.mapping.sensor_rays import Fan

__all__ = ["Movers", "Moving"]

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]

# All scans are made as coarse as a usual OBSTACLE_DISTANCE. A single beam cannot show motion: no
# other ray looks at where the obstacle comes from.
_SECTORS, _RAYS_MIN = 72, 16
_HALF_RAD = math.pi / _SECTORS
# How long ago a place must have been seen free, and how long scans are kept for that. Something
# at 1 m/s leaves its own place within 2 s.
_RECENT_S, _KEPT_S, _KEPT_EACH_S = 0.4, 2.0, 0.2
# How far beyond a place a ray must have gone: what the pose and the sector may be wrong by.
_BEYOND_M, _BEYOND_PER_M = 0.4, 1.2 * _HALF_RAD
# From much nearer a sector was much narrower than what is asked for now.
_NEARER_MAX = 1.6
# More than three turns, and what sums of angles lose.
_APART_RAD, _ROUNDING_RAD = 100.0, 1e-9
# Rays this far above are not evidence: they may have gone over a wall. Below they are, as what is
# hit stands on the ground: a vehicle that is fast has its nose down, and raises it to brake.
_ABOVE_MAX_M, _BELOW_MAX_M = 1.0, 3.0
# Hits belong to one obstacle if they follow one another within this distance, with time counted as
# a distance at this speed; how long hits are kept, and how many at most.
_LINK_M, _LINK_M_S, _TRACK_S, _HITS_MAX = 1.5, 3.0, 1.2, 400
# Hits within _REST_M of one in a place that was free are of the same obstacle, unless something was
# hit within _STOOD_M of there up to _STOOD_S ago.
_REST_M, _STOOD_M, _STOOD_S = 0.8, 0.5, 1.2
# When a line through them is believed.
_SCANS_MIN, _SPAN_MIN_S, _ERROR_MAX_M_S = 5, 0.4, 0.35
_SPEED_MIN_M_S, _SPEED_MAX_M_S = 0.3, 4.0
# An obstacle that has just come into view may go anywhere at this speed. It is believed to be there
# after this many scans, and its motion after this time, as its sectors jump at first.
_UNKNOWN_M_S, _SUSPECT_SCANS_MIN, _SURE_SPAN_S = 1.5, 3, 1.0
# The motion of an obstacle that was not hit for this long is not predicted any more.
_FRESH_S = 0.3
# A corner hides something where the ray beside it goes on at least this far, behind a surface at
# least this wide, whose hits are this near each other.
_HIDDEN_M, _SURFACE_M, _BESIDE_M = 2.0, 1.0, 1.0


@dataclass(frozen=True, eq=False)
class Moving:
    """Something that moves.

    Attributes:
        points_enu_m: where it was hit last, shape (N, 3).
        hit_s: when.
        velocity_enu_m_s: east and north.
        uncertain_m_s: by how much that may be wrong, in any direction.
    """

    points_enu_m: Array
    hit_s: float
    velocity_enu_m_s: tuple[float, float]
    uncertain_m_s: float = 0.0


@dataclass(frozen=True, eq=False)
class _Ring:
    """A scan, made coarse: the nearest in each sector, by ascending bearing."""

    time_s: float
    origin: Array
    bearings_rad: Array
    slopes: Array
    free_m: Array
    has_hit: Mask

    @cached_property
    def hits(self) -> Array:
        """Where something was hit, shape (N, 3)."""
        away, bearing = self.free_m[self.has_hit], self.bearings_rad[self.has_hit]
        rises = away * self.slopes[self.has_hit]
        offsets = [away * np.cos(bearing), away * np.sin(bearing), rises]
        return np.asarray(np.stack(offsets, axis=1) + self.origin)

    @cached_property
    def around(self) -> Array:
        """Bearing, slope and free distance of each ray, shape (3, 3 N).

        They go round three times, so that rays beside each other are so everywhere.
        """
        rays = np.stack([self.bearings_rad, self.slopes, self.free_m])
        turn = np.array([[math.tau], [0.0], [0.0]])
        return np.concatenate([rays - turn, rays, rays + turn], axis=1)


def _seen_free(rings: Sequence[_Ring], hits: Array, origin: Array) -> Mask:
    """Whether rays of any ring went through places (N, 3) that were hit later, from an origin."""
    was_free = np.zeros(len(hits), dtype=np.bool_)
    if not rings or not len(hits):
        return was_free
    offsets = hits - np.stack([ring.origin for ring in rings])[:, None]
    away = np.hypot(offsets[..., 0], offsets[..., 1])
    later = np.hypot(hits[:, 0] - origin[0], hits[:, 1] - origin[1])
    # The hit may be anywhere in its sector, and so may what the ring has hit.
    wider = later / np.maximum(away, 0.1)
    ring, hit = np.nonzero(wider < _NEARER_MAX)
    if not len(hit):
        return was_free
    away, later, wider = away[ring, hit], later[hit], wider[ring, hit]
    east, north, above = offsets[ring, hit].T
    bearing = np.arctan2(north, east)
    near = _HALF_RAD * (1.1 + wider)
    # All rays in one ascending row: those of each ring are a long way from those of the others.
    bearings, slopes, free_m = np.concatenate([one.around for one in rings], axis=1)
    apart = _APART_RAD * np.arange(len(rings))
    row = bearings + np.repeat(apart, [len(one.around[0]) for one in rings])
    reach = np.maximum(near, 1.5 * _HALF_RAD) + _ROUNDING_RAD
    middle = apart[ring] + bearing
    first, last = row.searchsorted(middle - reach), row.searchsorted(middle + reach)
    rays = first[:, None] + np.arange((last - first).max())
    is_ray = rays < last[:, None]
    rays[~is_ray] = 0
    aside = np.abs(bearings[rays] - bearing[:, None])
    beside = is_ray & (aside <= near[:, None])
    beyond = away + _BEYOND_M + _BEYOND_PER_M * np.maximum(later, away)
    height = away[:, None] * slopes[rays] - above[:, None]
    level = (height < _ABOVE_MAX_M) & (height > -_BELOW_MAX_M)
    free = (free_m[rays] > beyond[:, None]) & level
    seen = (is_ray & (aside <= 1.5 * _HALF_RAD)).any(axis=1)
    was_free[hit[seen & (free | ~beside).all(axis=1)]] = True
    return was_free


def _corners(ring: _Ring) -> tuple[tuple[float, float], ...]:
    """Return the ends of surfaces behind which nothing is seen, east and north."""
    places = np.stack([np.cos(ring.bearings_rad), np.sin(ring.bearings_rad)], axis=1)
    places = ring.origin[:2] + ring.free_m[:, None] * places
    found = []
    for side in (1, -1):
        # The ray beside each on this side goes on, and is beside it.
        further_m = np.roll(ring.free_m, -side) - ring.free_m
        turn = np.abs(np.roll(ring.bearings_rad, -side) - ring.bearings_rad)
        beside = np.minimum(turn, math.tau - turn) <= 3.0 * _HALF_RAD
        for end in np.flatnonzero(ring.has_hit & beside & (further_m > _HIDDEN_M)):
            ray, width_m = end, 0.0
            while width_m < _SURFACE_M:
                last, ray = ray, (ray - side) % len(places)
                step_m = float(np.hypot(*(places[ray] - places[last])))
                if not ring.has_hit[ray] or step_m > _BESIDE_M:
                    break
                width_m += step_m
            else:
                found.append((float(places[end][0]), float(places[end][1])))
    return tuple(found)


class Movers:
    """Finds what moves in the scans of one vehicle; see the module.

    Attributes:
        moving: what moves.
        corners_enu_m: ends of surfaces behind which something may be, east and north.
    """

    def __init__(self) -> None:
        """Start knowing nothing."""
        self._rings: deque[_Ring] = deque()
        self._hits = np.empty((0, 6))
        self.moving: tuple[Moving, ...] = ()
        self.corners_enu_m: tuple[tuple[float, float], ...] = ()

    def clear(self) -> None:
        """Forget everything."""
        self._rings.clear()
        self._hits = np.empty((0, 6))
        self.moving = ()
        self.corners_enu_m = ()

    def take(self, fan: Fan, has_hit: Mask, origin_enu_m: Vector3, now: float) -> None:
        """Process a scan.

        Args:
            fan: its rays.
            has_hit: which of them end at something that stands, shape (B, K).
            origin_enu_m: where the sensor is in the map frame.
            now: time of the scan in seconds.
        """
        if len(fan.bearings_rad) < _RAYS_MIN:
            return
        ring = _coarse(fan, has_hit, np.array(origin_enu_m), now)
        if self._rings and now < self._rings[-1].time_s:
            self.clear()
        while self._rings and now - self._rings[0].time_s > _KEPT_S:
            self._rings.popleft()
        self._track(self._moved(ring), ring.origin, now)
        self.corners_enu_m = _corners(ring)
        if not self._rings or now - self._rings[-1].time_s >= _KEPT_EACH_S:
            self._rings.append(ring)

    def _moved(self, ring: _Ring) -> Array:
        """Return the hits of a ring that are on something that moves, shape (N, 3)."""
        hits, now = ring.hits, ring.time_s
        was_free = _seen_free(
            [old for old in self._rings if now - old.time_s >= _RECENT_S], hits, ring.origin
        )
        if not was_free.any():
            return hits[was_free]
        # The rest of it, so that it does not seem to grow.
        rest = _near(hits, hits[was_free], _REST_M) & ~was_free
        for old in self._rings:
            if now - old.time_s >= _STOOD_S and rest.any():
                rest[rest] = ~_near(hits[rest], old.hits, _STOOD_M)
        return hits[was_free | rest]

    def _track(self, hits: Array, origin: Array, now: float) -> None:
        self.moving = ()
        kept = self._hits[self._hits[:, 3] >= now - _TRACK_S]
        if not len(hits) and not len(kept):
            self._hits = kept
            return
        rays = (hits - origin)[:, :2]
        rays /= np.maximum(np.hypot(rays[:, 0], rays[:, 1]), 1e-9)[:, None]
        new = np.column_stack([hits, np.full(len(hits), now), rays])
        self._hits = np.concatenate([kept, new])[-_HITS_MAX:]
        if now - self._hits[-1, 3] > _FRESH_S:
            return
        found = (_fitted(hits, now) for hits in _things(self._hits))
        self.moving = tuple(one for one in found if one is not None)


def _coarse(fan: Fan, has_hit: Mask, origin: Array, now: float) -> _Ring:
    # Of rays above each other the one that hit nearest, or else the longest: in clouds others
    # end on the ground.
    rows = np.arange(len(fan.bearings_rad))
    nearest = np.where(has_hit, fan.free_m, np.inf).argmin(axis=1)
    layer = np.where(has_hit.any(axis=1), nearest, fan.free_m.argmax(axis=1))
    free = fan.free_m[rows, layer]
    known = np.flatnonzero(free > 0.0)
    if len(known) > _SECTORS:
        # By sector, the nearest first, of which the first is taken.
        sector = np.floor(fan.bearings_rad[known] / (2.0 * _HALF_RAD))
        order = np.lexsort([free[known], sector])
        known = known[order[np.unique(sector[order], return_index=True)[1]]]
    layer = layer[known]
    slopes, hit = fan.slopes[known, layer], has_hit[known, layer]
    return _Ring(now, origin, fan.bearings_rad[known], slopes, free[known], hit)


def _near(places: Array, others: Array, within_m: float) -> Mask:
    """Whether there is one of some others near places; shapes (N, 3), (M, 3)."""
    apart = places[:, None, :2] - others[:, :2]
    return np.asarray(((apart * apart).sum(axis=2) < within_m * within_m).any(axis=1))


def _things(hits: Array) -> list[Array]:
    """Return hits (N, 6: place, time and ray), parted into those that belong together."""
    places = np.column_stack([hits[:, :2], _LINK_M_S * hits[:, 3]])
    left, things = np.arange(len(hits)), []
    while len(left):
        new, left = left[:1], left[1:]
        thing = [new]
        # Not by SciPy, for which the thread that flies would wait while it is still loading.
        while len(new) and len(left):
            apart = places[new][:, None] - places[left]
            linked = (np.einsum("ijk,ijk->ij", apart, apart) <= _LINK_M * _LINK_M).any(axis=0)
            new, left = left[linked], left[~linked]
            thing.append(new)
        things.append(hits[np.sort(np.concatenate(thing))])
    return things


def _fitted(hits: Array, now: float) -> Moving | None:
    """Return the motion of hits (N, 6), None if they are too few, or on something that stands."""
    times, scan = np.unique(hits[:, 3], return_inverse=True)
    if len(times) < _SUSPECT_SCANS_MIN or now - times[-1] > _FRESH_S:
        return None
    last, span_s = hits[hits[:, 3] == times[-1]], float(np.ptp(times))
    unknown = Moving(last[:, :3], float(times[-1]), (0.0, 0.0), _UNKNOWN_M_S)
    if len(times) < _SCANS_MIN or span_s < _SPAN_MIN_S:
        return unknown
    counts = np.bincount(scan)
    middles = np.stack([np.bincount(scan, hits[:, k]) / counts for k in (0, 1)], axis=1)
    # The side that is seen turns as it goes by, so the middle of what is round is followed.
    rays = np.stack([np.bincount(scan, hits[:, k]) / counts for k in (4, 5)], axis=1)
    aside = hits[:, 1] * rays[scan, 0] - hits[:, 0] * rays[scan, 1]
    least, most = np.full(len(times), np.inf), np.full(len(times), -np.inf)
    np.minimum.at(least, scan, aside)
    np.maximum.at(most, scan, aside)
    middles += 0.25 * math.pi * 0.5 * (most - least)[:, None] * rays
    since = times - times.mean()
    spread = float(since @ since)
    velocity = since @ middles / spread
    rest = middles - middles.mean(axis=0) - since[:, None] * velocity
    error = math.sqrt(float((rest * rest).sum()) / max(len(times) - 2, 1) / spread)
    speed = math.hypot(*velocity)
    if error > _ERROR_MAX_M_S:
        return unknown if span_s < _SURE_SPAN_S else None
    if not _SPEED_MIN_M_S <= speed <= _SPEED_MAX_M_S:
        return None
    uncertain_m_s = _UNKNOWN_M_S if span_s < _SURE_SPAN_S else 0.0
    return Moving(
        last[:, :3],
        float(times[-1]),
        (float(velocity[0]), float(velocity[1])),
        uncertain_m_s,
    )
