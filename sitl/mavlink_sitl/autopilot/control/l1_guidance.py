"""The bank that brings a plane onto a line or a circle: the guidance of Park, Deyst and How.

"A New Nonlinear Guidance Logic for Trajectory Tracking" (AIAA 2004-4900): steer towards a
point a fixed time ahead. Far from the circle that point is its centre; near it, the circle is
tracked by a proportional-derivative law around the bank that the circle itself needs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.exchange import GRAVITY_M_S2

STEEPEST = math.sqrt(0.5)
"""Sine of the largest angle at which a line is approached: 45 degrees"""

Point = tuple[float, float]


class LineGuidance(NamedTuple):
    """The output of the law on a straight line.

    Attributes:
        sideways_m_s2: acceleration to the right.
        beside_m: distance from the line, positive to its right.
    """

    sideways_m_s2: float
    beside_m: float


class CircleGuidance(NamedTuple):
    """The output of the law.

    Attributes:
        sideways_m_s2: acceleration to the right.
        on_circle: whether the circle is tracked, no longer approached.
        outside_m: distance from the circle, negative inside.
    """

    sideways_m_s2: float
    on_circle: bool
    outside_m: float


class L1(NamedTuple):
    """The law for a plane at one moment.

    Attributes:
        position: North and East, metres.
        velocity: over ground, m/s.
        yaw_rad: where the nose points, for when it hardly moves.
        period_s: NAVL1_PERIOD.
        damping: NAVL1_DAMPING.
    """

    position: Point
    velocity: Point
    yaw_rad: float
    period_s: float
    damping: float

    def circle(self, centre: Point, radius_m: float, direction: int) -> CircleGuidance:
        """The sideways acceleration for a circle; direction is 1 clockwise, -1 the other way."""
        position, (velocity, speed) = self.position, self._moving()
        out = (position[0] - centre[0], position[1] - centre[1])
        distance = math.hypot(*out)
        if distance > 0.1:
            radial = (out[0] / distance, out[1] / distance)
        else:
            radial = (velocity[0] / speed, velocity[1] / speed)
        # Towards the centre: across and along the line to it.
        across, along = _parts(velocity, (-radial[0], -radial[1]))
        approach = self._turn(math.atan2(across, along), speed)
        # Along the circle.
        outside = distance - radius_m
        outward = -along
        natural = 2.0 * math.pi / self.period_s
        correction = natural * natural * outside + 2.0 * self.damping * natural * outward
        tangent = across * direction
        if tangent < 0.0 and distance < 2.0 * radius_m:
            # Turned the wrong way close to the circle: first come round.
            correction = max(correction, 0.0)
        needed = tangent * tangent / max(0.5 * radius_m, radius_m + outside)
        track = direction * (correction + needed)
        if outside > 0.0 and direction * approach < direction * track:
            return CircleGuidance(approach, False, outside)
        return CircleGuidance(track, True, outside)

    def line(self, start: Point, end: Point) -> LineGuidance:
        """The sideways acceleration for a straight line; it continues beyond its end."""
        position, (velocity, speed) = self.position, self._moving()
        length = math.dist(start, end)
        away = (position[0] - start[0], position[1] - start[1])
        if length < 1.0:
            start, away = position, (0.0, 0.0)
            length = max(math.dist(position, end), 0.1)
        direction = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
        beside, along = _parts(direction, away)
        ahead_m = self.damping * self.period_s * speed / math.pi
        if along < -0.7 * math.hypot(*away) and math.hypot(*away) > ahead_m:
            # Far behind its beginning: fly there first.
            across, towards = _parts(velocity, (-away[0], -away[1]))
            return LineGuidance(self._turn(math.atan2(across, towards), speed), beside)
        across, towards = _parts(velocity, direction)
        back = math.asin(min(max(beside / max(ahead_m, 0.1), -STEEPEST), STEEPEST))
        angle = math.remainder(math.atan2(across, towards) - back, math.tau)
        return LineGuidance(self._turn(angle, speed), beside)

    def _moving(self) -> tuple[Point, float]:
        """The velocity and its size; where the nose points when it hardly moves."""
        speed = math.hypot(*self.velocity)
        if speed < 1.0:
            return (math.cos(self.yaw_rad), math.sin(self.yaw_rad)), 1.0
        return self.velocity, speed

    def _turn(self, angle_rad: float, speed_m_s: float) -> float:
        """The acceleration towards a point ahead, that is seen at an angle to the velocity."""
        ahead_m = self.damping * self.period_s * speed_m_s / math.pi
        angle = min(max(angle_rad, -math.pi / 2), math.pi / 2)
        return 4.0 * self.damping**2 * speed_m_s**2 / max(ahead_m, 0.1) * math.sin(angle)


def _parts(direction: Point, other: Point) -> Point:
    """How far another vector goes to the right of a direction, and along it (times its size)."""
    return (
        direction[0] * other[1] - direction[1] * other[0],
        direction[0] * other[0] + direction[1] * other[1],
    )


def bank_rad(sideways_m_s2: float, limit_rad: float) -> float:
    """The bank of a coordinated turn with that acceleration."""
    return min(max(math.atan2(sideways_m_s2, GRAVITY_M_S2), -limit_rad), limit_rad)
