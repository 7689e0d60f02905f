"""PX4's arming and disarming, and the motor ramp before take-off."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.arming import Arming
from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

RAMP_SHARE = 0.75
"""Share of MPC_TKO_RAMP_T after which the thrust lifts the vehicle (recorded: 2.3 s of 3 s)"""
SPOOL_S = 1.0
"""How long the controllers take from idle to lift; part of the ramp"""


class Px4Arming(Arming):
    """Whether the motors of one vehicle are armed, and who may change that.

    Attributes:
        lift_began_s: when the mode wanted to leave the ground and the ramp began.
        landed_at_s: when a landing was detected in this flight.
    """

    _vehicle: Px4Vehicle

    def __init__(self, vehicle: Px4Vehicle) -> None:
        super().__init__(vehicle)
        self.lift_began_s = math.inf
        self.landed_at_s = math.inf
        self._disarm_text = ""

    def arm(self, force: bool, by: str) -> Result:
        """Arm the motors when the chosen mode can run, or when forced; the text says by what."""
        vehicle = self._vehicle
        if self.armed:
            return Result.ACCEPTED
        vehicle.feasibility.hear()
        if not force and not vehicle.can_arm():
            for missing in vehicle.systems.missing():
                vehicle.say(Severity.CRITICAL, f"Preflight Fail: {missing}")
            text = "Arming denied: Resolve system health failures first"
            vehicle.say(Severity.CRITICAL, text)
            return Result.TEMPORARILY_REJECTED
        self.armed = True
        self.armed_at_s = vehicle.now_s
        self.lift_began_s = self.landed_at_s = math.inf
        if vehicle.estimator.has_origin:
            vehicle.set_home()
        vehicle.say(Severity.INFO, f"Armed by {by}")
        return Result.ACCEPTED

    def disarm(self, force: bool) -> Result:
        """Disarm the motors; in the air only when forced."""
        vehicle = self._vehicle
        if not self.armed:
            return Result.ACCEPTED
        if not vehicle.may_disarm() and not force:
            vehicle.say(Severity.CRITICAL, "Disarming denied: not landed")
            return Result.TEMPORARILY_REJECTED
        self.armed = False
        text, self._disarm_text = self._disarm_text, ""
        vehicle.say(Severity.INFO, text or "Disarmed by external command")
        vehicle.plans.rewind()
        vehicle.flight_ended()
        return Result.ACCEPTED

    def run_checks(self) -> Result:
        """RUN_PREARM_CHECKS: the verdict shows in SYS_STATUS."""
        return Result.TEMPORARILY_REJECTED if self.armed else Result.ACCEPTED

    def watch(self) -> None:
        """Begin the ramp once the motors turn and the mode wants to go up."""
        vehicle = self._vehicle
        self.checks_passed = vehicle.can_arm()
        if not self.armed or math.isfinite(self.lift_began_s):
            return
        spooled = vehicle.now_s - self.armed_at_s >= vehicle.parameters["COM_SPOOLUP_TIME"]
        if spooled and vehicle.mode.wants_to_lift():
            self.lift_began_s = vehicle.now_s
            self.landed_at_s = math.inf

    def landed(self) -> None:
        """A flight has ended; another may begin before disarming."""
        self.landed_at_s = self._vehicle.now_s
        self.lift_began_s = math.inf

    def may_lift(self) -> bool:
        """Whether the motors may give what lifts the vehicle."""
        ramp_s = max(RAMP_SHARE * self._vehicle.parameters["MPC_TKO_RAMP_T"] - SPOOL_S, 0.0)
        return self._vehicle.now_s - self.lift_began_s >= ramp_s

    def disarm_is_due(self, landed_since_s: float) -> bool:
        """After landing, and when nobody takes off."""
        vehicle, p = self._vehicle, self._vehicle.parameters
        if not self.armed or vehicle.in_flight:
            return False
        if math.isfinite(self.landed_at_s):
            delay_s, since_s = p["COM_DISARM_LAND"], self.landed_at_s
            self._disarm_text = "Disarmed by landing"
        elif math.isfinite(self.lift_began_s):
            return False
        else:
            delay_s = p["COM_DISARM_PRFLT"]
            since_s = self.armed_at_s + p["COM_SPOOLUP_TIME"]
            self._disarm_text = "Disarmed by auto preflight disarming"
        if delay_s > 0.0 and vehicle.now_s - since_s >= delay_s:
            return True
        self._disarm_text = ""
        return False
