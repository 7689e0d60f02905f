"""PX4's rover guidance: pure pursuit along a line, slower before corners and the end.

After `AckermannPosControl` and the pure pursuit library of v1.17, as documented there: the nose
turns towards a point on the line a look-ahead away, the speed allows to stop in time with a
limited deceleration and jerk, and is less while the nose points elsewhere.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.rover.rover import Px4Rover

Point = tuple[float, float]

_MOST = 1e4


def bearing_rad(here: Point, start: Point, end: Point, look_ahead_m: float) -> float:
    """The bearing to steer, clockwise from north.

    Args:
        here: North and East of the vehicle, metres.
        start: where the line begins.
        end: where it ends.
        look_ahead_m: how far ahead on the line to aim.
    """
    length = math.dist(start, end)
    if math.dist(here, end) < look_ahead_m or length < 1e-3:
        return math.atan2(end[1] - here[1], end[0] - here[0])
    n, e = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    along = (here[0] - start[0]) * n + (here[1] - start[1]) * e
    beside = (here[1] - start[1]) * n - (here[0] - start[0]) * e
    ahead = math.sqrt(max(look_ahead_m * look_ahead_m - beside * beside, 0.0))
    aim = min(max(along, 0.0) + ahead, length)  # beyond the end it comes back
    return math.atan2(start[1] + aim * e - here[1], start[0] + aim * n - here[0])


def speed_in_time(jerk: float, deceleration: float, distance_m: float, final_m_s: float) -> float:
    """The fastest speed that can still become `final_m_s` over a distance, m/s.

    Args:
        jerk: limit, m/s3, above 0.
        deceleration: limit, m/s2, above 0.
        distance_m: how far there is.
        final_m_s: speed at its end.
    """
    ramp = 4.0 * deceleration * deceleration / jerk
    squared = 2.0 * deceleration * max(distance_m, 0.0) + final_m_s * final_m_s
    return max(0.5 * (math.sqrt(ramp * ramp + 4.0 * squared) - ramp), final_m_s)


class PurePursuit:
    """The way to one place.

    Args:
        target: North and East, metres.
        start: where the line begins; None for a straight way from wherever the vehicle is.
        arrival_m_s: how fast it may be at the end; 0 to stop there.
        accept_m: how near is there; NAV_ACC_RAD when None.

    Attributes:
        target: as given; where it has come to rest, once it has.
    """

    def __init__(
        self,
        rover: Px4Rover,
        target: Point,
        start: Point | None = None,
        arrival_m_s: float = 0.0,
        accept_m: float | None = None,
    ) -> None:
        self._vehicle = rover
        self.target = target
        self._start = start
        self._arrival_m_s = arrival_m_s
        self.accept_m = rover.accept_m() if accept_m is None else accept_m
        self._rested = False

    @property
    def distance_m(self) -> float:
        """From the vehicle to the place."""
        motion = self._vehicle.motion
        return math.dist((motion.north_m, motion.east_m), self.target)

    def follow(self) -> DriveGuidance:
        """The guidance for the present moment."""
        left = self.distance_m
        if self._arrival_m_s > 0.0:
            left -= self.accept_m
        if left > self.accept_m or self._arrival_m_s > 0.0:
            return self._go(left)
        if not self._rested and self._vehicle.is_still():
            self._rested = True
            self.target = self._vehicle.motion[:2]
        return self._vehicle.drive_guidance(0.0, None, self.target)

    def _go(self, left_m: float) -> DriveGuidance:
        rover, p = self._vehicle, self._vehicle.parameters
        cruise = rover.navigator.cruise_m_s()
        if p["RO_DECEL_LIM"] > 0.0 and p["RO_JERK_LIM"] > 0.0:
            jerk = within(p["RO_JERK_LIM"], 1e-3, _MOST)
            deceleration = within(p["RO_DECEL_LIM"], 1e-3, _MOST)
            in_time = speed_in_time(jerk, deceleration, left_m, self._arrival_m_s)
            cruise = min(in_time, cruise)
        look = within(p["PP_LOOKAHD_GAIN"], 0.0, _MOST) * cruise
        look = min(max(look, p["PP_LOOKAHD_MIN"]), p["PP_LOOKAHD_MAX"])
        here = rover.motion[:2]
        bearing = bearing_rad(here, self._start or here, self.target, within(look, 0.1, _MOST))
        if p["RO_SPEED_RED"] > 0.0:
            off = abs(math.remainder(bearing - rover.motion.yaw_rad, math.tau)) / math.pi
            cruise = min(cruise, rover.reduced_m_s(off))
        return rover.drive_guidance(cruise, bearing, self.target)
