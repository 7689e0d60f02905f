"""Steer a ground vehicle after its carrot: pure pursuit, as a velocity.

A rover or a boat moves along its nose only. It is told a velocity: its direction is where to
head for, its length how fast. The carrot is the point that pure pursuit looks ahead to; the
trajectory tells how fast it goes there. A vehicle that is told velocities stops by itself
when they stop coming (ArduRover after 3 s, PX4 by its OFFBOARD failsafe), which one that is
told a position does not.

R. C. Coulter, "Implementation of the Pure Pursuit Path Tracking Algorithm", 1992.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    horizontal_norm,
    scale,
    subtract,
    unit_between,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.tasks.base import Setpoint, Traits

# Speed at which a metre of lag is made up.
_GAIN_1_S = 0.8
# Nearer than this share of the arrival radius, the vehicle is told to stand.
_STAND_SHARE = 0.6
# Slower than this a car hardly steers; it is used while there is still a way to go.
_CRAWL_M_S = 0.4
# A curve is looked ahead into by so many turning radii.
_LOOK_AHEAD_RADII = 1.5
# Share of the speed that is left when the vehicle faces the other way.
_SLOWEST_SHARE = 0.35


@dataclass(frozen=True)
class Pursuer:
    """What chases the carrot.

    Attributes:
        position_enu_m: where it is.
        yaw_enu_rad: where its nose points.
        traits: what it can do.
        limits: the speed is kept to theirs.
    """

    position_enu_m: Vector3
    yaw_enu_rad: float
    traits: Traits
    limits: Limits


def pursue(
    carrot: KinematicState, pursuer: Pursuer, arrival_radius_m: float, ends: bool
) -> Setpoint:
    """Return the velocity that leads after the carrot.

    Args:
        carrot: the point on the trajectory, with its velocity.
        pursuer: the vehicle.
        arrival_radius_m: how near to the end counts as arrived.
        ends: whether the carrot stands at the end of the trajectory.
    """
    lag_m = horizontal_norm(subtract(carrot.position_enu_m, pursuer.position_enu_m))
    standing = Setpoint(carrot.position_enu_m, ZERO, ZERO, pursuer.yaw_enu_rad)
    if ends and lag_m <= _STAND_SHARE * arrival_radius_m:
        return standing
    direction = _direction(carrot, pursuer)
    carrot_m_s = horizontal_norm(carrot.velocity_enu_m_s)
    # A carrot at full speed is followed at the distance that its speed divided by the gain is.
    speed_m_s = max(_GAIN_1_S * lag_m, carrot_m_s) if not ends else _approach_m_s(lag_m, pursuer)
    away = abs(wrap_angle(math.atan2(direction[1], direction[0]) - pursuer.yaw_enu_rad))
    speed_m_s *= max(math.cos(away), _SLOWEST_SHARE)
    speed_m_s = min(max(speed_m_s, _CRAWL_M_S), pursuer.limits.speed_horizontal_m_s)
    return replace(
        standing,
        velocity_enu_m_s=(speed_m_s * direction[0], speed_m_s * direction[1], 0.0),
        yaw_enu_rad=math.atan2(direction[1], direction[0]),
    )


def _approach_m_s(lag_m: float, pursuer: Pursuer) -> float:
    """Return a speed from which the vehicle comes to rest: what turns wide also brakes slowly."""
    return _GAIN_1_S * lag_m / max(pursuer.traits.turning_radius_m, 1.0)


def _direction(carrot: KinematicState, pursuer: Pursuer) -> Vector3:
    """Return the unit vector to head for."""
    ahead = unit_between(ZERO, carrot.velocity_enu_m_s)
    aim = carrot.position_enu_m
    if ahead is not None:
        aim = add(aim, scale(ahead, _LOOK_AHEAD_RADII * pursuer.traits.turning_radius_m))
    heading = (math.cos(pursuer.yaw_enu_rad), math.sin(pursuer.yaw_enu_rad), 0.0)
    if _inside_turn(aim, pursuer, heading):
        return heading  # it would be circled for ever; first get away from it
    level = (aim[0], aim[1], pursuer.position_enu_m[2])
    return unit_between(pursuer.position_enu_m, level) or heading


def _inside_turn(aim: Vector3, pursuer: Pursuer, heading: Vector3) -> bool:
    """Whether a point lies within the circle of the tightest turn, to either side."""
    east, north, _ = subtract(aim, pursuer.position_enu_m)
    radius_m = pursuer.traits.turning_radius_m
    ahead_m = east * heading[0] + north * heading[1]
    aside_m = abs(-east * heading[1] + north * heading[0])
    return math.hypot(ahead_m, aside_m - radius_m) < 0.9 * radius_m and aside_m > 0.2 * radius_m
