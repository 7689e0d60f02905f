"""The modes of PX4's rovers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.mode import (
    HoldMode,
    OffboardMode,
    Px4Mode,
    TakeoffMode,
    given,
)
from mavlink_sitl.autopilot.px4.rover.pursuit import PurePursuit
from mavlink_sitl.autopilot.px4.safe_points import (
    destination_ned_m,
    return_down_m,
    return_text,
)
from mavlink_sitl.exchange import Motors, Severity, Vector, YawMode
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.rover.rover import Px4Rover
    from mavlink_sitl.geodesy import GeoPoint

STICK_DEADZONE = 0.1
"""RO_YAW_STICK_DZ"""


class DriveMode(Px4Mode):
    """A mode of one rover or boat.

    Attributes:
        way: where it is driving by itself, or None.
    """

    vehicle: Px4Rover
    way: PurePursuit | None = None

    def ground_motors(self) -> Motors:
        """Standing is no reason to stop the motor."""
        return Motors.FLY

    def hold_guidance(self) -> DriveGuidance:
        """Brake."""
        return self.vehicle.drive_guidance(0.0, None)

    def stop(self) -> None:
        """Brake."""
        self.way = None
        self.drive(self.hold_guidance())

    def update(self) -> None:
        """Run one step along the path."""
        if self.way is not None and self.vehicle.armed:
            self.drive(self.way.follow())


class Hold(DriveMode, HoldMode):
    """AUTO.LOITER: back to where it was chosen, and stay; or where DO_REPOSITION says."""

    def enter(self) -> None:
        """Brake; the place to keep is the one where this is, once armed."""
        self.stop()

    def update(self) -> None:
        """Keep the place."""
        if not self.vehicle.armed:
            self.way = None
        elif self.way is None:
            self.way = PurePursuit(self.vehicle, self.level(), self.level())
        super().update()

    def go_to(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, yaw_rad: float | None
    ) -> None:
        """Go somewhere; the height and the yaw mean nothing."""
        if point is not None:
            self.stay_at(self.vehicle.navigator.place_ned_m(point))

    def stay_at(self, target: Vector) -> None:
        """Go to a place and stay there."""
        self.way = PurePursuit(self.vehicle, target[:2], self.level())


class Takeoff(DriveMode, TakeoffMode):
    """AUTO.TAKEOFF: done as soon as it is armed, then AUTO.LOITER."""

    def enter(self) -> None:
        """Stand."""
        self.wanted_amsl_m = None
        self.stop()

    def update(self) -> None:
        """Reached where it stands."""
        if self.vehicle.in_flight:
            self.vehicle.hold_at(self.here())


class Land(DriveMode):
    """AUTO.LAND: it has landed, says the land detector, so it disarms."""

    landing = True
    at_rest = True

    def enter(self) -> None:
        """Stop."""
        self.stop()


class Return(DriveMode):
    """AUTO.RTL: straight home, or where RTL_TYPE says; there it has landed and disarms."""

    way: PurePursuit
    landing = True
    """All the way: home is a landing setpoint from the beginning"""

    @property
    def at_rest(self) -> bool:
        """Within NAV_ACC_RAD of home."""
        return self.way.distance_m < self.vehicle.accept_m()

    def enter(self) -> None:
        """Set off."""
        rover = self.vehicle
        place = destination_ned_m(rover)
        self.way = PurePursuit(rover, place[:2], self.level())
        if not rover.armed:
            return
        rover.say(Severity.INFO, "RTL: land at destination")
        rover.say(Severity.INFO, return_text(rover, return_down_m(rover, place), place))


class Manual(DriveMode):
    """MANUAL: sticks straight to motor and steering."""

    def sticks(self) -> tuple[float, float]:
        """Throttle and steering, -1..1; centred when nobody holds them."""
        sticks = self.vehicle.sticks.held()
        if sticks is None:
            return 0.0, 0.0
        return 2.0 * sticks.throttle - 1.0, sticks.roll

    def update(self) -> None:
        """Follow the sticks."""
        throttle, steering = self.sticks()
        self.drive(DriveGuidance(motors=Motors.MANUAL, throttle=throttle, steering=steering))


class Position(Manual):
    """POSCTL: the sticks ask for a speed and a rate of turn; without one the course is kept."""

    def enter(self) -> None:
        """Take the sticks."""
        self._course_rad: float | None = None
        super().enter()

    def update(self) -> None:
        """Follow the sticks."""
        rover = self.vehicle
        throttle, turn = self.sticks()
        speed = throttle * rover.navigator.cruise_m_s()
        if abs(turn) < STICK_DEADZONE and speed != 0.0:
            if self._course_rad is None:
                self._course_rad = rover.motion.yaw_rad
            self.drive(rover.drive_guidance(speed, self._course_rad))
            return
        self._course_rad = None
        rate = math.copysign(rover.yaw_rate_limit_rad_s() * turn, throttle * turn)
        self.drive(
            replace(rover.drive_guidance(speed, None), yaw_mode=YawMode.RATE, yaw_rate_rad_s=rate)
        )


class Offboard(DriveMode, OffboardMode):
    """OFFBOARD: a place, or else a velocity; height, yaw and accelerations mean nothing.

    A place is driven to straight and stood at within NAV_ACC_RAD. A velocity is a course and a
    speed, always forwards. A setpoint with neither moves nothing.
    """

    def follow(self, fresh: bool) -> None:
        """See `OffboardMode`."""
        setpoint = self.target
        place, velocity = setpoint.position_m, setpoint.velocity_m_s
        self.way = None
        if place is not None:
            if given(place)[0]:
                self.way = PurePursuit(self.vehicle, place[:2])
                self.update()
            else:
                self.stop()
        elif velocity is not None and given(velocity)[0]:
            speed = math.hypot(velocity[0], velocity[1])
            speed = min(speed, self.vehicle.navigator.cruise_m_s())
            course = math.atan2(velocity[1], velocity[0])
            self.drive(self.vehicle.drive_guidance(speed, course))
        else:
            self.stop()
