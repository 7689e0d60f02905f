"""The path travelled, simplified so that SMART_RTL can drive it back.

Points nearer to each other than an accuracy are one; a line is kept by its corners (Ramer, 1972,
Douglas and Peucker, 1973); a loop is left out where the way crosses itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Generic, TypeVar

from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

P = TypeVar("P", bound=tuple[float, ...])
"""A point: of two or of three coordinates"""
CRUMB_S = 1.0 / 3.0
"""How often the way is remembered"""


class Breadcrumbs(Generic[P]):
    """The path of a vehicle since it was armed, metres.

    Args:
        accuracy_m: SRTL_ACCURACY.
        capacity: SRTL_POINTS: most points that are kept.

    Attributes:
        points: the way, from its beginning.
        full: the way got too long: it cannot be driven back.
    """

    def __init__(self, accuracy_m: float, capacity: int) -> None:
        self.points: list[P] = []
        self.full = False
        self._accuracy_m = max(accuracy_m, 0.1)
        self._capacity = capacity

    def add(self, point: P) -> None:
        """The vehicle is there; points that are near the last one are not kept."""
        if self.full or (self.points and math.dist(point, self.points[-1]) < self._accuracy_m):
            return
        if len(self.points) >= self._capacity:
            self.points = self.shortest()
        if len(self.points) >= self._capacity:
            self.full = True
            return
        self.points.append(point)

    def shortest(self) -> list[P]:
        """The way without loops, by its corners."""
        return simplified(without_loops(self.points, self._accuracy_m), self._accuracy_m / 2.0)


class Trail:
    """The way of a vehicle since it was armed.

    Args:
        vehicle: whose.
        coordinates: how many count: north, east, and down of those that fly.

    Attributes:
        crumbs: its points, NED metres; None while disarmed.
    """

    def __init__(self, vehicle: Commander, coordinates: int) -> None:
        self._vehicle = vehicle
        self._coordinates = coordinates
        self.crumbs: Breadcrumbs[tuple[float, ...]] | None = None
        self._next_s = 0.0

    @property
    def known(self) -> bool:
        """Whether the way back can be travelled."""
        return self.crumbs is not None and bool(self.crumbs.points) and not self.crumbs.full

    def watch(self, keeps: bool) -> None:
        """Remember where it is, unless it is on its way back."""
        vehicle, p = self._vehicle, self._vehicle.parameters
        if not vehicle.armed:
            self.crumbs = None
            return
        if not vehicle.estimator.position_ok or not keeps:
            return
        if self.crumbs is None:
            self.crumbs = Breadcrumbs(p["SRTL_ACCURACY"], int(p["SRTL_POINTS"]))
            self._next_s = vehicle.now_s
        if vehicle.now_s < self._next_s:
            return
        self._next_s = vehicle.now_s + CRUMB_S
        was = self.crumbs.full
        self.crumbs.add(vehicle.motion[: self._coordinates])
        if self.crumbs.full and not was:
            vehicle.say(Severity.WARNING, "SmartRTL deactivated: buffer full")


def without_loops(points: list[P], near_m: float) -> list[P]:
    """A way that does not come back to where it has been: what lies between is left out."""
    kept: list[P] = []
    place = 0
    while place < len(points):
        here = points[place]
        kept.append(here)
        again = (i for i in range(len(points) - 1, place + 1, -1))
        place = next((i for i in again if math.dist(points[i], here) < near_m), place) + 1
    return kept


def simplified(points: list[P], off_m: float) -> list[P]:
    """The corners of a way: no point of it is further than `off_m` from the lines between."""
    if len(points) < 3:
        return points
    keep = {0, len(points) - 1}
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        inner = range(first + 1, last)
        if not inner:
            continue
        furthest = max(inner, key=lambda i: _off(points[i], points[first], points[last]))
        if _off(points[furthest], points[first], points[last]) > off_m:
            keep.add(furthest)
            spans += [(first, furthest), (furthest, last)]
    return [points[i] for i in sorted(keep)]


def _off(point: P, start: P, end: P) -> float:
    """How far a point is from a line between two others."""
    length = math.dist(start, end)
    if length < 1e-9:
        return math.dist(point, start)
    along = math.fsum((p - s) * (e - s) for p, s, e in zip(point, start, end, strict=True)) / length
    share = min(max(along / length, 0.0), 1.0)
    foot = tuple(s + share * (e - s) for s, e in zip(start, end, strict=True))
    return math.dist(point, foot)
