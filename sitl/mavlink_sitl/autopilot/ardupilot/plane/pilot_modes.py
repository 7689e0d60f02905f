"""The modes of ArduPlane that a pilot flies: with sticks for bank, pitch or climb, and throttle."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import PlaneMode, Point
from mavlink_sitl.exchange import Motors, Vector
from mavlink_sitl.guidance import GlideGuidance

SLOWEST_M_S = 5.0
"""The pitch commands at least what it would at this airspeed"""
FAR_M = 100_000.0
"""A course is a line to a point so far away"""


class Stick(PlaneMode):
    """MANUAL, STABILIZE, ACRO and FBWA: the pilot's bank, pitch and throttle."""

    def ground_motors(self) -> Motors:
        """The pilot's throttle counts on the ground, too."""
        return Motors.MANUAL

    def pitch_rad(self, pitch: float) -> float:
        """The pitch that the stick asks for: up to PTCH_LIM_MAX_DEG, down to PTCH_LIM_MIN_DEG."""
        p = self.vehicle.parameters
        limit = p["PTCH_LIM_MAX_DEG"] if pitch > 0.0 else -p["PTCH_LIM_MIN_DEG"]
        return math.radians(min(max(pitch * limit, -80.0), 80.0))

    def update(self) -> None:
        """Follow the sticks."""
        plane = self.vehicle
        roll, pitch, throttle = plane.sticks()
        airspeed = max(plane.airspeed_m_s * plane.true_over_indicated, SLOWEST_M_S)
        self.guide(
            GlideGuidance(
                motors=Motors.MANUAL,
                throttle=throttle,
                bank_rad=roll * self.bank_limit_rad(),
                climb_m_s=math.sin(self.pitch_rad(pitch)) * airspeed,
            )
        )


class HoldHeight(PlaneMode):
    """FBWB: the throttle stick asks for an airspeed, the others bank and climb."""

    def enter(self) -> None:
        """Keep the height."""
        self._down_m = self.vehicle.motion.down_m
        self._climbing = 0.0
        self.begin_level()
        self.update()

    def update(self) -> None:
        """Follow the sticks."""
        p = self.vehicle.parameters
        roll, pitch, throttle = self.vehicle.sticks()
        if p["FBWB_ELEV_REV"]:
            pitch = -pitch
        if self._climbing and self._climbing * pitch <= 0.0:
            self._down_m = self.vehicle.motion.down_m  # let go of it keeps the height it has
        self._climbing = pitch
        climb = p["FBWB_CLIMB_RATE"] * pitch
        climb = min(max(climb, -max(p["TECS_SINK_MAX"], 0.0)), max(p["TECS_CLMB_MAX"], 0.0))
        self._down_m -= climb * self.vehicle.step_s
        airspeed = p["AIRSPEED_MIN"] + throttle * (p["AIRSPEED_MAX"] - p["AIRSPEED_MIN"])
        self.fly(self.bank(roll), self.climb_to(self._down_m), airspeed_m_s=airspeed)

    def bank(self, roll: float) -> float:
        """The bank that the stick asks for."""
        return roll * self.bank_limit_rad()


class Cruise(HoldHeight):
    """CRUISE: with the stick centred, the course over ground is kept, whatever the wind."""

    def enter(self) -> None:
        """Keep the course, too."""
        self._locked: tuple[Point, Vector] | None = None
        super().enter()

    def bank(self, roll: float) -> float:
        """Along the course, or as the stick says."""
        m = self.vehicle.motion
        if roll:
            self._locked = None
            return super().bank(roll)
        if self._locked is None:
            course = math.atan2(m.velocity_east_m_s, m.velocity_north_m_s)
            far = (FAR_M * math.cos(course), FAR_M * math.sin(course))
            here = (m.north_m, m.east_m)
            self._locked = here, (here[0] + far[0], here[1] + far[1], m.down_m)
        return self.bank_along(*self._locked)
