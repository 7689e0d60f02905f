"""The EKF's reported state: start, origin, position, loss of position.

Times and flags are those seen in the recordings (`copter_guided` for the start; the list in
the observations of the GPS loss). The numbers themselves come from `world.sensors`.

A receiver that jumps is not believed at first: the estimate continues by what else it has, and
says that it does. After a time it gives in, and is reset to the receiver in one step (read in
both firmwares' estimators, and seen on PX4's own simulator).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.autopilot.personality import Personality

FLAGS_UNINITIALISED = 0x400
FLAGS_NO_ATTITUDE = 0x0
FLAGS_ALIGNED = 0xA7
FLAGS_USING_GPS = 0x33F
FLAGS_VARIANCE = 0x25

LOST_AFTER_S = 15.0
"""From losing the GPS to the end of LOCAL_POSITION_NED."""
RECOVERY_S = 1.0
"""From the GPS coming back to using it again."""


class GlitchRules(NamedTuple):
    """A firmware's handling of a GPS glitch.

    Attributes:
        gate_m: a jump this far is not believed.
        gives_in_s: time after which the estimate is reset to the receiver.
        flagged_s: from the jump to the flag that says so.
        cleared_s: how long all must be well before the flag goes.
        doubtful_after_s: from losing the GPS to a position that is no longer used: ArduPilot's
            'EKF variance', PX4's failsafe.
        regains_s: from the receiver's fix coming back to the reset of the estimate to it.
    """

    gate_m: float
    gives_in_s: float
    flagged_s: float
    cleared_s: float
    doubtful_after_s: float
    regains_s: float


EKF3 = GlitchRules(3.7, 10.0, 1.0, 10.0, 8.0, 0.3)
"""EK3_POS_I_GATE of 5 sigma with EK3_POSNE_M_NSE; posRetryTimeUseVel_ms; calcGpsGoodForFlight"""
EKF2 = GlitchRules(4.7, 7.0, 0.0, 0.0, 5.2, 1.2)
"""EKF2_GPS_P_GATE of 5 sigma with the receiver's 0.9 m; reset_timeout_max; EKF2_NOAID_TOUT, 5 s"""
_PX4 = 12
"""MAV_AUTOPILOT_PX4"""


class Estimator:
    """The EKF's state of health over time.

    Args:
        personality: gives the times of the real firmware.
        boot_s: simulated time of power-up.
        ready_after_s: how long after it GPS is used; if that is sooner than in the real firmware,
            the other times shrink in proportion.
    """

    is_external = False
    """Whether it takes its position from outside, and has no receiver"""

    def __init__(self, personality: Personality, boot_s: float, ready_after_s: float) -> None:
        self._boot_s = boot_s
        self.time_scale = min(ready_after_s / personality.ready_s, 1.0)
        self._firmware_ready_s = personality.ready_s
        self._ready_at_s = boot_s + ready_after_s
        self._lost_since_s: float | None = None
        self._fix_since_s = boot_s
        self._fix_at_s = self.scaled(personality.gps_fix_s)
        self._origin_at_s = self.scaled(personality.origin_s)
        self._now_s = boot_s
        self._fix = True
        self.glitch_rules = EKF2 if personality.mav_autopilot == _PX4 else EKF3
        self.resets = 0
        """How often it was reset to a receiver that it had not believed"""
        self.regains = 0
        """How often it was reset to a receiver that had lost its fix"""
        self._regains_at_s = math.inf
        self.gps_off_m = 0.0
        self._rejects_since_s: float | None = None
        self._rejected_at_s: float | None = None
        self._flagged = False

    def scaled(self, at_s: float) -> float:
        """Simulated time of something that the real firmware does `at_s` after power-up.

        A start that is longer than the firmware's waits for its GPS: what comes with the
        position, as "is using GPS", comes when there is one.
        """
        since_ready_s = at_s - self._firmware_ready_s
        if since_ready_s >= 0.0:
            return self._ready_at_s + since_ready_s * self.time_scale
        return self._boot_s + at_s * self.time_scale

    def update(self, now_s: float, gps_fix: bool, gps_off_m: float = 0.0) -> None:
        """Process the time and the receiver, which may be far off the estimate."""
        self._now_s = now_s
        if gps_off_m > 0.0 or self._flagged or self._rejects_since_s is not None:
            self._judge(now_s, gps_fix, gps_off_m)
        if now_s >= self._regains_at_s:
            self._regains_at_s = math.inf
            self.regains += 1
        if gps_fix and self._fix and self._lost_since_s is None:
            return  # as nearly always
        if gps_fix and not self._fix:
            self._fix_since_s = now_s
            self._regains_at_s = now_s + self.glitch_rules.regains_s
        if not gps_fix:
            self._regains_at_s = math.inf
        self._fix = gps_fix
        recovered = gps_fix and now_s - self._fix_since_s >= RECOVERY_S
        if recovered or (gps_fix and self._outage_s() < self.glitch_rules.doubtful_after_s):
            self._lost_since_s = None
        elif not gps_fix and self._lost_since_s is None:
            self._lost_since_s = now_s

    def _judge(self, now_s: float, gps_fix: bool, gps_off_m: float) -> None:
        """Believe the receiver, or not, or not any longer."""
        rules = self.glitch_rules
        self.gps_off_m = gps_off_m if gps_fix else 0.0
        if self.gps_off_m <= rules.gate_m:
            self._rejects_since_s = None
        else:
            self._rejected_at_s = now_s
            if self._rejects_since_s is None:
                self._rejects_since_s = now_s
            if now_s - self._rejects_since_s >= rules.gives_in_s:
                self.resets += 1
                self.gps_off_m, self._rejects_since_s = 0.0, None
        since_s, last_s = self._rejects_since_s, self._rejected_at_s
        if since_s is not None and now_s - since_s >= rules.flagged_s:
            self._flagged = True
        elif since_s is None and (last_s is None or now_s - last_s >= rules.cleared_s):
            self._flagged = False

    @property
    def glitching(self) -> bool:
        """Whether it says that the receiver is not to be believed."""
        return self._flagged and self.position_ok

    @property
    def gps_test_ratio(self) -> float:
        """The GPS innovation as a fraction of its gate."""
        return self.gps_off_m / self.glitch_rules.gate_m

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
        return self._outage_s() >= self.glitch_rules.doubtful_after_s

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


class ExternalEstimator(Estimator):
    """An estimator without a receiver: its position comes from outside, its origin by message.

    An ArduPilot with EK3_SRC1_POSXY 6 and VISO_TYPE 1, a PX4 with EKF2_EV_CTRL 15 and EKF2_GPS_CTRL
    0.
    """

    is_external = True

    def __init__(self, personality: Personality, boot_s: float, ready_after_s: float) -> None:
        super().__init__(personality, boot_s, ready_after_s)
        self.origin_given = False
        self._fix = False
        self._lost_since_s = -math.inf

    @property
    def gps_started(self) -> bool:
        """Whether there has been a position."""
        return self.has_origin and self._lost_since_s != -math.inf

    @property
    def has_origin(self) -> bool:
        """Whether the local frame has a place on earth."""
        return self.origin_given and super().has_origin

    @property
    def using_gps(self) -> bool:
        """Whether LOCAL_POSITION_NED is sent."""
        return self._now_s >= self._ready_at_s and self.gps_started and super().using_gps

    @property
    def lost(self) -> bool:
        """Whether there was a position once and is none now."""
        return self.gps_started and super().lost
