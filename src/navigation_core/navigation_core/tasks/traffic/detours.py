"""Detours around other vehicles: above, below, beside, or aside until they have passed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from navigation_core.limits import Limits
from navigation_core.tasks.traffic.crowds import TrafficAhead
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Array, Volume, densified

__all__ = ["Detour", "DetourSearch"]

# Multiples of the separation by which detours are tried, shares of the line that they leave it
# for, and bearings where there is no line.
_MULTIPLES = (1, 2, 3)
_SHARES = ((0.0, 1.0), (0.0, 0.5), (0.5, 1.0), (0.25, 0.75))
_ALL_ROUND = tuple(math.tau * part / 8 for part in range(8))
# Cost of each corner of a detour, added to its time of flight.
_CORNER_S = 0.6
# A little more than just enough.
_SPARE_M = 0.3
# A delay counts more than the same time on the way: others may be late.
_DELAY_WEIGHT = 1.2
# A detour is judged first with points this many times farther apart than those of a reservation.
_JUDGED_GAP_FACTOR = 2.0
# By how much wider than the detours the region is whose traffic is compared with them: a metre of a
# map is not exactly one of the traffic frame.
_REGION_SHARE = 1.1
# How far aside a vehicle goes that is in the way of all others.
_ASIDE_RINGS = 6


@dataclass(frozen=True)
class Detour:
    """A path around others.

    Attributes:
        points_enu_m: what is passed before the target, in the map frame; the last is a stop if it
            leads aside.
        cost_s: when it is over, by an estimate.
        leads_aside: whether it does not lead to the target.
    """

    points_enu_m: tuple[tuple[float, float, float], ...]
    cost_s: float
    leads_aside: bool = False


class DetourSearch:
    """Looks for the soonest way from a place by way of points, as it is at one moment."""

    def __init__(
        self,
        view: TrafficView,
        limits: Limits,
        is_free: Callable[[Array], bool],
        now: float,
    ) -> None:
        """Prepare; the reservations of the view must not change meanwhile.

        Args:
            view: the traffic.
            limits: of the flight.
            is_free: whether a line of points (N, 3) of the map is clear of everything else.
            now: time in seconds.
        """
        self._view = view
        self._limits = limits
        self._is_free = is_free
        self._now = now
        self._reservations: TrafficReservations = view.reservations
        separation = self._reservations.separation
        self._beside_m = separation.horizontal_m + 2.0 * view.radius_m + _SPARE_M
        self._above_m = separation.vertical_m + 2.0 * view.rise_m + _SPARE_M

    def find(self, start_enu_m: Array, points_enu_m: Array, stands: bool = False) -> Detour | None:
        """Return the soonest way, which may be the straight one; None if there is none.

        Args:
            start_enu_m: where it begins, shape (3,).
            points_enu_m: what is to be passed, shape (N, 3); the last is the target.
            stands: whether it begins at rest, so that it may lead off sharply.
        """
        legs = np.concatenate([start_enu_m[None], points_enu_m])
        ahead = self._reservations.ahead(self._view.name, self._region(legs), self._now)
        best = self._judged(ahead, legs, (), 1.0)
        shapes = [
            (np.vstack([legs[:1], vias, legs[1:]]), vias)
            for vias in self._shapes(legs[0], legs[1], stands)
        ]
        for way, vias in sorted(shapes, key=lambda shape: self._time_s(shape[0])):
            if best is not None and self._time_s(way) >= best.cost_s:
                break
            found = self._judged(ahead, way, vias, _JUDGED_GAP_FACTOR)
            if found is not None and (best is None or found.cost_s < best.cost_s):
                best = self._judged(ahead, way, vias, 1.0) or best
        return best

    def aside(self, start_enu_m: Array, ground_enu_m: float | None = None) -> Detour | None:
        """Return the nearest position where the vehicle blocks no other.

        Args:
            start_enu_m: where it is, shape (3,).
            ground_enu_m: height of the ground where it has to be able to land there, too; it then
                stays at its height.
        """
        rings = [
            start_enu_m + offset
            for ring in range(1, _ASIDE_RINGS + 1)
            for offset in self._offsets(ring, _ALL_ROUND)
            if ground_enu_m is None or not offset[2]
        ]
        places = sorted(rings, key=lambda place: float(np.linalg.norm(place - start_enu_m)))
        for place in places:
            line, _ = densified(np.array([start_enu_m, place]), np.array([0.0, 1.0]))
            if not self._view.admits(np.array([start_enu_m, place]), ends_where_asked=False):
                continue
            if not self._is_free(np.array([start_enu_m, place])):
                continue
            volume = self._view.volume(line)
            if ground_enu_m is not None and not self.may_land(place, ground_enu_m):
                continue
            if self._reservations.free(self._view.name, volume)[-1] and (
                self._reservations.blocked_by(self._view.name, volume) is None
            ):
                time_s = self._time_s(np.array([start_enu_m, place]))
                return Detour((_vector(place),), time_s, leads_aside=True)
        return None

    def may_land(self, place_enu_m: Array, ground_enu_m: float) -> bool:
        """Whether no other vehicle holds or announces a part of the column below a position."""
        ends = np.array([place_enu_m, place_enu_m])
        ends[1, 2] = min(ground_enu_m, place_enu_m[2])
        column, _ = densified(ends, np.zeros(2))
        # The width that a landing reserves.
        volume = Volume.along(
            self._view.traffic_frame.traffic(column),
            self._view.radius_m + 0.5,
            self._view.rise_m + 1.0,
        )
        return bool(self._reservations.free(self._view.name, volume).all())

    def _shapes(self, start: Array, target: Array, stands: bool) -> Iterator[Array]:
        """Return the points of detours from a place to the next point, shape (2, 3) or (1, 3)."""
        span = target - start
        length_m = float(np.hypot(span[0], span[1]))
        along = span / max(float(np.linalg.norm(span)), 1e-9)
        sideways = (math.atan2(span[1], span[0]) + s for s in (0.5 * math.pi, -0.5 * math.pi))
        bearings = _ALL_ROUND if length_m < 1.0 else tuple(sideways)
        for multiple in _MULTIPLES:
            for offset in self._offsets(multiple, bearings):
                if length_m < 1.0:
                    yield (start + offset)[None]
                    continue
                aside_m = float(np.linalg.norm(offset))
                for first, last in _SHARES:
                    lead_m = min(aside_m, 0.4 * (last - first) * length_m)
                    end = start + span * last - along * lead_m + offset
                    for lead in (lead_m, 0.0) if stands and not first else (lead_m,):
                        yield np.array([start + span * first + along * lead + offset, end])

    def _offsets(self, multiple: int, bearings: Sequence[float]) -> list[Array]:
        offsets = []
        if self._view.heights_m is not None:
            offsets = [np.array([0.0, 0.0, s * multiple * self._above_m]) for s in (1.0, -1.0)]
        aside_m = multiple * self._beside_m
        for angle in bearings:
            offsets.append(np.array([aside_m * math.cos(angle), aside_m * math.sin(angle), 0.0]))
        return offsets

    def _region(self, legs: Array) -> Volume:
        """Return a volume about all detours of some legs."""
        line, _ = densified(legs, np.zeros(len(legs)))
        aside_m = _REGION_SHARE * max(_MULTIPLES) * self._beside_m
        above_m = _REGION_SHARE * max(_MULTIPLES) * self._above_m
        placed = self._view.traffic_frame.traffic(line)
        return Volume.along(placed, self._view.radius_m + aside_m, self._view.rise_m + above_m)

    def _judged(
        self, ahead: TrafficAhead, legs: Array, vias: Array | Sequence[Array], gaps: float
    ) -> Detour | None:
        times = np.concatenate([[0.0], np.cumsum(self._leg_times_s(legs))])
        if not (self._view.admits(legs) and self._is_free(legs)):
            return None
        line, after_s = densified(legs, times, gaps)
        volume: Volume = self._view.volume(line)
        delay_s = ahead.delay_s(volume, after_s)
        if not math.isfinite(delay_s):
            return None
        cost_s = self._time_s(legs) + _DELAY_WEIGHT * delay_s
        return Detour(tuple(_vector(via) for via in vias), cost_s)

    def _time_s(self, legs: Array) -> float:
        return float(self._leg_times_s(legs).sum()) + _CORNER_S * (len(legs) - 2)

    def _leg_times_s(self, legs: Array) -> Array:
        steps = np.diff(legs, axis=0)
        level_s = np.hypot(steps[:, 0], steps[:, 1]) / self._limits.speed_horizontal_m_s
        climb_s = np.maximum(steps[:, 2], 0.0) / self._limits.speed_up_m_s
        sink_s = np.maximum(-steps[:, 2], 0.0) / self._limits.speed_down_m_s
        return np.asarray(np.maximum(level_s, climb_s + sink_s))


def _vector(point: Array) -> tuple[float, float, float]:
    return (float(point[0]), float(point[1]), float(point[2]))
