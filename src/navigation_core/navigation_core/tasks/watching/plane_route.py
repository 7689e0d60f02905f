"""Tracks the current waypoint of a plane, and when it counts as passed or circled."""

from __future__ import annotations

import itertools
import math

from navigation_core.geometry import (
    Vector3,
    distance,
    dot,
    horizontal_norm,
    norm,
    subtract,
    wrap_angle,
)
from navigation_core.tasks.progress import RouteProgress
from navigation_core.tasks.waypoint import Route, RouteWaypoint

# A plane turns into its circle before it is over the point, and sways about the circle.
_NEAR_CIRCLES = 1.25
# A fast plane's circle is up to this many times wider than its parameter says; it has approached a
# point when it flew towards it by this share of its speed, and circles it below the other.
_PASS_CIRCLES, _CLOSING_SHARE, _TURNING_SHARE = 2.0, 0.6, 0.3
# A plane that goes half round a point without coming nearer or leaving by this share circles it,
# at a radius from a parameter that is not known here.
_ROUND_RAD = math.pi
_ROUND_SHARE = 0.3

HEIGHT_ERROR_M = 8.0
"""How far off its target's height a plane gets: an ArduPlane has been recorded 6.9 m above that of
its take-off, 0.9 m above and 2.4 m below those of targets"""


def circle_max_m(circle_radius_m: float) -> float:
    """Return how far from its centre a plane gets on a circle, by its parameter's radius."""
    return _PASS_CIRCLES * circle_radius_m


class Circling:
    """Whether a plane circles about a point."""

    def __init__(self, circle_radius_m: float) -> None:
        """Begin without observations; the radius is the usual one of such planes."""
        self._radius_m = circle_radius_m
        self._from_m = math.nan
        self._bearing_rad = 0.0
        self._round_rad = 0.0

    def watch(self, position_enu_m: Vector3, centre_enu_m: Vector3) -> bool:
        """Record a position, and return whether it is on its circle, at its height."""
        offset = subtract(position_enu_m, centre_enu_m)
        away_m = horizontal_norm(offset)
        bearing_rad = math.atan2(offset[1], offset[0])
        if not abs(away_m - self._from_m) <= _ROUND_SHARE * self._from_m:
            self._from_m, self._round_rad = away_m, 0.0
        else:
            self._round_rad += wrap_angle(bearing_rad - self._bearing_rad)
        self._bearing_rad = bearing_rad
        near = away_m <= _NEAR_CIRCLES * self._radius_m
        return abs(offset[2]) <= HEIGHT_ERROR_M and (near or abs(self._round_rad) >= _ROUND_RAD)


class PlaneRoute:
    """The waypoints of a plane, of all laps, and how many of them are done."""

    def __init__(self, route: Route, circle_radius_m: float) -> None:
        """Stand before the first waypoint."""
        self._route = route
        self._radius_m = circle_radius_m
        self.done = 0
        self._approached = False

    @property
    def total(self) -> int:
        """Waypoints of all laps."""
        return self._route.total

    @property
    def over(self) -> bool:
        """Whether all of them are done."""
        return self.done >= self.total

    @property
    def current(self) -> RouteWaypoint:
        """The waypoint that it is on its way to; the last when all are done."""
        return self._route.at(self.done)

    @property
    def stops(self) -> bool:
        """Whether the current waypoint is circled, for a time or as the last."""
        return self.current.stay_s > 0.0 or self.done >= self.total - 1

    @property
    def number(self) -> str:
        """The current waypoint as people count them."""
        return self._route.numbers((self.done,))

    def is_within(self, position_enu_m: Vector3) -> bool:
        """Whether a position is in the acceptance radius of the current waypoint, over ground."""
        away_m = math.dist(position_enu_m[:2], self.current.position_enu_m[:2])
        return away_m <= self.current.acceptance_radius_m

    def passed(self, position_enu_m: Vector3, velocity_enu_m_s: Vector3) -> bool:
        """Whether the current waypoint, if it is flown through, is passed here.

        It is when the plane is near it, or has come up to it and begins to circle it.
        """
        if self.stops:
            return False
        offset = subtract(self.current.position_enu_m, position_enu_m)
        away_m, speed_m_s = norm(offset), norm(velocity_enu_m_s)
        if away_m <= max(self.current.acceptance_radius_m, _NEAR_CIRCLES * self._radius_m):
            return True
        closing_m_s = dot(offset, velocity_enu_m_s) / away_m
        self._approached = self._approached or closing_m_s > _CLOSING_SHARE * speed_m_s
        turns = self._approached and closing_m_s < _TURNING_SHARE * speed_m_s
        return turns and away_m <= self.pass_radius_m

    @property
    def pass_radius_m(self) -> float:
        """Within this it comes to a point that it flies through, at the least."""
        return circle_max_m(self._radius_m)

    def advance(self) -> None:
        """Advance to the next waypoint."""
        self.done += 1
        self._approached = False

    def left(self, position_enu_m: Vector3, speed_m_s: float) -> tuple[float, float]:
        """Return the length of the path that is left, and its time, from a position."""
        if self.over:
            return 0.0, 0.0
        rest = [self._route.at(i) for i in range(self.done, self.total)]
        places = [position_enu_m, *(waypoint.position_enu_m for waypoint in rest)]
        legs_m = [distance(a, b) for a, b in itertools.pairwise(places)]
        # It is on its circle before it is over the point.
        length_m = math.fsum(legs_m[1:]) + max(legs_m[0] - self._radius_m, 0.0)
        return length_m, length_m / speed_m_s + math.fsum(waypoint.stay_s for waypoint in rest)

    def progress(self) -> RouteProgress:
        """Progress along the route."""
        return self._route.progress(self.done, self.done)
