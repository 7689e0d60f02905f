"""Circling a point: the mode CIRCLE, and LOITER_TURNS on its circle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.exchange import Guidance, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

LEAST_RADIUS_M = 0.1


def circle_rate_rad_s(copter: Commander) -> float:
    """CIRCLE_RATE: how fast it goes round; negative is against the clock."""
    return math.radians(copter.parameters["CIRCLE_RATE"])


def circle_radius_m(copter: Commander) -> float:
    """CIRCLE_RADIUS."""
    return max(copter.parameters["CIRCLE_RADIUS"] / 100.0, LEAST_RADIUS_M)


class Orbit:
    """A circle that is flown with the nose to its centre, as CIRCLE_OPTIONS has it.

    Args:
        centre: NED metres; its height is flown.
        radius_m: of the circle.
        rate_rad_s: clockwise, as far as the limits of speed and acceleration allow.
        angle_rad: where on the circle it begins, from North.
    """

    def __init__(
        self,
        copter: Commander,
        centre: Vector,
        radius_m: float,
        rate_rad_s: float,
        angle_rad: float,
    ) -> None:
        self.turned_rad = 0.0
        self._vehicle = copter
        self._centre = centre
        self._radius_m = max(radius_m, LEAST_RADIUS_M)
        self._rate_rad_s = rate_rad_s
        self._angle_rad = angle_rad
        self.begin()

    def begin(self) -> None:
        """Go round from now on."""
        self._updated_s = self._vehicle.now_s

    def point(self) -> Vector:
        """The target point on the circle, NED metres."""
        north, east, down = self._centre
        return (
            north + self._radius_m * math.cos(self._angle_rad),
            east + self._radius_m * math.sin(self._angle_rad),
            down,
        )

    def go_on(self, hold: Guidance) -> Guidance:
        """Move on along the circle; what the controllers are to do."""
        limits, now_s = self._vehicle.navigator.limits(), self._vehicle.now_s
        possible = min(
            abs(self._rate_rad_s),
            limits.speed_xy_m_s / self._radius_m,
            math.sqrt(limits.acceleration_xy_m_s2 / self._radius_m),
        )
        rate = math.copysign(possible, self._rate_rad_s)
        step = rate * (now_s - self._updated_s)
        self._updated_s = now_s
        self.turned_rad += abs(step)
        self._angle_rad += step
        speed = rate * self._radius_m
        velocity = (-speed * math.sin(self._angle_rad), speed * math.cos(self._angle_rad), 0.0)
        return replace(
            hold.at(self.point()).moving(velocity),
            restart_xy=False,
            restart_z=False,
            yaw_mode=YawMode.ANGLE,
            yaw_rad=self._angle_rad + math.pi,
        )


class Circle(Mode):
    """CIRCLE: round a place that is CIRCLE_RADIUS ahead of the nose. The sticks are centred."""

    def enter(self) -> None:
        """From here on."""
        motion, radius_m = self.vehicle.motion, circle_radius_m(self.vehicle)
        centre = (
            motion.north_m + radius_m * math.cos(motion.yaw_rad),
            motion.east_m + radius_m * math.sin(motion.yaw_rad),
            motion.down_m,
        )
        rate = circle_rate_rad_s(self.vehicle)
        self._orbit = Orbit(self.vehicle, centre, radius_m, rate, motion.yaw_rad + math.pi)
        self.guide(self.hold_guidance())

    def update(self) -> None:
        """Go round."""
        if self.vehicle.armed and not self.vehicle.landed:
            self.guide(self._orbit.go_on(self.hold_guidance()))
        else:
            self._orbit.begin()
