"""The pipeline of planes. Part of `simulation` (the same layer)."""

from __future__ import annotations

from typing import Any

from mavlink_sitl.array_ops import Lane
from mavlink_sitl.autopilot.control import glide_controller
from mavlink_sitl.dynamics import plane
from mavlink_sitl.guidance import GlideGuidance
from mavlink_sitl.physics.traveller_pipeline import TravellerPhysics
from mavlink_sitl.world import sensors

FULL_CURRENT_A = 27.5
"""At full throttle; 14.1 A at half in the recording `plane_guided`"""
TRUE_OVER_INDICATED = 1.06
"""Recorded at home's 584 m: 21.8 m/s shown at 23.2 m/s through still air"""
LEVEL_PITCH_RAD = -0.05
"""How the nose points at cruise: 3 degrees below the path"""


class PlanePhysics(TravellerPhysics):
    """Planes: the same batteries, sensors and views as copters, other bodies and controllers."""

    full_current_a = FULL_CURRENT_A
    guidance_type = GlideGuidance
    targets_of = staticmethod(glide_controller.targets_of)
    at_rest = staticmethod(plane.at_rest)
    law = glide_controller
    gains = glide_controller.GlideGains()
    body_model = plane.PlaneModel()

    def step(self) -> None:
        """Controllers and bodies, a step onwards."""
        self._control, bank, climb, throttle = glide_controller.step(
            self._control, self._told_lanes, self.body.airspeed_m_s, self.dt_s, self.gains, self.o
        )
        command = plane.PlaneCommand(bank, climb, throttle * self.efficiency)
        self.body = plane.step(
            self.body, command, self.wind, self.ground_down_m, self.dt_s, self.body_model, self.o
        )
        self.error = sensors.advance(self.error, self.dt_s)

    def servos(self, index: int) -> tuple[int, ...]:
        """SERVO_OUTPUT_RAW: aileron, elevator, throttle, rudder."""
        roll = self.at(self.body.roll_rate_rad_s, index)
        climb = self.at(self.body.climb_rad, index)
        throttle = self.at(self.body.throttle, index)
        aileron, elevator = 150.0 * roll, 200.0 * climb
        return (
            round(1500 + aileron),
            round(1500 - elevator),
            round(1000 + 1000 * throttle),
            round(1500 + 0.4 * aileron),
        )

    def airspeed_m_s(self, index: int) -> float:
        """The reading of the airspeed sensor."""
        return max(self.at(self.body.airspeed_m_s, index), 0.0) / TRUE_OVER_INDICATED

    def stop_dead(self, index: int) -> None:
        """Stop a vehicle at once: it has hit something."""
        super().stop_dead(index)
        self._zero(index, "airspeed_m_s")

    def _turn_lanes(self, body: Any) -> tuple[Lane, ...]:
        o = self.o
        pitch = o.where(body.on_ground, 0.0, body.climb_rad + LEVEL_PITCH_RAD)
        turn = body.yaw_rate_rad_s * o.cos(pitch)
        pitch_rate, yaw_rate = turn * o.sin(body.bank_rad), turn * o.cos(body.bank_rad)
        return body.bank_rad, pitch, body.yaw_rad, body.roll_rate_rad_s, pitch_rate, yaw_rate


class Px4PlanePhysics(PlanePhysics):
    """Planes of PX4: smaller and slower, as its default airspeeds want them (FW_AIRSPD_*)."""

    gains = PlanePhysics.gains._replace(thrust_m_s2=7.5)
    body_model = plane.PlaneModel(max_thrust_m_s2=7.5, stall_m_s=7.0, rotate_m_s=9.0)
