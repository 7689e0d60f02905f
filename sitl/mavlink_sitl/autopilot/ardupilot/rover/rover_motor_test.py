"""DO_MOTOR_TEST of a rover or boat: it arms, and throttle or steering get what is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.motor_test import PERCENT, PILOT, PULSE
from mavlink_sitl.exchange import Motors, Result, Severity
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

THROTTLE, STEERING, LAST = 1, 2, 4
"""MOTOR_TEST: these move; the wheels of a skid-steered one are not there"""
LONGEST_S = 30.0
HIGHEST_US = 2200.0


class RoverMotorTest:
    """One vehicle's motor test."""

    def __init__(self, rover: Rover) -> None:
        self._vehicle = rover
        self.running = False
        self._motor, self._share, self._kind = 0, 0.0, PERCENT
        self._until_s = 0.0
        self._wanted = rover.wanted
        """The guidance of its mode, to resume after the test"""

    def start(self, motor: int, kind: int, value: float, seconds: float) -> Result:
        """Start it, or change the one under way.

        Args:
            motor: throttle (1) or steering (2).
            kind: MOTOR_TEST_THROTTLE_TYPE.
            value: percent or microseconds, as `kind` says.
            seconds: for how long.
        """
        rover = self._vehicle
        if not self.running:
            fault = self._fault(motor, kind, value)
            if fault is not None:
                rover.say(Severity.CRITICAL, f"Motor Test: {fault}")
                return Result.FAILED
            if not rover.armed and rover.arm() is not Result.ACCEPTED:
                return Result.FAILED
            self.running = True
            self._wanted = rover.wanted
        self._motor, self._kind = motor, kind
        self._share = (value - 1500.0) / 500.0 if kind == PULSE else value / 100.0
        self._until_s = rover.now_s + min(seconds, LONGEST_S)
        return Result.ACCEPTED

    @staticmethod
    def _fault(motor: int, kind: int, value: float) -> str | None:
        if not 0 <= motor <= LAST:
            return f"invalid motor ({motor})"
        if not PERCENT <= kind <= PILOT:
            return f"invalid throttle type: {kind}"
        if kind == PULSE and value > HIGHEST_US:
            return f"pwm ({int(value)}) too high"
        if kind == PERCENT and value > 100.0:
            return f"percentage ({int(value)}) too high"
        return None

    def update(self) -> None:
        """Move, or end."""
        if not self.running:
            return
        rover = self._vehicle
        if rover.now_s >= self._until_s or self._motor not in (THROTTLE, STEERING):
            self.running = False
            rover.guide(self._wanted)
            rover.disarm(force=True)
            return
        steering, throttle = rover.sticks()
        share = min(max(self._share, -1.0), 1.0)
        if self._kind == PILOT:
            share = steering if self._motor == STEERING else throttle
        rover.guide(
            DriveGuidance(
                motors=Motors.MANUAL,
                throttle=share if self._motor == THROTTLE else 0.0,
                steering=share if self._motor == STEERING else 0.0,
            )
        )
