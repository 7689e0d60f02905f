"""Failsafes and fence of planes, after the firmware's documentation of their parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.autopilot.safety.fence import Fence
from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane

CIRCLE, FBWA, FBWB, RTL, GUIDED = 1, 5, 6, 11, 15
"""Modes"""
BY_PILOT = frozenset((0, 2, 4, 5, 6, 7))
GOES_ON = frozenset((RTL, 13))
"""RTL and TAKEOFF are left by no failsafe of the links"""
SHORT_DISABLED, SHORT_BEST_GUESS = 3, 0
"""FS_SHORT_ACTN"""
SHORT_MODES = {2: FBWA, 4: FBWB}
"""FS_SHORT_ACTN; else CIRCLE"""
LONG_CONTINUE, LONG_GLIDE = 0, 2
"""FS_LONG_ACTN; 1 is RTL"""
BATTERY_RETURNS, BATTERY_LANDS, BATTERY_TERMINATES = 1, 2, 3
"""BATT_FS_*_ACT"""
GCS_IN_AUTO_ONLY = 3
"""FS_GCS_ENABL"""
FENCE_RETURNS = 1
"""FENCE_ACTION"""
NO_MODE_CHANGE = 1
"""Bit of FENCE_OPTIONS: until the breach is over"""


class PlaneFailsafes(Failsafes):
    """Short and long loss of the radio, loss of the ground station, battery."""

    _vehicle: Plane

    def __init__(self, plane: Plane) -> None:
        super().__init__(plane)
        self._short_since_s: float | None = None
        self._long = False
        self._was_in: int | None = None

    def _estimator(self) -> None:
        """A plane without GPS continues by what it measures of the air."""
        self.estimator_lost = False

    def _empty(self, action: int) -> None:
        plane = self._vehicle
        if action == BATTERY_TERMINATES:
            plane.disarm(force=True)
        elif plane.mode.landing:
            return
        elif action == BATTERY_RETURNS or (
            action == BATTERY_LANDS and plane.start_landing() is not Result.ACCEPTED
        ):
            plane.enter_mode(RTL)

    def _ground_station(self, now_s: float) -> None:
        plane = self._vehicle
        enabled = int(plane.parameters["FS_GCS_ENABL"])
        counts = enabled and (enabled != GCS_IN_AUTO_ONLY or plane.mode is plane.auto)
        lost = self._silent_for_s(now_s) > plane.parameters["FS_LONG_TIMEOUT"]
        if lost and counts and not self.gcs_lost and plane.armed and not plane.mode.landing:
            self.gcs_lost = True
            self._lost_for_long("GCS")
        elif self.gcs_lost and not lost:
            self.gcs_lost = False
            plane.say(Severity.WARNING, "GCS Failsafe Off")

    def _lost_for_long(self, what: str) -> None:
        """Do what FS_LONG_ACTN says in this mode."""
        plane = self._vehicle
        action, mode = int(plane.parameters["FS_LONG_ACTN"]), plane.mode.spec.number
        by_itself = mode in (GUIDED, 10)
        if mode not in GOES_ON and not (by_itself and action == LONG_CONTINUE):
            plane.enter_mode(FBWA if action == LONG_GLIDE else RTL)
        plane.say(Severity.WARNING, f"{what} Failsafe On: {plane.mode.spec.name}")

    def _radio(self, now_s: float) -> None:
        plane, p = self._vehicle, self._vehicle.parameters
        if not p["THR_FAILSAFE"] or plane.radio.heard(now_s):
            self._radio_gone_s = None
            self._radio_is_back()
            return
        if self._radio_gone_s is None:
            self._radio_gone_s = now_s
        if now_s - self._radio_gone_s < p["FS_SHORT_TIMEOUT"] or plane.mode.landing:
            return
        if not plane.armed:
            return
        if not self.radio_lost:
            self.radio_lost = True
            self._short_since_s = now_s
            if int(p["FS_SHORT_ACTN"]) != SHORT_DISABLED:
                self._lost_for_short()
        if not self._long and now_s - (self._short_since_s or now_s) > p["FS_LONG_TIMEOUT"]:
            self._long = True
            self._lost_for_long("RC Long")

    def _lost_for_short(self) -> None:
        """Do what FS_SHORT_ACTN says in this mode."""
        plane = self._vehicle
        action, mode = int(plane.parameters["FS_SHORT_ACTN"]), plane.mode.spec.number
        goes_on = mode in GOES_ON or mode == CIRCLE
        if goes_on or (mode not in BY_PILOT and action == SHORT_BEST_GUESS):
            plane.say(Severity.WARNING, "RC Short Failsafe On")
            return
        plane.enter_mode(SHORT_MODES.get(action, CIRCLE))
        self._was_in = mode
        plane.say(Severity.WARNING, f"RC Short Failsafe: switched to {plane.mode.spec.name}")

    def _radio_is_back(self) -> None:
        plane = self._vehicle
        if not self.radio_lost:
            return
        self.radio_lost = False
        if self._long:
            plane.say(Severity.WARNING, "RC Long Failsafe Cleared")
        else:
            plane.say(Severity.WARNING, "Short Failsafe Cleared")
            in_it = plane.mode.spec.number in (CIRCLE, *SHORT_MODES.values())
            if self._was_in is not None and in_it and plane.enter_mode(self._was_in):
                plane.say(Severity.INFO, f"Flight mode {plane.mode.spec.name} restored")
        self._long, self._was_in = False, None


class PlaneFence(Fence):
    """RTL; until the breach is over, FENCE_OPTIONS may forbid changes of the mode.

    Attributes:
        recovering: it is on its way back.
    """

    again_m = 100.0

    _vehicle: Plane
    recovering = False

    def update(self) -> None:
        """See `Fence`; after a breach it says that it is over."""
        plane, was = self._vehicle, self.breached
        super().update()
        if was and not self.breached and plane.armed:
            plane.say(Severity.NOTICE, "Fence breach cleared")
        back = plane.landed and not self.breached
        if not plane.armed or back or not self.enabled:
            self.recovering = False

    @property
    def locks_mode(self) -> bool:
        """Whether the mode must not be changed now."""
        locked = int(self._vehicle.parameters["FENCE_OPTIONS"]) & NO_MODE_CHANGE
        return bool(locked and self.enabled and self.breached and self.recovering)

    def _ignores_breaches(self) -> bool:
        return self.recovering

    def _act(self, action: int) -> None:
        if action == FENCE_RETURNS:
            self._vehicle.enter_mode(RTL)
            self.recovering = True
