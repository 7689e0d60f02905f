"""What the EKF says about itself: when it starts, has an origin, has a position, loses it.

Times and flags are those seen in the recordings (`copter_guided` for the start; the list in
the observations of the GPS loss). The numbers themselves come from `world.sensors`.
"""

from __future__ import annotations

from mavlink_sitl.autopilot.personality import Personality

FLAGS_UNINITIALISED = 0x400
FLAGS_NO_ATTITUDE = 0x0
FLAGS_ALIGNED = 0xA7
FLAGS_USING_GPS = 0x33F
FLAGS_VARIANCE = 0x25

VARIANCE_AFTER_S = 8.0
"""From losing the GPS to 'EKF variance'."""
LOST_AFTER_S = 15.0
"""From losing the GPS to the end of LOCAL_POSITION_NED."""
RECOVERY_S = 1.0
"""From the GPS coming back to using it again."""


class Estimator:
    """The EKF's state of health over time.

    Args:
        personality: gives the times of the real firmware.
        boot_s: simulated time of power-up.
        ready_after_s: how long after it GPS is used; the other times shrink in proportion.
    """

    def __init__(self, personality: Personality, boot_s: float, ready_after_s: float) -> None:
        """See the class."""
        self._boot_s = boot_s
        self.time_scale = min(ready_after_s / personality.ready_s, 1.0)
        self._ready_at_s = boot_s + ready_after_s
        self._lost_since_s: float | None = None
        self._fix_since_s = boot_s
        self._fix_at_s = self.scaled(personality.gps_fix_s)
        self._origin_at_s = self.scaled(personality.origin_s)
        self._now_s = boot_s
        self._fix = True

    def scaled(self, at_s: float) -> float:
        """Simulated time of something that the real firmware does `at_s` after power-up."""
        return self._boot_s + at_s * self.time_scale

    def update(self, now_s: float, gps_fix: bool) -> None:
        """Take notice of the time and of the receiver."""
        self._now_s = now_s
        if gps_fix and self._fix and self._lost_since_s is None:
            return  # as nearly always
        if gps_fix and not self._fix:
            self._fix_since_s = now_s
        self._fix = gps_fix
        recovered = gps_fix and now_s - self._fix_since_s >= RECOVERY_S
        if recovered or (gps_fix and self._outage_s() < VARIANCE_AFTER_S):
            self._lost_since_s = None
        elif not gps_fix and self._lost_since_s is None:
            self._lost_since_s = now_s

    def _outage_s(self) -> float:
        return 0.0 if self._lost_since_s is None else self._now_s - self._lost_since_s

    @property
    def gps_fix(self) -> bool:
        """Whether the receiver has a fix."""
        return self._fix and self.gps_started

    @property
    def gps_started(self) -> bool:
        """Whether the receiver has been found; before, it says nothing at all."""
        return self._now_s >= self._fix_at_s

    @property
    def has_origin(self) -> bool:
        """Whether the local frame exists."""
        return self._now_s >= self._origin_at_s

    @property
    def using_gps(self) -> bool:
        """Whether LOCAL_POSITION_NED is sent."""
        return self._now_s >= self._ready_at_s and self._outage_s() < LOST_AFTER_S

    @property
    def lost(self) -> bool:
        """Whether there was a position once and is none now: latitude and longitude freeze."""
        outage = self._lost_since_s is not None
        return outage and self._now_s >= self._ready_at_s and not self.using_gps

    @property
    def variance(self) -> bool:
        """Whether the EKF failsafe is due."""
        return self._outage_s() >= VARIANCE_AFTER_S

    @property
    def position_ok(self) -> bool:
        """Whether modes that need a position may be entered."""
        return self.using_gps and not self.variance

    @property
    def flags(self) -> int:
        """EKF_STATUS_REPORT.flags."""
        if self._now_s < self.scaled(4.46):
            return FLAGS_UNINITIALISED
        if self._now_s < self.scaled(5.81):
            return FLAGS_NO_ATTITUDE
        if not self.using_gps:
            return FLAGS_ALIGNED
        return FLAGS_VARIANCE if self.variance else FLAGS_USING_GPS
