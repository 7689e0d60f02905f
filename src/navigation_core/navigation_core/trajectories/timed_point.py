"""The points of a trajectory that another program has planned."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.geometry import Vector3

__all__ = ["TimedPoint"]


@dataclass(frozen=True)
class TimedPoint:
    """A point of a trajectory.

    Attributes:
        time_s: time from the start of the trajectory.
        position_enu_m: position in the map frame.
        velocity_enu_m_s: velocity; None if it is not given.
        acceleration_enu_m_s2: acceleration; None if it is not given.
        yaw_enu_rad: yaw; None for the direction of travel.
        yaw_rate_rad_s: rate of the yaw, counter-clockwise; 0 at all points if it is not given.
    """

    time_s: float
    position_enu_m: Vector3
    velocity_enu_m_s: Vector3 | None = None
    acceleration_enu_m_s2: Vector3 | None = None
    yaw_enu_rad: float | None = None
    yaw_rate_rad_s: float = 0.0
