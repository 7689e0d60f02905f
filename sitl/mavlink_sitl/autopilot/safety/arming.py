"""Arming, disarming, and the checks before; each gives its reason in the firmware's words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.state.radio import AXES
from mavlink_sitl.exchange import Motors, Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

STICK = "stick"
"""Arming by the rudder stick"""
BY_ORDER = ("auto", "guided")
"""Behaviours in which only a ground station arms"""
CHECK_INTERVAL_S = 1.0
REPEAT_TEXT_S = 30.0
LANDED_TO_DISARM_S = 0.5
"""In LAND and RTL, from 'landed' to disarming"""
ALLOW_ARMING = 1
"""Bit of AUTO_OPTIONS"""
THROTTLE_LOW = 0.05
"""The stick counts as lowest below this; higher, DISARM_DELAY does not run"""

NOT_STARTED = (
    "Need Alt Estimate",
    "Hardware safety switch",
    "Gyros not healthy",
    "EKF attitude is bad",
    "Compass not healthy",
    "AHRS: waiting for home",
    "Battery 1 unhealthy",
)
"""Recorded one second after power-up (`copter_acks`)"""


ACCELS_AGREE_S, GYROS_AGREE_S = 10.4, 20.7
"""After the start: two accelerometers, and then two gyroscopes, have to agree for 10 s each"""
ALIGNED, ESTIMATOR_ACTIVE = "EKF3 IMU0 tilt alignment complete", "AHRS: EKF3 active"
"""Texts: the tilt is known; the attitude in use is now that of the EKF"""


def prearm_failures(vehicle: Commander) -> list[str]:
    """The failed pre-arm checks; empty if it can arm.

    Those of the first half minute were seen of the real copter and rover, armed once a second
    from power-up in STABILIZE, MANUAL and GUIDED.
    """
    if not vehicle.started:
        return list(NOT_STARTED)
    reasons = [] if vehicle.body.damage is None else [vehicle.body.damage]
    needs_position = vehicle.mode.spec.requires_estimate
    leans = vehicle.personality.kind == "copter"
    aligned = _has_said(vehicle, ALIGNED)
    if leans and needs_position and not aligned:
        reasons.append("Need Alt Estimate")
    reasons += _inertial_failures(vehicle)
    if leans and not aligned:
        reasons.append("EKF attitude is bad")
    if needs_position:
        reasons += _position_failures(vehicle)
    elif leans:
        reasons += _attitude_failures(vehicle)
    if vehicle.mode.spec.behaviour == "auto" and not vehicle.auto.has_mission:
        reasons.append("Mode requires mission")
    reasons += vehicle.failsafe.battery_reasons()
    reasons += vehicle.fence.reasons()
    return reasons


def _has_said(vehicle: Commander, text: str) -> bool:
    """Whether a line of the start has its time behind it; one that never comes has, too."""
    return all(line.text != text for line in vehicle.personality.boot[vehicle.state.lines :])


def _inertial_failures(vehicle: Commander) -> list[str]:
    started_s = vehicle.personality.standby_s
    for name, after_s in (("Accels", ACCELS_AGREE_S), ("Gyros", GYROS_AGREE_S)):
        if vehicle.now_s < vehicle.estimator.scaled(started_s + after_s):
            return [f"{name} inconsistent"]
    return []


def _armable(vehicle: Commander) -> bool:
    """Whether motors may be armed in this mode; AUTO_OPTIONS opens AUTO for it."""
    opens = vehicle.mode is vehicle.auto and "AUTO_OPTIONS" in vehicle.parameters
    if opens and int(vehicle.parameters["AUTO_OPTIONS"]) & ALLOW_ARMING:
        return True
    return vehicle.mode.spec.armable


def _attitude_failures(vehicle: Commander) -> list[str]:
    """Of modes that need no position."""
    if not _has_said(vehicle, ESTIMATOR_ACTIVE):
        return ["AHRS: not using configured AHRS type"]
    return [] if _has_said(vehicle, ALIGNED) else ["AHRS: EKF3 still initialising"]


def _position_failures(vehicle: Commander) -> list[str]:
    estimator = vehicle.estimator
    if estimator.gps_started and not estimator.gps_fix:
        return ["GPS 1: Bad fix"]
    drives = vehicle.personality.kind in ("rover", "boat")
    # A rover takes the first fix for its home, a copter waits for the estimator's origin.
    if not (estimator.gps_fix if drives else estimator.has_origin):
        return ["AHRS: waiting for home"]
    return [] if estimator.position_ok else ["Need Position Estimate"]


def stick_failures(vehicle: Commander, by_stick: bool) -> list[str]:
    """The failed pre-arm checks of the sticks; the stick that arms may be out of its middle.

    All kinds want the throttle at zero, in every mode (AP_Arming's `rc_arm_checks`, with the
    firmware's default of RC_OPTIONS).
    """
    radio, now_s, kind = vehicle.radio, vehicle.now_s, vehicle.personality.kind
    if not radio.obeyed(now_s):
        return []
    drives = kind in ("rover", "boat")
    arms = ("Roll" if drives else "Yaw") if by_stick else ""
    reasons = []
    for axis in AXES:
        centred = drives or axis != "Throttle"
        where = radio.angle(axis, now_s) if centred else radio.range(axis, now_s)
        if where and axis != arms:
            reasons.append(f"{axis} (RC{radio.calibration(axis).channel}) is not neutral")
    return reasons


class Arming:
    """Whether the motors of one vehicle are armed, and who may change that.

    Attributes:
        armed: whether they are.
        armed_at_s: simulated time of the latest arming.
        checks_passed: what the latest look at the checks gave.
    """

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self.armed = False
        self.armed_at_s = vehicle.boot_s
        self.checks_passed = False
        self._next_check_s = vehicle.boot_s
        self._last_text_s = vehicle.boot_s

    def arm(self, force: bool, by: str) -> Result:
        """Arm the motors, after the checks unless forced.

        Args:
            force: whatever the checks say.
            by: `STICK` has rules of its own.
        """
        vehicle, by_stick = self._vehicle, by == STICK
        if self.armed:
            return Result.ACCEPTED
        reasons = []
        by_order = by_stick and vehicle.mode.spec.behaviour in BY_ORDER
        if by_order or not _armable(vehicle):
            reasons.append(f"{vehicle.mode.spec.name} mode not armable")
        elif not force:
            reasons = prearm_failures(vehicle) or stick_failures(vehicle, by_stick)
        elif vehicle.body.damage is not None:
            reasons = [vehicle.body.damage]
        if vehicle.motors_stopped:
            reasons.append("Motors Emergency Stopped")
        for reason in reasons:
            vehicle.say(Severity.CRITICAL, f"Arm: {reason}")
        if reasons:
            return Result.FAILED
        self.armed = True
        self.armed_at_s = vehicle.now_s
        if vehicle.estimator.has_origin and not vehicle.navigator.home_locked:
            vehicle.set_home()
        vehicle.say(Severity.INFO, vehicle.personality.armed_text)
        return Result.ACCEPTED

    def disarm(self, force: bool) -> Result:
        """Disarm the motors; in the air only when forced."""
        vehicle = self._vehicle
        if not self.armed:
            return Result.ACCEPTED
        if not vehicle.landed and not force:
            return Result.FAILED
        self.armed = False
        vehicle.plans.rewind()
        vehicle.say(Severity.INFO, vehicle.personality.disarmed_text)
        return Result.ACCEPTED

    def run_checks(self) -> Result:
        """RUN_PREARM_CHECKS."""
        vehicle = self._vehicle
        if vehicle.soft_armed:
            return Result.TEMPORARILY_REJECTED
        for reason in prearm_failures(vehicle):
            vehicle.say(Severity.CRITICAL, f"PreArm: {reason}")
        return Result.ACCEPTED

    def watch(self) -> None:
        """While disarmed, look at the checks once a second; say what fails every half minute."""
        vehicle = self._vehicle
        now_s = vehicle.now_s
        if self.armed or now_s < self._next_check_s:
            return
        self._next_check_s = now_s + CHECK_INTERVAL_S
        reasons = prearm_failures(vehicle)
        self.checks_passed = not reasons
        if not reasons or now_s - self._last_text_s < REPEAT_TEXT_S:
            return
        self._last_text_s = now_s
        for reason in reasons:
            vehicle.say(Severity.CRITICAL, f"PreArm: {reason}")

    def disarm_is_due(self, landed_since_s: float) -> bool:
        """Whether an armed vehicle on the ground is to disarm by itself."""
        vehicle = self._vehicle
        if not self.armed or not vehicle.landed:
            return False
        if vehicle.mode.landing or vehicle.mode.spec.behaviour == "rtl":
            return vehicle.now_s - landed_since_s >= LANDED_TO_DISARM_S
        delay_s = vehicle.parameters["DISARM_DELAY"]
        resting = vehicle.mode.ground_motors() is not Motors.FLY
        idle_s = vehicle.now_s - max(self.armed_at_s, landed_since_s)
        throttle_low = vehicle.radio.throttle(vehicle.now_s) < THROTTLE_LOW
        return delay_s > 0.0 and idle_s >= delay_s and resting and throttle_low
