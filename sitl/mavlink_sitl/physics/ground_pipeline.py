"""The pipelines of rovers and boats. Part of `simulation` (the same layer)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from mavlink_sitl.array_ops import Lane
from mavlink_sitl.autopilot.control import drive_controller
from mavlink_sitl.autopilot.px4.rover import drive_law
from mavlink_sitl.dynamics import boat, rover, sih_rover
from mavlink_sitl.exchange import Vector
from mavlink_sitl.guidance import DriveGuidance
from mavlink_sitl.physics.traveller_pipeline import TravellerPhysics
from mavlink_sitl.world import sensors

FULL_CURRENT_A = 50.0
"""At full throttle; 13 A at a quarter in the recording `rover_guided`"""


class RoverPhysics(TravellerPhysics):
    """Rovers: the same batteries, sensors and views as copters, other bodies and controllers."""

    flies = False
    full_current_a = FULL_CURRENT_A
    guidance_type = DriveGuidance
    targets_of = staticmethod(drive_controller.targets_of)
    at_rest = staticmethod(rover.at_rest)
    law: Any = drive_controller
    gains: Any = drive_controller.DriveGains()
    body_model: Any = rover.RoverModel()

    def step(self) -> None:
        """Controllers and bodies, a step onwards."""
        body = self.body
        moves = drive_controller.DriveBody(body.forward_m_s, body.yaw_rad, body.yaw_rate_rad_s)
        self._control, throttle, steering = self.law.step(
            self._control, self._told_lanes, moves, self.dt_s, self.gains, self.o
        )
        self.body = self._move(rover.GroundCommand(throttle * self.efficiency, steering))
        self.error = sensors.advance(self.error, self.dt_s)

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return rover.step(
            self.body, command, self.ground_down_m, self.dt_s, self.body_model, self.o
        )

    def servos(self, index: int) -> tuple[int, ...]:
        """SERVO_OUTPUT_RAW: steering on 1, throttle on 3."""
        steering = self.at(self.body.steering, index)
        throttle = self.at(self.body.throttle, index)
        return round(1500 + 500 * steering), 0, round(1500 + 500 * throttle), 0

    def put(self, index: int, place_ned_m: Vector, velocity_ned_m_s: Vector) -> None:
        """Put a vehicle somewhere, rolling along its nose."""
        super().put(index, place_ned_m, velocity_ned_m_s)
        yaw_rad = self.at(self.body.yaw_rad, index)
        forward = velocity_ned_m_s[0] * math.cos(yaw_rad) + velocity_ned_m_s[1] * math.sin(yaw_rad)
        lane = self.with_value(self.body.forward_m_s, index, forward)
        self.body = self.body._replace(forward_m_s=lane)

    def stop_dead(self, index: int) -> None:
        """Stop a vehicle at once: it has hit something."""
        super().stop_dead(index)
        self._zero(index, "forward_m_s", "right_m_s")
        self.guide(index, replace(self._told[index], speed_m_s=0.0))

    def _turn_lanes(self, body: Any) -> tuple[Lane, ...]:
        zero = self.o.full(0.0)
        return (zero, zero, body.yaw_rad, zero, zero, body.yaw_rate_rad_s)


class BoatPhysics(RoverPhysics):
    """Boats: rovers that drift.

    A hull has a fifth of a car's thrust, so a car's ATC_SPEED_P would let it run at one and a
    half times the speed setpoint. ArduRover's law is the same; these are gains as its tuning
    finds them for this hull: P up to where the speed follows, I well below P.
    """

    body_model: Any = boat.BoatModel()
    gains = drive_controller.DriveGains(
        feed_forward_s_m=0.12,
        speed=0.6,
        speed_i=0.1,
        turn_rate_rad_s=body_model.turn_rate_rad_s,
    )

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return boat.step(
            self.body, command, self.wind, self.ground_down_m, self.dt_s, self.body_model, self.o
        )


class Px4RoverPhysics(RoverPhysics):
    """Rovers of PX4: the car of its own simulator, by its own law."""

    law = drive_law
    gains = drive_law.DriveLaw()
    body_model = sih_rover.SihRoverModel()

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return sih_rover.step(
            self.body, command, self.ground_down_m, self.dt_s, self.body_model, self.o
        )


class Px4BoatPhysics(BoatPhysics):
    """Boats of PX4, which has no law for them: mostly feed-forward, as with its rovers."""

    gains = BoatPhysics.gains._replace(speed=1.0, speed_i=0.05)
