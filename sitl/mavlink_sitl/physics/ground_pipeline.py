"""The pipelines of rovers and boats. Part of `simulation` (the same layer)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from mavlink_sitl.autopilot.control import drive_controller
from mavlink_sitl.autopilot.px4.rover import drive_law
from mavlink_sitl.dynamics import boat, rover, sih_rover
from mavlink_sitl.guidance import DriveGuidance
from mavlink_sitl.lanes import Lane
from mavlink_sitl.physics.copter_pipeline import DT_S
from mavlink_sitl.physics.traveller_pipeline import ToldPhysics
from mavlink_sitl.world import sensors

FULL_CURRENT_A = 50.0
"""At full throttle; 13 A at a quarter in the recording `rover_guided`"""


class RoverPhysics(ToldPhysics):
    """Rovers: the same batteries, sensors and views as copters, other bodies and controllers."""

    flies = False
    full_current_a = FULL_CURRENT_A
    guidance_type = DriveGuidance
    targets_of = staticmethod(drive_controller.targets_of)
    at_rest = staticmethod(rover.at_rest)
    drive_law: Any = drive_controller
    drive_gains: Any = drive_controller.DriveGains()

    def _model(self) -> Any:
        return rover.RoverModel()

    def _controller(self) -> Any:
        return self.drive_law.initial(self.o)

    def step(self) -> None:
        """Controllers and bodies, DT_S onwards."""
        body = self.body
        moves = drive_controller.DriveBody(body.forward_m_s, body.yaw_rad, body.yaw_rate_rad_s)
        self._control, throttle, steering = self.drive_law.step(
            self._control, self._told_lanes, moves, DT_S, self.drive_gains, self.o
        )
        self.body = self._move(rover.GroundCommand(throttle * self.efficiency, steering))
        self.error = sensors.advance(self.error, DT_S)

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return rover.step(self.body, command, self.ground_down_m, DT_S, self.body_model, self.o)

    def servos(self, index: int) -> tuple[int, ...]:
        """SERVO_OUTPUT_RAW: steering on 1, throttle on 3."""
        steering = self.at(self.body.steering, index)
        throttle = self.at(self.body.throttle, index)
        return round(1500 + 500 * steering), 0, round(1500 + 500 * throttle), 0

    def stop_dead(self, index: int) -> None:
        """Stop a vehicle at once: it has hit something."""
        super().stop_dead(index)
        for name in ("forward_m_s", "right_m_s"):
            lane = self.with_value(getattr(self.body, name), index, 0.0)
            self.body = self.body._replace(**{name: lane})
        self.guide(index, replace(self._told[index], speed_m_s=0.0))

    def _turn_lanes(self, body: Any) -> tuple[Lane, ...]:
        zero = self.o.full(0.0)
        return (zero, zero, body.yaw_rad, zero, zero, body.yaw_rate_rad_s)


class BoatPhysics(RoverPhysics):
    """Boats: rovers that drift.

    A hull has a fifth of a car's thrust, so a car's ATC_SPEED_P would let it run half as fast
    again as it is told. ArduRover's law is the same; these are gains as its tuning finds them
    for this hull: P up to where the speed follows, I well below P.
    """

    drive_gains = drive_controller.DriveGains(
        feed_forward_s_m=0.12,
        speed=0.6,
        speed_i=0.1,
        turn_rate_rad_s=boat.BoatModel().turn_rate_rad_s,
    )

    def _model(self) -> Any:
        return boat.BoatModel()

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return boat.step(
            self.body, command, self.wind, self.ground_down_m, DT_S, self.body_model, self.o
        )


class Px4RoverPhysics(RoverPhysics):
    """Rovers of PX4: the car of its own simulator, by its own law."""

    drive_law = drive_law
    drive_gains = drive_law.DriveLaw()

    def _model(self) -> Any:
        return sih_rover.SihRoverModel()

    def _move(self, command: rover.GroundCommand) -> rover.GroundState:
        return sih_rover.step(self.body, command, self.ground_down_m, DT_S, self.body_model, self.o)


class Px4BoatPhysics(BoatPhysics):
    """Boats of PX4, which has no law for them: mostly feed-forward, as with its rovers."""

    drive_gains = BoatPhysics.drive_gains._replace(speed=1.0, speed_i=0.05)
