"""The bank that brings a plane onto a circle: nonlinear guidance after Park, Deyst and How.

"A New Nonlinear Guidance Logic for Trajectory Tracking" (AIAA 2004-4900): steer towards a
point a fixed time ahead. Far from the circle that point is its centre; near it, the circle is
tracked by a proportional-derivative law around the bank that the circle itself needs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

GRAVITY_M_S2 = 9.80665


class Circling(NamedTuple):
    """What the law gives.

    Attributes:
        sideways_m_s2: acceleration to the right.
        on_circle: whether the circle is tracked, no longer approached.
        outside_m: distance from the circle, negative inside.
    """

    sideways_m_s2: float
    on_circle: bool
    outside_m: float


def circle(
    position: tuple[float, float],
    velocity: tuple[float, float],
    yaw_rad: float,
    centre: tuple[float, float],
    radius_m: float,
    direction: int,
    period_s: float,
    damping: float,
) -> Circling:
    """The sideways acceleration for a circle.

    Args:
        position: North and East, metres.
        velocity: over ground, m/s.
        yaw_rad: where the nose points, for when it hardly moves.
        centre: of the circle.
        radius_m: of the circle.
        direction: 1 clockwise, -1 the other way.
        period_s: NAVL1_PERIOD.
        damping: NAVL1_DAMPING.

    Returns:
        The acceleration, and how it came about.
    """
    speed = math.hypot(*velocity)
    if speed < 1.0:
        velocity, speed = (math.cos(yaw_rad), math.sin(yaw_rad)), 1.0
    out = (position[0] - centre[0], position[1] - centre[1])
    distance = math.hypot(*out)
    if distance > 0.1:
        radial = (out[0] / distance, out[1] / distance)
    else:
        radial = (velocity[0] / speed, velocity[1] / speed)
    ahead_m = damping * period_s * speed / math.pi
    gain = 4.0 * damping * damping
    # Towards the centre: across and along the line to it.
    across = velocity[0] * -radial[1] - velocity[1] * -radial[0]
    along = -(velocity[0] * radial[0] + velocity[1] * radial[1])
    angle = min(max(math.atan2(across, along), -math.pi / 2), math.pi / 2)
    approach = gain * speed * speed / max(ahead_m, 0.1) * math.sin(angle)
    # Along the circle.
    outside = distance - radius_m
    outward = -along
    natural = 2.0 * math.pi / period_s
    correction = natural * natural * outside + 2.0 * damping * natural * outward
    tangent = across * direction
    if tangent < 0.0 and distance < 2.0 * radius_m:
        # Turned the wrong way close to the circle: first come round.
        correction = max(correction, 0.0)
    needed = tangent * tangent / max(0.5 * radius_m, radius_m + outside)
    track = direction * (correction + needed)
    if outside > 0.0 and direction * approach < direction * track:
        return Circling(approach, False, outside)
    return Circling(track, True, outside)


def bank_rad(sideways_m_s2: float, limit_rad: float) -> float:
    """The bank of a coordinated turn with that acceleration."""
    return min(max(math.atan2(sideways_m_s2, GRAVITY_M_S2), -limit_rad), limit_rad)
