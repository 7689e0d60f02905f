"""The target on which a copter's LAND lands: LANDING_TARGET of a companion, with PLND_ENABLED.

Recorded of 4.7.0-dev with PLND_TYPE 1 and a position in MAV_FRAME_BODY_FRD; read in the source are
the other frame's text and the limits of time and distance. Left out: retries and failsafes, which
a vehicle without a rangefinder was not seen to begin, and the angles of a camera's picture.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Motion, Severity, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter

BY_COMPANION = 1
"""PLND_TYPE"""
BEGINS_S = 2.0
"""From the first measurement until the target is used"""
SILENT_S = 2.0
"""A target that was not measured for longer is lost"""
SMOOTHED_S = 0.3
"""Over this time measurements are averaged"""
SLOW_BELOW_M, SLOW_ABOVE_M = 2.0, 0.35
"""Between these heights above the target it sinks slower, the more so the farther it is off"""
SLOW_SHARE, SLOWEST_M_S, SLOW_WITHIN_M = 0.5, 0.1, 0.15


class LandingTarget:
    """The estimate of where the target is.

    Attributes:
        place: NED metres; None before the first measurement.
    """

    place: Vector | None = None

    def __init__(self, copter: Copter) -> None:
        self._copter = copter
        self._heard_s = self._begun_s = -math.inf
        self._complete = False
        self._frame_reported = False

    def hear(self, seen_frd_m: Vector, distance_m: float) -> None:
        """Take a measurement in MAV_FRAME_BODY_FRD; without a distance it is dropped."""
        copter, now_s = self._copter, self._copter.now_s
        if not self.is_enabled or not distance_m > 0.0:
            return
        motion = copter.motion
        north, east, down = _to_ned(seen_frd_m, motion)
        seen = (motion.north_m + north, motion.east_m + east, motion.down_m + down)
        if self.place is None or self._is_silent():
            self.place, self._begun_s, self._complete = seen, now_s, False
            copter.say(Severity.INFO, "PrecLand: Target Found")
        else:
            share = 1.0 - math.exp(-(now_s - self._heard_s) / SMOOTHED_S)
            x, y, z = (a + share * (b - a) for a, b in zip(self.place, seen, strict=True))
            self.place = (x, y, z)
        self._heard_s = now_s

    def refuse_frame(self) -> None:
        """Report once that a position came in another frame."""
        if self.is_enabled and not self._frame_reported:
            self._frame_reported = True
            self._copter.say(Severity.INFO, "Plnd: Frame not supported ")

    def update(self) -> None:
        """Notice that it can be used, or is lost; called at the autopilot's rate."""
        if self.place is None:
            return
        if self._is_silent():
            self.place = None
            if self._complete:
                self._copter.say(Severity.CRITICAL, "PrecLand: Target Lost")
        elif not self._complete and self._copter.now_s - self._begun_s >= BEGINS_S:
            self._complete = True
            self._copter.say(Severity.INFO, "PrecLand: Init Complete")

    @property
    def is_enabled(self) -> bool:
        """Whether the parameters say that a companion sees a target."""
        parameters = self._copter.parameters
        return bool(parameters["PLND_ENABLED"]) and int(parameters["PLND_TYPE"]) == BY_COMPANION

    @property
    def acquired(self) -> Vector | None:
        """Where to land, NED metres; None without a target that is seen."""
        return self.place if self._complete and not self._is_silent() else None

    def _is_silent(self) -> bool:
        return self._copter.now_s - self._heard_s > SILENT_S

    def descent_m_s(self, target: Vector, plain_m_s: float) -> float:
        """How fast to sink towards the target.

        Args:
            target: where it is, NED metres.
            plain_m_s: the speed of a landing without a target.
        """
        p, motion = self._copter.parameters, self._copter.motion
        off_m = math.hypot(target[0] - motion.north_m, target[1] - motion.east_m)
        if 0.0 < p["PLND_XY_DIST_MAX"] < off_m:
            return 0.0
        if not SLOW_ABOVE_M < target[2] - motion.down_m < SLOW_BELOW_M:
            return plain_m_s
        speed = SLOW_SHARE * p["LAND_SPEED"] / 100.0
        return max(SLOWEST_M_S, speed * (1.0 - off_m / SLOW_WITHIN_M))


def _to_ned(vector: Vector, motion: Motion) -> Vector:
    """Turn a vector from forward, right, down of the body to NED."""
    x, y, z = vector
    s, c = math.sin(motion.roll_rad), math.cos(motion.roll_rad)
    y, z = c * y - s * z, s * y + c * z
    s, c = math.sin(motion.pitch_rad), math.cos(motion.pitch_rad)
    x, z = c * x + s * z, c * z - s * x
    s, c = math.sin(motion.yaw_rad), math.cos(motion.yaw_rad)
    return c * x - s * y, s * x + c * y, z
