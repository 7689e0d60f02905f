"""The checks before arming. Each gives its reason in the firmware's words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.copter import Copter

CHECK_INTERVAL_S = 1.0
REPEAT_TEXT_S = 30.0

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


def prearm_failures(copter: Copter) -> list[str]:
    """Why the vehicle would refuse to arm; empty when it would not."""
    reasons = []
    spec = copter.mode.spec
    if not copter.started:
        return list(NOT_STARTED)
    if spec.requires_position:
        if not copter.estimator.has_origin:
            reasons.append("AHRS: waiting for home")
        if not copter.estimator.gps_fix:
            reasons.append("GPS 1: Bad fix")
        if not copter.estimator.position_ok:
            reasons.append("Need Position Estimate")
    if spec.behaviour == "auto":
        reasons.append("Mode requires mission")
    reasons += copter.failsafe.battery_reasons()
    return reasons


class PrearmMonitor:
    """Runs the checks once a second while disarmed, and says what fails every half minute."""

    def __init__(self, boot_s: float) -> None:
        """Start counting at power-up."""
        self.passed = False
        self._next_check_s = boot_s
        self._last_text_s = boot_s

    def update(self, copter: Copter, now_s: float) -> list[str]:
        """Look, if it is time; the texts to send."""
        if copter.armed or now_s < self._next_check_s:
            return []
        self._next_check_s = now_s + CHECK_INTERVAL_S
        reasons = prearm_failures(copter)
        self.passed = not reasons
        if not reasons or now_s - self._last_text_s < REPEAT_TEXT_S:
            return []
        self._last_text_s = now_s
        return [f"PreArm: {reason}" for reason in reasons]
