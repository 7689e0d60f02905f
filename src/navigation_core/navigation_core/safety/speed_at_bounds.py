"""The speed that the room left to the bounds of the flight allows.

A velocity towards a bound is reduced to the speed from which the vehicle stops before it; any other
is left alone. So a vehicle that is outside, by wind or because the fence has changed, may only come
back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import Vector3
from navigation_core.limits import stopping_distance_m, stopping_speed_m_s
from navigation_core.safety.fences import Area, CircleArea, Fence, Point2
from navigation_core.safety.target_checks import FlightVolume

__all__ = ["Bounds", "Braking", "SpeedAtBounds", "room_in_volume_m"]

# Room that is kept to the flight volume; over ground with what the estimate of a position is wrong
# by (0.16 m by ground truth) and the last of a brake on top.
_VOLUME_MARGIN_M = 0.5
_LEVEL_MARGIN_M = _VOLUME_MARGIN_M + 0.25
# The path ahead is followed in steps as long as the room at each point, since no bound is nearer.
# It ends this near to a bound, or after this many steps, as beside a long fence.
_END_M = 0.05
_STEPS_MAX = 40
# Beyond a bound, a direction leads in if the room grows by this share of the distance ahead. Along
# the bound the vehicle only creeps.
_AHEAD_M, _INWARDS_SHARE, _CREEP_M = 0.2, 0.3, 0.5
_ROUNDING_M = 1e-9
# A search for a point with room goes on by this at least.
_STEP_MIN_M = 1.0


@dataclass(frozen=True)
class Braking:
    """How a vehicle comes to rest.

    Attributes:
        horizontal_m_s2: its horizontal deceleration.
        vertical_m_s2: its vertical deceleration.
        reaction_s: time for which it continues before that.
        turn_m: radius of a turn that it may make instead, under power and at any speed; 0 for none.
        turn_after_s: time for which it continues before the turn, > 0 where there is one.
    """

    horizontal_m_s2: float
    vertical_m_s2: float
    reaction_s: float
    turn_m: float = 0.0
    turn_after_s: float = 0.0


@dataclass(frozen=True)
class Bounds:
    """The limits of a flight, which hold even when its server ends.

    Attributes:
        volume: the server's flight volume.
        fence_margin_m: distance that is kept to the vehicle's own fence, on the inside.
    """

    volume: FlightVolume
    fence_margin_m: float


@dataclass(frozen=True)
class SpeedAtBounds:
    """The bounds of a flight.

    Attributes:
        volume: the server's flight volume.
        fence: the vehicle's own fence, or None while it is not known.
        home_z_enu_m: map z of home, from which the fence's heights count.
        fence_margin_m: distance that is kept to the fence, on the inside.
        flies: whether the bounds of the height count.
        volume_margin_m: distance over ground that is kept to the flight volume, on the inside.
    """

    volume: FlightVolume
    fence: Fence | None
    home_z_enu_m: float
    fence_margin_m: float
    flies: bool = True
    volume_margin_m: float = _LEVEL_MARGIN_M

    def reduced(
        self,
        velocity_enu_m_s: Vector3,
        position_enu_m: Vector3,
        ground_enu_m: float,
        braking: Braking,
    ) -> Vector3:
        """Return the velocity, slower where it would lead out.

        The direction over ground is kept: a vehicle does not slide along a bound that nobody
        commanded it to follow.

        Args:
            velocity_enu_m_s: what is asked for.
            position_enu_m: where the vehicle is, in the map frame.
            ground_enu_m: map z of the ground, from which the volume's heights count.
            braking: how the vehicle comes to rest.
        """
        east, north, up = velocity_enu_m_s
        level_m_s, share = math.hypot(east, north), 1.0
        reaction_s = braking.reaction_s
        if level_m_s > 0.0:
            place = (position_enu_m[0], position_enu_m[1])
            course = (east / level_m_s, north / level_m_s)
            needed_m = stopping_distance_m(level_m_s, reaction_s, braking.horizontal_m_s2)
            room_m = self.room_m(place)
            if room_m < needed_m or room_m <= _END_M:  # else every bound is farther than it stops
                free_m = self._free_m(place, course, needed_m, room_m)
                allowed_m_s = stopping_speed_m_s(free_m, reaction_s, braking.horizontal_m_s2)
                share = min(allowed_m_s / level_m_s, 1.0) if free_m < needed_m else 1.0
            if braking.turn_m > 0.0:
                share = min(share, self._turn_share(place, course, level_m_s, braking))
        if self.flies and up:
            low_m, high_m = self.heights_m(ground_enu_m)
            below_m, above_m = position_enu_m[2] - low_m, high_m - position_enu_m[2]
            up = min(up, stopping_speed_m_s(above_m, reaction_s, braking.vertical_m_s2))
            up = max(up, -stopping_speed_m_s(below_m, reaction_s, braking.vertical_m_s2))
        return (share * east, share * north, up)

    def _turn_share(
        self, place: Point2, course: Point2, level_m_s: float, braking: Braking
    ) -> float:
        """Return the share of a speed that leaves room for the turn; its radius is the margin."""
        bare = replace(self, fence_margin_m=0.0, volume_margin_m=0.0)
        before_m = level_m_s * braking.turn_after_s
        needed_m = before_m + braking.turn_m
        free_m = bare._free_m(place, course, needed_m, bare.room_m(place)) - braking.turn_m
        return 1.0 if free_m >= before_m else max(free_m, 0.0) / before_m

    def run_out_share(
        self,
        position_enu_m: Vector3,
        velocity_enu_m_s: Vector3,
        ground_enu_m: float,
        braking: Braking,
    ) -> float:
        """Return the share of a velocity whose run-out ends within the bounds, at most 1.

        Over ground and upwards: a descent ends on the ground, which is no bound of a volume.

        Args as for :meth:`reduced`; ``braking.reaction_s`` is how long the vehicle continues.
        """
        level_m_s = math.hypot(velocity_enu_m_s[0], velocity_enu_m_s[1])
        kept = self.reduced(velocity_enu_m_s, position_enu_m, ground_enu_m, braking)
        share = math.hypot(kept[0], kept[1]) / level_m_s if level_m_s > 0.0 else 1.0
        if velocity_enu_m_s[2] > 0.0:
            share = min(share, max(kept[2], 0.0) / velocity_enu_m_s[2])
        return min(share, 1.0)

    def heights_m(self, ground_enu_m: float) -> tuple[float, float]:
        """Return the least and the greatest height, in the map frame.

        Args:
            ground_enu_m: map z of the ground, from which the volume's heights count.
        """
        low_m = ground_enu_m + self.volume.altitude_min_m + _VOLUME_MARGIN_M
        high_m = ground_enu_m + self.volume.altitude_max_m - _VOLUME_MARGIN_M
        if self.volume.box is not None:
            low_m = max(low_m, self.volume.box.minimum_enu_m[2] + _VOLUME_MARGIN_M)
            high_m = min(high_m, self.volume.box.maximum_enu_m[2] - _VOLUME_MARGIN_M)
        fence = self.fence
        if fence is not None and fence.altitude_min_m is not None:
            low_m = max(low_m, self.home_z_enu_m + fence.altitude_min_m + self.fence_margin_m)
        if fence is not None and fence.altitude_max_m is not None:
            high_m = min(high_m, self.home_z_enu_m + fence.altitude_max_m - self.fence_margin_m)
        return low_m, high_m

    def farthest_m(
        self, start: Point2, course: Point2, length_m: float, inset_m: float
    ) -> float | None:
        """Return how far ahead the farthest point lies that has room about it, None without one.

        No bound lies between: from beyond one, only a straight line that leads in has such a point.

        Args:
            start: east and north, metres.
            course: the direction, of length 1.
            length_m: it lies no farther than this.
            inset_m: the room about it, beside the margins.
        """
        along_m, found_m, before_m = 0.0, None, -math.inf
        while True:
            room_m = self.room_m((start[0] + along_m * course[0], start[1] + along_m * course[1]))
            if room_m >= inset_m:
                found_m = along_m
            elif room_m < 0.0 and (found_m is not None or room_m <= before_m):
                return found_m
            if along_m >= length_m:
                return found_m
            before_m = room_m
            # No bound is nearer than the room, no point with enough of it than what is missing.
            step_m = room_m - inset_m if room_m >= inset_m else min(room_m, inset_m - room_m)
            along_m = min(along_m + max(step_m, _STEP_MIN_M), length_m)

    def _free_m(self, start: Point2, course: Point2, needed_m: float, room_m: float) -> float:
        """Return the length of a straight path up to a bound, at most what is needed.

        Args:
            start: where it begins.
            course: its direction, of length 1.
            needed_m: how long it has to be.
            room_m: how far every bound is from its beginning.
        """
        if room_m <= _END_M:
            ahead = self.room_m((start[0] + _AHEAD_M * course[0], start[1] + _AHEAD_M * course[1]))
            if ahead - room_m >= _INWARDS_SHARE * _AHEAD_M:
                return needed_m
            return _CREEP_M if ahead >= room_m - _ROUNDING_M else 0.0
        path_m = 0.0
        for _ in range(_STEPS_MAX):
            path_m += room_m
            if path_m >= needed_m:
                return needed_m
            room_m = self.room_m((start[0] + path_m * course[0], start[1] + path_m * course[1]))
            if room_m <= _END_M:
                break
        return path_m

    def room_m(self, point: Point2) -> float:
        """Return how far every bound is from a point, its margin taken off; negative beyond it."""
        rooms_m = [room_in_volume_m(self.volume, point) - self.volume_margin_m]
        if self.fence is not None:
            rooms_m += [_depth_m(area, point) - self.fence_margin_m for area in self.fence.areas]
            if self.fence.alternatives:
                # To be inside of one of them is enough.
                deepest_m = max(_depth_m(area, point) for area in self.fence.alternatives)
                rooms_m.append(deepest_m - self.fence_margin_m)
        return min(rooms_m)


def room_in_volume_m(volume: FlightVolume, point: Point2) -> float:
    """Return how far inside a volume a point of the map is over ground; negative outside."""
    x, y = point
    room_m = volume.radius_max_m - math.hypot(x, y)
    if volume.box is None:
        return room_m
    (west, south, _), (east, north, _) = volume.box.minimum_enu_m, volume.box.maximum_enu_m
    return min(room_m, east - x, x - west, north - y, y - south)


def _depth_m(area: Area, point: Point2) -> float:
    """Return how far a point is on the allowed side of an area's boundary; negative beyond."""
    if isinstance(area, CircleArea):
        depth_m = area.radius_m - math.dist(point, area.centre_enu_m)
        return depth_m if area.inclusion else -depth_m
    kept = area.contains(point) is area.inclusion
    return area.margin_m(point) if kept else -area.margin_m(point)
