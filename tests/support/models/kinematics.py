"""The least time in which a vehicle may get from rest to rest, as a reference for flights."""

from __future__ import annotations

import math

import ruckig

from navigation_core.geometry import Vector3
from navigation_core.limits import AxisLimits


def driven_way_m(start: Vector3, yaw_rad: float, goal: Vector3, radius_m: float) -> float:
    """Return the length of the shortest way of one turn and a straight line to a point.

    Args:
        start: where it begins, ENU.
        yaw_rad: where the nose points there, ENU.
        goal: where it leads, ENU; outside both circles that touch the start.
        radius_m: of the turn.
    """
    lengths = []
    for side in (1.0, -1.0):  # to the left, to the right
        centre = (
            start[0] - side * radius_m * math.sin(yaw_rad),
            start[1] + side * radius_m * math.cos(yaw_rad),
        )
        away_m = math.dist(centre, goal[:2])
        if away_m < radius_m:
            continue
        leaves_rad = math.atan2(goal[1] - centre[1], goal[0] - centre[0])
        leaves_rad -= side * math.acos(radius_m / away_m)
        arc_rad = side * (leaves_rad - yaw_rad) + 0.5 * math.pi
        # Rounding must not make a whole circle of no turn.
        arc_rad = (arc_rad + 1e-9) % math.tau
        lengths.append(radius_m * arc_rad + math.sqrt(away_m**2 - radius_m**2))
    return min(lengths)


def least_time_s(way_m: float, axis: AxisLimits, braking_m_s2: float = math.inf) -> float:
    """Return the least time from rest to rest over a length, by Ruckig on one axis.

    Args:
        way_m: the length.
        axis: the limits along it.
        braking_m_s2: how hard the vehicle brakes by its own parameters.
    """
    request = ruckig.InputParameter(1)
    request.target_position = [way_m]
    request.max_velocity = [axis.speed_forward_m_s]
    request.max_acceleration = [axis.acceleration_m_s2]
    request.min_acceleration = [-min(axis.acceleration_m_s2, braking_m_s2)]
    request.max_jerk = [axis.jerk_m_s3]
    trajectory = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(request, trajectory)
    assert result == ruckig.Result.Working, result
    return float(trajectory.duration)
