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
from dataclasses import replace

from navigation_core.geometry import ZERO, KinematicState, Vector3, horizontal_norm, subtract
from navigation_core.limits import Limits
from navigation_core.tasks.base import Setpoint

# Speed at which a metre of lag is made up.
_GAIN_1_S = 0.8
# Nearer than this share of the arrival radius, the vehicle is told to stand.
_STAND_SHARE = 0.6
# Slower than this a car hardly steers; it is used while there is still a way to go.
_CRAWL_M_S = 0.3


def pursue(
    carrot: KinematicState,
    position_enu_m: Vector3,
    limits: Limits,
    arrival_radius_m: float,
    ends: bool,
) -> Setpoint:
    """Return the velocity that leads after the carrot.

    Args:
        carrot: the point on the trajectory, with its velocity.
        position_enu_m: where the vehicle is.
        limits: the speed is kept to theirs.
        arrival_radius_m: how near to the end counts as arrived.
        ends: whether the carrot stands at the end of the trajectory.
    """
    offset = subtract(carrot.position_enu_m, position_enu_m)
    lag_m = horizontal_norm(offset)
    standing = Setpoint(carrot.position_enu_m, ZERO, ZERO, 0.0)
    if ends and lag_m <= _STAND_SHARE * arrival_radius_m:
        return standing
    if lag_m < 1e-6:
        return replace(standing, velocity_enu_m_s=carrot.velocity_enu_m_s)
    east, north = offset[0] / lag_m, offset[1] / lag_m
    carrot_m_s = horizontal_norm(carrot.velocity_enu_m_s)
    # What the carrot does along the line of sight, and what makes up the lag beyond the
    # distance that it is meant to keep.
    speed_m_s = carrot_m_s + _GAIN_1_S * max(lag_m - carrot_m_s / _GAIN_1_S, 0.0)
    if ends:
        speed_m_s = max(_GAIN_1_S * lag_m, _CRAWL_M_S)
    speed_m_s = min(max(speed_m_s, _CRAWL_M_S), limits.speed_horizontal_m_s)
    return replace(
        standing,
        velocity_enu_m_s=(speed_m_s * east, speed_m_s * north, 0.0),
        yaw_enu_rad=math.atan2(north, east),
    )
