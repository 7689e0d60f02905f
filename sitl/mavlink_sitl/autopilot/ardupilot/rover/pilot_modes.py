"""The modes of ArduRover that a pilot drives: MANUAL, ACRO and STEERING."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import DriveMode
from mavlink_sitl.exchange import Motors, YawMode
from mavlink_sitl.guidance import DriveGuidance

GRAVITY_M_S2 = 9.81
LEAST_SHARE, FASTEST_M_S = 0.05, 30.0
"""Least share of CRUISE_THROTTLE that the full speed is derived from; limit of that speed"""
LEAST_SIDEWAYS_M_S2 = 0.1
LEAST_SPEED_M_S = 0.3
"""Below it a turn is not taken for one on a circle"""


class PilotMode(DriveMode):
    """A mode that follows the sticks."""

    def steering(self) -> tuple[float, float]:
        """Steering and throttle, -1..1; going backwards a stick to the right turns left."""
        steering, throttle = self.vehicle.sticks()
        return (-steering if throttle < 0.0 else steering), throttle

    def full_speed_m_s(self) -> float:
        """The speed of a full stick: SPEED_MAX, or what CRUISE_SPEED and its throttle promise."""
        p = self.vehicle.parameters
        share = p["CRUISE_THROTTLE"] / 100.0
        speed = p["CRUISE_SPEED"]
        if LEAST_SHARE < share <= 1.0:
            speed = p["SPEED_MAX"] or speed / share
        return min(max(speed, 0.0), FASTEST_M_S)

    def turn(self, speed_m_s: float, rate_rad_s: float) -> None:
        """Drive and turn."""
        self.drive(
            DriveGuidance(
                motors=Motors.FLY,
                speed_m_s=speed_m_s,
                yaw_mode=YawMode.RATE,
                yaw_rate_rad_s=rate_rad_s,
                limits=self.vehicle.navigator.limits(),
            )
        )


class Manual(PilotMode):
    """Sticks straight to motor and steering."""

    def update(self) -> None:
        """Follow the sticks: the wheels go where the stick is, whatever the throttle."""
        steering, throttle = self.vehicle.sticks()
        self.drive(DriveGuidance(motors=Motors.MANUAL, throttle=throttle, steering=steering))


class Acro(PilotMode):
    """The sticks ask for a speed and a rate of turn."""

    def update(self) -> None:
        """Follow the sticks."""
        steering, throttle = self.steering()
        rate = math.radians(self.vehicle.parameters["ACRO_TURN_RATE"])
        limit = math.radians(self.vehicle.parameters["ATC_STR_RAT_MAX"]) or rate
        wanted = min(max(steering * rate, -limit), limit)
        self.turn(throttle * self.full_speed_m_s(), wanted)


class Steering(PilotMode):
    """The sticks ask for a speed and an acceleration sideways: a circle for each stick."""

    def update(self) -> None:
        """Follow the sticks."""
        rover, p = self.vehicle, self.vehicle.parameters
        steering, throttle = self.steering()
        m = rover.motion
        most = p["ATC_TURN_MAX_G"] * GRAVITY_M_S2
        sideways = m.speed_m_s**2 / max(p["TURN_RADIUS"], 0.1)
        sideways = min(max(sideways, LEAST_SIDEWAYS_M_S2), max(most, LEAST_SIDEWAYS_M_S2))
        rate = steering * sideways / max(m.speed_m_s, LEAST_SPEED_M_S)
        self.turn(throttle * self.full_speed_m_s(), rate)
