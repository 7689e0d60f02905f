"""Failsafes and fence of planes, after the firmware's documentation of their parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import Guided
from mavlink_sitl.autopilot.plans.plans import Cmd
from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.autopilot.safety.fence import Fence, areas_of
from mavlink_sitl.exchange import Severity, Vector

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
FENCE_RETURNS, FENCE_GUIDED = 1, (6, 7)
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
        elif plane.mode.landing or (action == BATTERY_LANDS and plane.start_landing()):
            return
        elif action in (BATTERY_RETURNS, BATTERY_LANDS):
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
    """RTL, or GUIDED to the return point or a rally point.

    Attributes:
        recovering: it is on its way back; until the breach is over, FENCE_OPTIONS may forbid
            changes of the mode.
    """

    again_m = 100.0

    _vehicle: Plane

    def __init__(self, plane: Plane) -> None:
        super().__init__(plane)
        self._mode_before = plane.mode.spec.number
        self.recovering = False

    def update(self) -> None:
        """See `Fence`; after a breach it says that it is over."""
        plane, was = self._vehicle, self.breached
        super().update()
        if was and not self.breached and plane.armed:
            plane.say(Severity.NOTICE, "Fence breach cleared")
        if self.recovering and not (plane.armed and (self.breached or not plane.landed)):
            self.recovering = False
        if self.recovering and not self.enabled:
            self.recovering = False
            if isinstance(plane.mode, Guided):
                plane.enter_mode(self._mode_before)

    @property
    def locks_mode(self) -> bool:
        """Whether the mode must not be changed now."""
        locked = int(self._vehicle.parameters["FENCE_OPTIONS"]) & NO_MODE_CHANGE
        return bool(locked and self.enabled and self.breached and self.recovering)

    def _ignores_breaches(self) -> bool:
        return self.recovering

    def _act(self, action: int) -> None:
        plane = self._vehicle
        if action not in (FENCE_RETURNS, *FENCE_GUIDED):
            return
        self._mode_before = plane.mode.spec.number
        if action == FENCE_RETURNS:
            plane.enter_mode(RTL)
        else:
            plane.enter_mode(GUIDED)
            plane.reposition(self._return_point())
        self.recovering = True

    def _return_point(self) -> Vector:
        """Where GUIDED takes it: NED metres."""
        plane, p = self._vehicle, self._vehicle.parameters
        if p["FENCE_RET_RALLY"]:
            return plane.return_point_ned_m()
        lowest = p["FENCE_ALT_MIN"] + p["FENCE_MARGIN"]
        highest = p["FENCE_ALT_MAX"] - p["FENCE_MARGIN"]
        height = p["FENCE_RET_ALT"]
        if height <= 0.0:
            height = p["RTL_ALTITUDE"] if lowest >= highest else (lowest + highest) / 2.0
        home = plane.navigator.home_ned_m()
        north, east = self._uploaded_point() or home[:2]
        return north, east, home[2] - height

    def _uploaded_point(self) -> tuple[float, float] | None:
        """The return point; without one, the middle of the first inclusion polygon."""
        items = self._vehicle.plans.fence.items
        frame = self._vehicle.navigator.frame
        for item in items:
            if item.command == Cmd.FENCE_RETURN_POINT:
                return item.level_m(frame)
        for area in areas_of(items, frame):
            if area.inclusion and area.corners:
                norths, easts = zip(*area.corners, strict=True)
                return (min(norths) + max(norths)) / 2.0, (min(easts) + max(easts)) / 2.0
        return None
