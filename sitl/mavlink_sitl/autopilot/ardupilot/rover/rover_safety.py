"""Failsafes and fence of rovers and boats, after the documentation of their parameters."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.failsafe import Failsafes
from mavlink_sitl.autopilot.safety.fence import CIRCLE, Fence
from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

HOLD, AUTO, RTL, SMART_RTL = 4, 10, 11, 12
"""Modes"""
ACTIONS = {
    1: (RTL, HOLD),
    2: (HOLD,),
    3: (SMART_RTL, RTL, HOLD),
    4: (SMART_RTL, HOLD),
}
"""FS_ACTION, FENCE_ACTION and BATT_FS_*_ACT: the modes that are tried; 0 only says it"""
TERMINATE = 5
"""BATT_FS_*_ACT"""
CONTINUES_AUTO = 2
"""FS_THR_ENABLE and FS_GCS_ENABLE"""
EKF_IGNORED, EKF_HOLD = 0, 1
"""FS_EKF_ACTION; 2 only says it"""
GIVE_UP_M = 100.0
"""Further outside its circle it stands still"""


class RoverFailsafes(Failsafes):
    """Battery, ground station, radio and estimator."""

    _vehicle: Rover

    def __init__(self, rover: Rover) -> None:
        super().__init__(rover)
        self._gone_s: dict[str, float] = {}

    def _empty(self, action: int) -> None:
        if action == TERMINATE:
            self._vehicle.disarm(force=True)
        else:
            self._vehicle.enter_first(ACTIONS.get(action, ()))

    def _ground_station(self, now_s: float) -> None:
        p = self._vehicle.parameters
        enabled = int(p["FS_GCS_ENABLE"])
        silent = enabled > 0 and self._silent_for_s(now_s) >= p["FS_GCS_TIMEOUT"]
        self.gcs_lost = self._link("GCS", self.gcs_lost, silent, enabled, now_s)

    def _radio(self, now_s: float) -> None:
        rover, p = self._vehicle, self._vehicle.parameters
        enabled = int(p["FS_THR_ENABLE"])
        silent = enabled > 0 and not rover.radio.heard(now_s)
        self.radio_lost = self._link("Radio", self.radio_lost, silent, enabled, now_s)

    def _link(self, name: str, lost: bool, silent: bool, enabled: int, now_s: float) -> bool:
        """Carry out FS_ACTION, FS_TIMEOUT after a link became silent; whether it counts as lost.

        Args:
            name: of the link, for the texts.
            lost: whether it counts as lost already.
            silent: whether it is silent.
            enabled: the failsafe's parameter.
            now_s: simulated time.
        """
        rover = self._vehicle
        if not silent:
            self._gone_s.pop(name, None)
            if lost:
                rover.say(Severity.INFO, f"{name} Failsafe Cleared")
            return False
        since_s = self._gone_s.setdefault(name, now_s)
        number = rover.mode.spec.number
        waits = now_s - since_s <= rover.parameters["FS_TIMEOUT"] or not rover.armed
        if lost or waits or number in (HOLD, RTL):
            return lost
        rover.say(Severity.WARNING, f"{name} Failsafe")
        if number == AUTO and enabled == CONTINUES_AUTO:
            rover.say(Severity.WARNING, "Failsafe - Continuing Auto Mode")
        else:
            rover.enter_first(ACTIONS.get(int(rover.parameters["FS_ACTION"]), ()))
        return True

    @property
    def active(self) -> bool:
        """Whether HEARTBEAT says CRITICAL: not for the battery (`vehicle_system_status`)."""
        return self.gcs_lost or self.estimator_lost or self.radio_lost

    def _estimator(self) -> None:
        """FS_EKF_ACTION; whatever it is, the HEARTBEAT and the first text report the loss."""
        rover = self._vehicle
        lost = rover.armed and rover.estimator.variance
        if lost == self.estimator_lost:
            return
        self.estimator_lost = lost
        if not lost:
            rover.say(Severity.CRITICAL, "EKF failsafe cleared")
            return
        rover.say(Severity.CRITICAL, "EKF variance")
        action = int(rover.parameters["FS_EKF_ACTION"])
        if action == EKF_IGNORED or not rover.mode.spec.requires_position:
            return
        if action == EKF_HOLD:
            rover.enter_mode(HOLD)
        rover.say(Severity.CRITICAL, "EKF failsafe")


class RoverFence(Fence):
    """The same actions as of failsafes; far outside it only stops."""

    _vehicle: Rover

    def _act(self, action: int) -> None:
        rover = self._vehicle
        home = rover.navigator.home_ned_m()
        outside_m = math.dist(rover.motion[:2], home[:2]) - rover.parameters["FENCE_RADIUS"]
        if action and self.breached & CIRCLE and outside_m > GIVE_UP_M:
            rover.enter_mode(HOLD)
        else:
            rover.enter_first(ACTIONS.get(action, ()))
