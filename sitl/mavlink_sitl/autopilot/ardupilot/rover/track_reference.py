"""The legs of a rover's or boat's AUTO: S-curves, rounded into each other at corners (AR_WPNav)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.rover.moving_reference import LegReference, Motion2, Point
from mavlink_sitl.autopilot.control.track import LegTrack, TrackLeg
from mavlink_sitl.exchange import Limits

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover


SNAP_S = 0.02
"""Time in which the jerk changes by 1 m/s3: AR_WPNAV_SNAP_MAX is 15 m/s4"""


class TrackReference(LegReference):
    """A leg of a mission. Arguments as of `LegReference`; its time begins with the first look."""

    def __init__(self, rover: Rover, destination: Point, speed_m_s: float) -> None:
        super().__init__(rover, destination, speed_m_s)
        self._leg = self._leg_between(self._start, destination)
        self._track: LegTrack | None = None
        self._following: TrackLeg | None = None

    def _leg_between(self, start: Point, end: Point) -> TrackLeg:
        limits, jerk_m_s3 = self._track_limits(), self._limits()[1]
        return TrackLeg((*start, 0.0), (*end, 0.0), limits, jerk_m_s3, SNAP_S)

    def _track_limits(self) -> Limits:
        most = self._limits()[0]
        limits = self._vehicle.navigator.limits()
        return replace(limits, speed_xy_m_s=self._speed_m_s, acceleration_xy_m_s2=most)

    def continue_from(self, old: TrackReference) -> None:
        """Round the corner from the leg before, if it knew of this one."""
        following = old._following
        if old._track is None or following is None or following.end[:2] != self.destination:
            return
        self._start = following.start[:2]
        self._length_m = math.dist(self._start, self.destination)
        self._leg, self._track = following, old._track
        self._track.go_on(following, self._vehicle.now_s)
        if self._speed_m_s != old._speed_m_s:
            self.change_speed(self._speed_m_s)

    def offer(self, following: Point) -> None:
        """The point after this one, to which the corner is rounded."""
        if self._following is None:
            self._following = self._leg_between(self.destination, following)
        if self._track is not None:
            radius_m = max(self._vehicle.parameters["WP_RADIUS"], 0.1)
            self._track.offer(self._following, radius_m, self._vehicle.now_s)

    def change_speed(self, speed_m_s: float) -> None:
        """Another speed from now on."""
        super().change_speed(speed_m_s)
        if self._track is not None:
            self._track.change_limits(self._track_limits(), self._vehicle.now_s)

    def _advance(self) -> Motion2:
        """Move the reference on to now."""
        rover = self._vehicle
        if self._track is None:
            gain = max(rover.parameters["PSC_POS_P"], 0.01)
            self._track = LegTrack(self._leg, rover.now_s, gain)
        self._track.advance(rover.now_s, False, rover.motion, self._limits()[1])
        (north, east, _), (v_n, v_e, _), _ = self._track.at(rover.now_s)
        return (north, east), (v_n, v_e), self._track.passed(rover.now_s)

    def _passed_corner(self) -> bool:
        """A rounded corner ends a leg wherever the vehicle is."""
        return self._following is not None
