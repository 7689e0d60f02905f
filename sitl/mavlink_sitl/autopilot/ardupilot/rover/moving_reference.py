"""The path of a rover or boat to a point: a moving reference.

In AUTO and on returns it moves on a straight line, to a setpoint as the vehicle can turn. The
reference keeps the limits of speed, acceleration and jerk; the vehicle follows it by
steering towards the reference's velocity plus a share of its own distance from it (PSC_POS_P).
So it cuts back onto the line slowly, as recorded: a metre beside it after the turn, half a
metre at the end (`rover_guided`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.control.controller import cornering, sqrt_approach
from mavlink_sitl.exchange import Motors, YawMode
from mavlink_sitl.guidance import DriveGuidance

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover

Point = tuple[float, float]
Motion2 = tuple[Point, Point, bool]
"""Position (m) and velocity (m/s), North and East, and whether it has arrived"""

TURN_GAIN_1_S = 1.5
JERK_M_S3 = 1.0
BRAKING = 0.67
"""Braking as a share of the acceleration: what the recorded approaches show"""
ARRIVED_M = 0.22
SETTLED_M = 0.01
"""The same for the reference of a setpoint"""
KEEPING_UP = 0.05
"""Share of its speed by which the vehicle may be slower than its reference without delaying it"""
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
        self._from_rest = moving_m_s == 0.0
        self._progress = 1.0
        """Seconds of the reference in a second"""
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

    def _passed_s(self) -> float:
        """The time since the last call; 0 in the first."""
        now_s = self._vehicle.now_s
        passed_s = 0.0 if self._updated_s is None else now_s - self._updated_s
        self._updated_s = now_s
        return passed_s

    def _limits(self) -> tuple[float, float]:
        """Acceleration and jerk."""
        p = self._vehicle.parameters
        return max(p["WP_ACCEL"] or p["ATC_ACCEL_MAX"], 0.1), max(p["WP_JERK"] or JERK_M_S3, 0.1)

    def _keeping_up(self) -> float:
        """The share of the reference's speed that the vehicle has, less what it is behind.

        As advance_wp_target_along_track of AR_WPNav: a rover that has to turn first is waited for.
        In a corner its reference turns with the vehicle, unlike the one here.
        """
        speed, m = self._reference_m_s, self._vehicle.motion
        if speed <= 0.0 or not self._from_rest:
            return 1.0
        n, e = self._direction()
        here_m = (m.north_m - self._start[0]) * n + (m.east_m - self._start[1]) * e
        real_m_s = m.velocity_north_m_s * n + m.velocity_east_m_s * e
        gain = max(self._vehicle.parameters["PSC_POS_P"], 0.01)
        share = KEEPING_UP + (real_m_s - gain * (self._along_m - here_m)) / speed
        return min(max(share, 0.0), 1.0)

    def _advance(self) -> Motion2:
        """Move the reference on to now."""
        most, jerk = self._limits()
        passed_s = self._passed_s()
        self._progress += (self._keeping_up() - self._progress) * min(passed_s * jerk / most, 1.0)
        dt = passed_s * self._progress
        left = max(self._length_m - self._along_m, 0.0)
        in_time = float(sqrt_approach(left, 1.0, BRAKING * most, _SCALAR))
        if self._leaving_m_s > 0.0:
            in_time = math.sqrt(self._leaving_m_s**2 + 2.0 * BRAKING * most * left)
        self._reference_m_s2 = min(self._reference_m_s2 + jerk * dt, most)
        speed = self._reference_m_s + self._reference_m_s2 * dt
        braked = max(self._speed_m_s, self._reference_m_s - BRAKING * most * dt)
        self._reference_m_s = min(speed, braked, in_time)
        self._along_m += min(self._reference_m_s * dt, left)
        (n, e), along, speed = self._direction(), self._along_m, self._reference_m_s
        place = (self._start[0] + n * along, self._start[1] + e * along)
        return place, (n * speed, e * speed), self._length_m - along <= ARRIVED_M

    def follow(self) -> DriveGuidance:
        """The guidance for the present moment."""
        rover, m = self._vehicle, self._vehicle.motion
        place, velocity, over = self._advance()
        near = self.distance_m <= max(rover.parameters["WP_RADIUS"], 0.1)
        if over and (near or self._passed_corner()):
            self.reached = True
        gain = max(rover.parameters["PSC_POS_P"], 0.01)
        v_n = velocity[0] + gain * (place[0] - m.north_m)
        v_e = velocity[1] + gain * (place[1] - m.east_m)
        wanted = min(math.hypot(v_n, v_e), max(self._speed_m_s, math.hypot(*velocity)))
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


class SetpointReference(LegReference):
    """The path to a position setpoint: it begins with the vehicle's motion, and turns from there.

    Rule of AR_PosControl (`init`, `input_pos_target`) and AP_Math (`shape_pos_vel_accel_xy`). A
    vehicle that is told another position on its way does not stop first; the reference continues.
    """

    def __init__(self, rover: Rover, destination: Point, speed_m_s: float) -> None:
        super().__init__(rover, destination, speed_m_s)
        self._begin()

    def _begin(self) -> None:
        m = self._vehicle.motion
        self._place = (m.north_m, m.east_m)
        self._velocity = (m.velocity_north_m_s, m.velocity_east_m_s)
        self._acceleration = (0.0, 0.0)

    def redirect(self, destination: Point) -> None:
        """To another point, from the present motion of the reference."""
        self._start, self.destination, self.reached = self.destination, destination, False
        self._length_m = math.dist(self._start, destination)

    def _advance(self) -> Motion2:
        """Move the reference on to now."""
        if self._updated_s is None:
            self._begin()
        dt = self._passed_s()
        most, jerk = self._limits()
        (n, e), (v_n, v_e), (a_n, a_e) = self._place, self._velocity, self._acceleration
        self._place = (n + (v_n + 0.5 * a_n * dt) * dt, e + (v_e + 0.5 * a_e * dt) * dt)
        self._velocity = (v_n + a_n * dt, v_e + a_e * dt)
        error = _from_to(self._place, self.destination)
        wanted = _shortened(_approach(error, 0.5 * jerk / most, 0.5 * most, dt), self._speed_m_s)
        change = _approach(_from_to(self._velocity, wanted), jerk / most, jerk, dt)
        towards_n, towards_e = cornering(*change, *wanted, most, _SCALAR)
        step = _shortened(_from_to(self._acceleration, (towards_n, towards_e)), jerk * dt)
        self._acceleration = (a_n + step[0], a_e + step[1])
        return self._place, self._velocity, math.hypot(*error) < SETTLED_M


def _from_to(a: Point, b: Point) -> Point:
    return b[0] - a[0], b[1] - a[1]


def _shortened(vector: Point, most: float) -> Point:
    length = math.hypot(*vector)
    factor = most / length if length > most else 1.0
    return vector[0] * factor, vector[1] * factor


def _approach(error: Point, gain: float, limit: float, dt: float) -> Point:
    """The rate that corrects an error; not beyond it within a step."""
    length = math.hypot(*error)
    if length == 0.0:
        return 0.0, 0.0
    rate = float(sqrt_approach(length, gain, limit, _SCALAR))
    if dt > 0.0:
        rate = min(rate, length / dt)
    return error[0] * rate / length, error[1] * rate / length
