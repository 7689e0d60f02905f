"""The requested yaw: CONDITION_YAW and regions of interest.

From ArduCopter's source: a heading is turned to at no more than ATC_SLEW_YAW and kept until
the next waypoint, setpoint or mode; a region of interest is looked at until it is taken away
or the mode changes.
"""

from __future__ import annotations

import math

from mavlink_sitl.exchange import Motion, Vector

SLEW_DEG_S = 60.0
"""ATC_SLEW_YAW"""
REACHED_RAD = math.radians(2.0)


class YawControl:
    """The heading that was asked for.

    Attributes:
        heading_rad: where the nose is to point now; None where nobody asked for anything.
    """

    def __init__(self) -> None:
        """Nobody has asked for anything."""
        self.heading_rad: float | None = None
        self._left_rad = 0.0
        self._slew_rad_s = 0.0
        self._region: Vector | None = None
        self._updated_s = 0.0

    def turn(
        self, yaw_rad: float, angle_deg: float, rate_deg_s: float, direction: float, relative: float
    ) -> None:
        """CONDITION_YAW.

        Args:
            yaw_rad: where the nose points.
            angle_deg: where to, from North, or how far when relative.
            rate_deg_s: how fast; 0 for the firmware's own rate.
            direction: 1 clockwise, -1 against it, 0 the shorter way.
            relative: 1 for an angle from where the nose points, or is to point by now.
        """
        if self.heading_rad is not None and self._region is None:
            yaw_rad = self.heading_rad
        if relative > 0.0:
            left = math.radians(angle_deg) * (1.0 if direction >= 0.0 else -1.0)
        else:
            left = math.remainder(math.radians(angle_deg) - yaw_rad, math.tau)
            if direction * left < 0.0:
                left += math.copysign(math.tau, direction)
        rate = min(rate_deg_s, SLEW_DEG_S) if rate_deg_s > 0.0 else SLEW_DEG_S
        self.heading_rad, self._left_rad = yaw_rad, left
        self._slew_rad_s = math.radians(rate)
        self._region = None

    def look_at(self, place_ned_m: Vector | None) -> None:
        """A region of interest, or None for none any more."""
        self._region = place_ned_m
        self.heading_rad = None

    def forget_heading(self) -> None:
        """A heading that was asked for no longer counts; a region of interest does."""
        if self._region is None:
            self.heading_rad = None

    def forget(self) -> None:
        """Neither counts."""
        self.look_at(None)

    def update(self, motion: Motion, now_s: float) -> None:
        """Turn on."""
        dt, self._updated_s = now_s - self._updated_s, now_s
        if self._region is not None:
            north, east = self._region[0] - motion.north_m, self._region[1] - motion.east_m
            self.heading_rad = math.atan2(east, north)
        elif self.heading_rad is not None:
            most = self._slew_rad_s * dt
            step = min(max(self._left_rad, -most), most)
            self._left_rad -= step
            self.heading_rad += step

    def reached(self, yaw_rad: float) -> bool:
        """Whether the nose points where it is to point."""
        if self.heading_rad is None:
            return True
        off = math.remainder(yaw_rad - self.heading_rad, math.tau)
        return self._left_rad == 0.0 and abs(off) <= REACHED_RAD
