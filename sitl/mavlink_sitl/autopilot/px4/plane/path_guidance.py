"""The sideways acceleration that brings a plane onto a path, as PX4's directional guidance does.

After "On Flying Backwards: Preventing Run-away of Small, Low-speed, Fixed-wing UAVs in Strong
Winds" (Stastny and Siegwart, IROS 2019), without its part about wind faster than the plane:
far from the path the course leads straight to it, near it along it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

Point = tuple[float, float]


class PathPoint(NamedTuple):
    """The place of a path that is nearest to the vehicle.

    Attributes:
        nearest: North and East, metres.
        tangent: its direction there, a unit vector.
        curvature_1_m: positive to the right.
    """

    nearest: Point
    tangent: Point
    curvature_1_m: float = 0.0


class Law(NamedTuple):
    """NPFG_PERIOD, seconds, and NPFG_DAMPING."""

    period_s: float
    damping: float

    def bound_m(self, speed_m_s: float) -> float:
        """Farther from the path than this it is flown to, not along."""
        return max(speed_m_s, 1.0) * self.period_s * self.damping


def unit(north: float, east: float, instead: Point = (1.0, 0.0)) -> Point:
    """A vector of length 1; another one where there is no direction."""
    length = math.hypot(north, east)
    return (north / length, east / length) if length > 1e-6 else instead


def line(here: Point, start: Point, end: Point) -> PathPoint:
    """A straight line from a place to another."""
    along = unit(end[0] - start[0], end[1] - start[1])
    done = (here[0] - start[0]) * along[0] + (here[1] - start[1]) * along[1]
    return PathPoint((start[0] + done * along[0], start[1] + done * along[1]), along)


def point(here: Point, place: Point) -> PathPoint:
    """The straight way to a place from wherever the vehicle is."""
    return PathPoint(place, unit(place[0] - here[0], place[1] - here[1]))


def circle(here: Point, centre: Point, radius_m: float, course: Point) -> PathPoint:
    """A circle, clockwise, or the other way round with a negative radius."""
    sense = -1.0 if radius_m < 0.0 else 1.0
    out = unit(here[0] - centre[0], here[1] - centre[1], course)
    radius = max(abs(radius_m), 1.0)
    nearest = (centre[0] + radius * out[0], centre[1] + radius * out[1])
    return PathPoint(nearest, (-sense * out[1], sense * out[0]), sense / radius)


def sideways_m_s2(here: Point, velocity_m_s: Point, path: PathPoint, law: Law) -> float:
    """The acceleration to the right.

    Args:
        here: North and East, metres.
        velocity_m_s: over ground.
        path: the path at its nearest place.
        law: how quickly errors are closed.
    """
    speed = math.hypot(*velocity_m_s)
    course = math.atan2(velocity_m_s[1], velocity_m_s[0])
    away = (path.nearest[0] - here[0], path.nearest[1] - here[1])
    far = min(math.hypot(*away) / law.bound_m(speed), 1.0)
    look_rad = math.pi / 2.0 * (1.0 - far) ** 2
    to_path = unit(*away, path.tangent)
    c, s = math.cos(look_rad), math.sin(look_rad)
    wanted = math.atan2(c * to_path[1] + s * path.tangent[1], c * to_path[0] + s * path.tangent[0])
    off = math.remainder(wanted - course, math.tau)
    turn = math.sin(off) if abs(off) < math.pi / 2.0 else math.copysign(1.0, off)
    gain = 4.0 * math.pi * law.damping / law.period_s
    along = math.cos(off) if abs(off) < math.pi / 2.0 else 0.0
    return gain * speed * turn + path.curvature_1_m * speed * speed * s * along
