"""The common base of the flight modes of PX4, for all vehicle types."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame, turned
from mavlink_sitl.exchange import ZERO, Motors, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
    from mavlink_sitl.geodesy import GeoPoint


class Px4Mode(Mode):
    """A flight mode of one vehicle."""

    vehicle: Px4Vehicle

    def wants_to_lift(self) -> bool:
        """Whether it would leave the ground."""
        return False

    def ground_motors(self) -> Motors:
        """Idle, until the ramp of a take-off lifts."""
        return Motors.FLY if self.vehicle.arming.may_lift() else Motors.IDLE

    def here(self) -> Vector:
        """The estimated position of the vehicle."""
        motion = self.vehicle.motion
        return motion.north_m, motion.east_m, motion.down_m

    def level(self) -> tuple[float, float]:
        """The same, north and east."""
        return self.vehicle.motion[:2]


class HoldMode(Px4Mode):
    """AUTO.LOITER: stays, or goes where DO_REPOSITION says.

    Attributes:
        target: the position to stay at, NED metres.
    """

    target: Vector | None = None

    def go_to(
        self, point: GeoPoint | None, altitude_amsl_m: float | None, yaw_rad: float | None
    ) -> None:
        """Go somewhere; None keeps what is."""
        raise NotImplementedError

    def other_target(self, point: GeoPoint | None, altitude_amsl_m: float | None) -> Vector:
        """The target with another place or height; None keeps what is."""
        navigator = self.vehicle.navigator
        north, east, down = self.target or self.here()
        if point is not None:
            north, east, _ = navigator.place_ned_m(point)
        if altitude_amsl_m is not None:
            down = navigator.down_of_amsl(altitude_amsl_m)
        return north, east, down

    def stay_at(self, target: Vector) -> None:
        """Stay at a place nearby, NED metres."""
        self.target = target

    def limits_changed(self) -> None:
        """Another speed: continue with it."""


class TakeoffMode(Px4Mode):
    """AUTO.TAKEOFF.

    Attributes:
        wanted_amsl_m: what NAV_TAKEOFF asked for, or None for MIS_TAKEOFF_ALT above home.
    """

    wanted_amsl_m: float | None = None
    taking_off = True


class OffboardMode(Px4Mode):
    """Follows the stream of setpoints; NaN components (None here) are left to the loops.

    Attributes:
        target: the latest usable setpoint, in LOCAL.
    """

    def __init__(self, vehicle: Px4Vehicle, spec: ModeSpec) -> None:
        super().__init__(vehicle, spec)
        self.target = Setpoint(SetpointFrame.LOCAL, velocity_m_s=ZERO)
        self._fresh = True

    def follow(self, fresh: bool) -> None:
        """Do what the setpoint in force says."""
        raise NotImplementedError

    def stop(self) -> None:
        """Nobody says anything: stop."""
        raise NotImplementedError

    def enter(self) -> None:
        """Follow the latest setpoint; without one, stop."""
        self._fresh = True
        if self.vehicle.stream_alive():
            self._follow()
        else:
            self.stop()

    def _follow(self) -> None:
        fresh, self._fresh = self._fresh, False
        self.follow(fresh)

    def take(self, setpoint: Setpoint) -> None:
        """A new setpoint, in LOCAL or BODY (velocity only)."""
        velocity = setpoint.velocity_m_s
        if setpoint.frame is SetpointFrame.BODY:
            velocity = velocity and turned(velocity, self.vehicle.motion.yaw_rad)
            setpoint = replace(
                setpoint, frame=SetpointFrame.LOCAL, position_m=None, velocity_m_s=velocity
            )
        same = setpoint == self.target and not self._fresh
        self.target = setpoint
        if self.vehicle.mode is self and not same:
            self._follow()


def given(vector: Vector | None) -> tuple[bool, bool]:
    """Whether North and East, and whether down, are asked for."""
    if vector is None:
        return False, False
    return not (math.isnan(vector[0]) or math.isnan(vector[1])), not math.isnan(vector[2])


def zeros(vector: Vector | None) -> Vector:
    """The vector with zeros for what is not asked for."""
    level, upright = given(vector)
    north, east, down = vector or ZERO
    return (north if level else 0.0, east if level else 0.0, down if upright else 0.0)
