"""DO_MOTOR_TEST: turns one motor after another on the ground. Recorded in `copter_acks`.

While it runs the vehicle counts as armed for HEARTBEAT and for what wants it disarmed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

PERCENT, PULSE, PILOT = 0, 1, 2
"""MOTOR_TEST_THROTTLE_TYPE"""
OUTPUT_OF_PLACE = (1, 4, 2, 3)
"""Outputs of a quadrotor's motors, clockwise from the front right one: the order of the test"""
LONGEST_S = 600.0
REST = 0.5
"""Between two motors, as a share of the time of one"""
LOWEST_US, HIGHEST_US = 800.0, 2200.0
IDLE_US, FULL_US = 1000.0, 2000.0


class MotorTest:
    """One vehicle's motor test."""

    def __init__(self, copter: Commander) -> None:
        self._vehicle = copter
        self.running = False
        self._place = self._left = 0
        self._kind = PULSE
        self._value = self._began_s = self._each_s = 0.0

    def start(self, place: int, kind: int, value: float, each_s: float, count: int) -> Result:
        """Start it, or change the one under way.

        Args:
            place: the first motor, from 1, clockwise from the front right.
            kind: MOTOR_TEST_THROTTLE_TYPE.
            value: percent or microseconds, as `kind` says.
            each_s: for how long.
            count: how many motors, one after the other.
        """
        copter = self._vehicle
        if not self.running:
            if not copter.landed:
                copter.say(Severity.CRITICAL, "Motor Test: vehicle not landed")
                return Result.FAILED
            copter.say(Severity.INFO, "starting motor test")
        self.running = True
        self._place, self._kind, self._value = place, kind, value
        self._left = max(count, 1)
        self._each_s = min(each_s, LONGEST_S)
        self._began_s = copter.now_s
        return Result.ACCEPTED

    def _pulse_us(self) -> float:
        if self._kind == PERCENT and self._value <= 100.0:
            return IDLE_US + (FULL_US - IDLE_US) * self._value / 100.0
        if self._kind == PILOT:
            return IDLE_US + (FULL_US - IDLE_US) * self._vehicle.radio.range(
                "Throttle", self._vehicle.now_s
            )
        return self._value if self._kind == PULSE else 0.0

    def outputs_us(self) -> list[int]:
        """The outputs to the four motors."""
        outputs = [round(IDLE_US)] * len(OUTPUT_OF_PLACE)
        resting = self._vehicle.now_s - self._began_s >= self._each_s
        if not resting and 1 <= self._place <= len(OUTPUT_OF_PLACE):
            outputs[OUTPUT_OF_PLACE[self._place - 1] - 1] = round(self._pulse_us())
        return outputs

    def update(self) -> None:
        """Advance to the next motor, or end."""
        if not self.running:
            return
        gone_s = self._vehicle.now_s - self._began_s
        possible = LOWEST_US <= self._pulse_us() <= HIGHEST_US
        if possible and gone_s < self._each_s * (1.0 + REST * (self._left > 1)):
            return
        if possible and self._left > 1:
            self._place, self._left = self._place + 1, self._left - 1
            self._began_s = self._vehicle.now_s
            return
        self.running = False
        self._vehicle.say(Severity.INFO, "finished motor test")
        if self._vehicle.armed:
            self._vehicle.disarm(force=True)
