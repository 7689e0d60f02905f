"""The pipelines of rovers, boats and planes. Part of `simulation` (the same layer)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

from mavlink_sitl.array_ops import Lane, ops_for
from mavlink_sitl.autopilot.control import drive_controller, glide_controller
from mavlink_sitl.autopilot.px4.rover import drive_law
from mavlink_sitl.dynamics import battery, boat, plane, rover, sih_rover
from mavlink_sitl.exchange import Guidance, Vector
from mavlink_sitl.guidance import DriveGuidance, GlideGuidance
from mavlink_sitl.physics.copter_pipeline import Physics, PhysicsStart
from mavlink_sitl.world import sensors


class TravellerPhysics(Physics):
    """`Physics` of bodies with one motor, whose controllers follow a guidance of their own.

    Attributes:
        full_current_a: what the motor draws at full throttle.
        guidance_type: the guidance, which begins with doing nothing.
        targets_of: makes lanes of it.
        law: the module of the controllers, with `initial` and `step`.
    """

    full_current_a: ClassVar[float]
    guidance_type: ClassVar[type[Guidance]]
    targets_of: ClassVar[Callable[..., Any]]
    law: Any

    def __init__(self, start: PhysicsStart) -> None:
        super().__init__(start)
        self._guidance: list[Any] = [self.guidance_type() for _ in range(self.count)]
        self._guidance_lanes = self.targets_of(self._guidance, self.o)
        self._control: Any = self.law.initial(self.o)

    def step_batteries(self, dt: float) -> None:
        """Draw current for dt seconds: in proportion to the throttle."""
        current = self.full_current_a * abs(self.body.throttle)
        load = (current / self.pack.hover_current_a) ** (1.0 / self.pack.current_exponent)
        self.battery = battery.step(self.battery, load, dt, self.pack, self.o)

    def guide(self, index: int, guidance: Guidance) -> None:
        """Give a vehicle's controllers new guidance."""
        if not isinstance(guidance, self.guidance_type):
            guidance = self.guidance_type(motors=guidance.motors)  # a firmware that shuts down
        self._guidance[index] = guidance
        if self.count == 1:
            self._guidance_lanes = self.targets_of(self._guidance, self.o)
            return
        one = self.targets_of([guidance], ops_for(1))
        for lane, value in zip(self._guidance_lanes, one, strict=True):
            lane[index] = value

    def moving_target(self, index: int) -> Vector:
        """The destination of a vehicle."""
        guidance = self._guidance[index]
        return guidance.north_m, guidance.east_m, guidance.down_m


class RoverPhysics(TravellerPhysics):
    """Rovers: the same batteries, sensors and views as copters, other bodies and controllers."""

    flies = False
    full_current_a = 50.0
    """At full throttle; 13 A at a quarter in the recording `rover_guided`"""
    guidance_type = DriveGuidance
    targets_of = staticmethod(drive_controller.targets_of)
    state = rover.GroundState
    law: Any = drive_controller
    gains: Any = drive_controller.DriveGains()
    body_model: Any = rover.RoverModel()

    def step(self) -> None:
        """Controllers and bodies, a step onwards."""
        body = self.body
        moves = drive_controller.DriveBody(body.forward_m_s, body.yaw_rad, body.yaw_rate_rad_s)
        self._control, throttle, steering = self.law.step(
            self._control, self._guidance_lanes, moves, self.dt_s, self.gains, self.o
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
        self.guide(index, replace(self._guidance[index], speed_m_s=0.0))

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


TRUE_OVER_INDICATED = 1.06
"""Recorded at home's 584 m: 21.8 m/s shown at 23.2 m/s through still air"""
LEVEL_PITCH_RAD = -0.05
"""How the nose points at cruise: 3 degrees below the path"""


class PlanePhysics(TravellerPhysics):
    """Planes: the same batteries, sensors and views as copters, other bodies and controllers."""

    full_current_a = 27.5
    """At full throttle; 14.1 A at half in the recording `plane_guided`"""
    guidance_type = GlideGuidance
    targets_of = staticmethod(glide_controller.targets_of)
    state = plane.PlaneState
    law = glide_controller
    gains = glide_controller.GlideGains()
    body_model = plane.PlaneModel()

    def step(self) -> None:
        """Controllers and bodies, a step onwards."""
        self._control, bank, climb, throttle = glide_controller.step(
            self._control,
            self._guidance_lanes,
            self.body.airspeed_m_s,
            self.dt_s,
            self.gains,
            self.o,
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
