"""The path of a rover or boat to a point: a moving reference on a straight line.

The reference keeps the limits of speed, acceleration and jerk; the vehicle follows it by
steering towards the reference's velocity plus a share of its own distance from it (PSC_POS_P).
So it cuts back onto the line slowly, as recorded: a metre beside it after the turn, half a
metre at the end (`rover_guided`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.exchange import Motors, YawMode
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

Point = tuple[float, float]

TURN_GAIN_1_S = 1.5
JERK_M_S3 = 1.0
BRAKING = 0.67
"""Braking as a share of the acceleration: what the recorded approaches show"""
ARRIVED_M = 0.22
CORNER_M_S = 2.0
"""How fast it may be where a leg ends and another begins: 2.06 in two corners of `rover_auto`"""

_SCALAR = Ops()


def drive_towards(
    rover: Rover, point: Point, speed_m_s: float, course_rad: float, turn_gain_1_s: float = 2.0
) -> DriveGuidance:
    """Drive at a speed with the nose to a course.

    Args:
        rover: the vehicle.
        point: where that leads, for telemetry.
        speed_m_s: along the nose.
        course_rad: from North.
        turn_gain_1_s: from an error of the heading to a rate.
    """
    return DriveGuidance(
        motors=Motors.FLY,
        north_m=point[0],
        east_m=point[1],
        speed_m_s=speed_m_s,
        yaw_mode=YawMode.ANGLE,
        yaw_rad=course_rad,
        turn_gain_1_s=turn_gain_1_s,
        turn_rate_limit_rad_s=rover.turn_limit_rad_s(speed_m_s),
        limits=rover.navigator.limits(),
    )


class LegReference:
    """The way to one point; begins when the motors are armed.

    Args:
        destination: North and East, metres.
        speed_m_s: no faster.
        start: where the line begins; where the vehicle can stop when not given.
        moving_m_s: how fast it is already.
        leaving_m_s: how fast it may be at the end.

    Attributes:
        destination: as given.
        speed_m_s: no faster.
        reached: whether the reference has arrived, and the vehicle nearly.
    """

    def __init__(
        self,
        rover: Rover,
        destination: Point,
        speed_m_s: float,
        start: Point | None = None,
        moving_m_s: float = 0.0,
        leaving_m_s: float = 0.0,
    ) -> None:
        self.destination = destination
        self.reached = False
        self._vehicle = rover
        self._speed_m_s = speed_m_s
        self._start = rover.stopping_point() if start is None else start
        self._length_m = math.dist(self._start, destination)
        self._updated_s: float | None = None
        self._along_m = self._reference_m_s2 = 0.0
        self._leaving_m_s = leaving_m_s
        self._reference_m_s = min(moving_m_s, speed_m_s)

    @property
    def distance_m(self) -> float:
        """From the vehicle to the end."""
        motion = self._vehicle.motion
        return math.dist((motion.north_m, motion.east_m), self.destination)

    @property
    def cross_track_m(self) -> float:
        """The cross-track error of the vehicle."""
        if self._length_m < 1e-6:
            return 0.0
        (n, e), m = self._direction(), self._vehicle.motion
        beside = (m.east_m - self._start[1]) * n - (m.north_m - self._start[0]) * e
        return abs(beside)

    def redirect(self, destination: Point) -> None:
        """From here to another point, as fast as it is."""
        motion = self._vehicle.motion
        self._start = (motion.north_m, motion.east_m)
        self.destination, self.reached = destination, False
        self._length_m = math.dist(self._start, destination)
        self._along_m = 0.0

    def _passed_corner(self) -> bool:
        """Whether it is beyond the end of a leg where it does not stop, if beside it."""
        (n, e), m = self._direction(), self._vehicle.motion
        ahead = (self.destination[0] - m.north_m) * n + (self.destination[1] - m.east_m) * e
        return self._leaving_m_s > 0.0 and ahead <= 0.0

    def _direction(self) -> Point:
        if self._length_m < 1e-6:
            return 0.0, 0.0
        return (
            (self.destination[0] - self._start[0]) / self._length_m,
            (self.destination[1] - self._start[1]) / self._length_m,
        )

    def change_speed(self, speed_m_s: float) -> None:
        """Another speed from now on; a slower one is braked to."""
        self._speed_m_s = speed_m_s
        self._leaving_m_s = min(self._leaving_m_s, speed_m_s)

    def _advance(self) -> None:
        """Move the reference on to now."""
        now_s = self._vehicle.now_s
        dt = 0.0 if self._updated_s is None else now_s - self._updated_s
        self._updated_s = now_s
        p = self._vehicle.parameters
        most = max(p["WP_ACCEL"] or p["ATC_ACCEL_MAX"], 0.1)
        jerk = max(p["WP_JERK"] or JERK_M_S3, 0.1)
        left = max(self._length_m - self._along_m, 0.0)
        in_time = float(sqrt_approach(left, 1.0, BRAKING * most, _SCALAR))
        if self._leaving_m_s > 0.0:
            in_time = math.sqrt(self._leaving_m_s**2 + 2.0 * BRAKING * most * left)
        self._reference_m_s2 = min(self._reference_m_s2 + jerk * dt, most)
        speed = self._reference_m_s + self._reference_m_s2 * dt
        braked = max(self._speed_m_s, self._reference_m_s - BRAKING * most * dt)
        self._reference_m_s = min(speed, braked, in_time)
        self._along_m += min(self._reference_m_s * dt, left)

    def follow(self) -> DriveGuidance:
        """The guidance for the present moment."""
        rover = self._vehicle
        self._advance()
        along, speed = self._along_m, self._reference_m_s
        over = self._length_m - along <= ARRIVED_M
        near = self.distance_m <= max(rover.parameters["WP_RADIUS"], 0.1)
        if over and (near or self._passed_corner()):
            self.reached = True
        (n, e), m = self._direction(), rover.motion
        gain = max(rover.parameters["PSC_POS_P"], 0.01)
        behind_n = self._start[0] + n * along - m.north_m
        behind_e = self._start[1] + e * along - m.east_m
        v_n, v_e = n * speed + gain * behind_n, e * speed + gain * behind_e
        wanted = math.hypot(v_n, v_e)
        wanted = min(wanted, max(self._speed_m_s, speed))
        ahead = m.yaw_rad + (math.pi if rover.backwards else 0.0)
        course = math.atan2(v_e, v_n) if wanted > 0.02 else ahead
        if rover.backwards:
            wanted, course = -wanted, course + math.pi
        off = math.remainder(course - m.yaw_rad, math.tau)
        if abs(off) > math.pi / 2 and self.distance_m < rover.parameters["WP_RADIUS"]:
            # Beyond the end by a little: roll back instead of turning round.
            wanted *= math.cos(off)
            course += math.pi
        return drive_towards(rover, self.destination, wanted, course, TURN_GAIN_1_S)
