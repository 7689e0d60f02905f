"""DRIFT: flown with one stick, it turns into its curves and stops when the stick is let go of."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.copter import pilot_input
from mavlink_sitl.autopilot.ardupilot.copter.pilot_modes import STEP_S, Stabilize
from mavlink_sitl.exchange import YawMode

SLIP_DEG = 8.0
"""Lean against sliding sideways, for each m/s; and for braking, once it brakes fully"""
MOST_SLIP_M_S = 5.6
BRAKES_DEG_S = 12.0
"""How fast braking grows: degrees for each m/s, every second"""
SLIDES_M_S = 5.6
"""Sideways, at a full yaw stick"""
SLIDE_TAKES_S = 0.06
LOW, HIGH, ASSIST, MOST_ASSIST = 0.213, 0.787, 0.18, 0.3
"""Of the throttle, between which it damps the climb; for each m/s of it; and no more than that"""
MOST_LEAN_RAD = math.radians(45.0)


class Drift(Stabilize):
    """The roll stick turns, the pitch stick leans; sideways it does not slide.

    The slip that the yaw stick asks for and the growth of the brake are the firmware's, whose
    loop of 400 Hz is replaced by steps of 50 ms.
    """

    def enter(self) -> None:
        """Level."""
        self._brake_deg = self._slide_m_s = 0.0
        super().enter()

    def stands(self, north: float, east: float) -> bool:
        """Never: it leans against its motion."""
        return False

    def leaning(self) -> pilot_input.Lean:
        """The lean of this step, north and east."""
        yaw = self.vehicle.motion.yaw_rad
        forward_m_s, right_m_s = self._over_ground_m_s()
        pitch, roll = self._pitch_rad(forward_m_s), self._roll_rad(right_m_s)
        return pilot_input.turned((-math.tan(pitch), math.tan(roll)), yaw)

    def yawing(self) -> tuple[YawMode, float]:
        """By the roll stick, at ACRO_Y_RATE for a roll of 45 degrees; less when it is fast."""
        copter = self.vehicle
        roll_deg = self._stick("Roll") * math.degrees(pilot_input.lean_limit_rad(copter))
        rate = math.radians(copter.parameters["ACRO_Y_RATE"]) * roll_deg / 45.0
        rate *= 1.0 - min(abs(self._over_ground_m_s()[0]), 20.0) / 50.0
        return (YawMode.RATE if rate else YawMode.HOLD), rate

    def thrust(self) -> float:
        """The stick's, less while it climbs and more while it sinks."""
        throttle = super().thrust()
        climbs_m_s = -self.vehicle.motion.velocity_down_m_s
        if not LOW < throttle < HIGH:
            return throttle
        gain = min(max(1.2 - abs(throttle - 0.5) / 0.24, 0.0), 1.0) * ASSIST
        assist = min(max(-gain * climbs_m_s, -MOST_ASSIST), MOST_ASSIST)
        return min(max(throttle + assist, 0.0), 1.0)

    def _stick(self, axis: str) -> float:
        return self.vehicle.radio.stick(axis, self.vehicle.now_s)

    def _over_ground_m_s(self) -> tuple[float, float]:
        """Forward and to the right."""
        m = self.vehicle.motion
        return pilot_input.turned((m.velocity_north_m_s, m.velocity_east_m_s), -m.yaw_rad)

    def _roll_rad(self, right_m_s: float) -> float:
        """Against sliding sideways, but for what the yaw stick asks for."""
        share = min(STEP_S / SLIDE_TAKES_S, 1.0)
        self._slide_m_s += (SLIDES_M_S * self._stick("Yaw") - self._slide_m_s) * share
        slip = min(max(right_m_s, -MOST_SLIP_M_S), MOST_SLIP_M_S) - self._slide_m_s
        return min(max(math.radians(-SLIP_DEG * slip), -MOST_LEAN_RAD), MOST_LEAN_RAD)

    def _pitch_rad(self, forward_m_s: float) -> float:
        """The stick's; in its middle it brakes."""
        stick = self._stick("Pitch")
        if stick:
            self._brake_deg = 0.0
            return stick * pilot_input.lean_limit_rad(self.vehicle)
        self._brake_deg = min(self._brake_deg + BRAKES_DEG_S * STEP_S, SLIP_DEG)
        speed = min(max(forward_m_s, -MOST_SLIP_M_S), MOST_SLIP_M_S)
        lean = math.radians(speed * self._brake_deg)
        return min(max(lean, -MOST_LEAN_RAD), MOST_LEAN_RAD)
