"""Profiles that Ruckig calculates; the only import of it. See `profiles.Solver`."""

from __future__ import annotations

import ruckig

from navigation_core.limits import AxisLimits
from navigation_core.trajectories.profiles import MotionProfile, TrajectoryError

__all__ = ["NOTE", "to_position", "to_velocity"]

NOTE = ""


def to_velocity(
    velocity_m_s: list[float],
    acceleration_m_s2: list[float],
    target_m_s: list[float],
    limits: list[AxisLimits],
) -> MotionProfile:
    """See `profiles.Solver`."""
    request = ruckig.InputParameter(len(limits))
    request.control_interface = ruckig.ControlInterface.Velocity
    request.synchronization = ruckig.Synchronization.No
    request.target_velocity = target_m_s
    return _solve(request, velocity_m_s, acceleration_m_s2, limits)


def to_position(
    velocity_m_s: float,
    acceleration_m_s2: float,
    target_m: float,
    target_m_s: float,
    limits: AxisLimits,
) -> MotionProfile:
    """See `profiles.Solver`."""
    request = ruckig.InputParameter(1)
    request.target_position = [target_m]
    request.target_velocity = [target_m_s]
    request.max_velocity = [limits.speed_forward_m_s]
    request.min_velocity = [-limits.speed_backward_m_s]
    return _solve(request, [velocity_m_s], [acceleration_m_s2], [limits])


def _solve(
    request: ruckig.InputParameter,
    velocity_m_s: list[float],
    acceleration_m_s2: list[float],
    limits: list[AxisLimits],
) -> MotionProfile:
    """Fill in start and limits and let Ruckig calculate."""
    request.current_position = [0.0] * len(limits)
    request.current_velocity = velocity_m_s
    request.current_acceleration = acceleration_m_s2
    request.max_acceleration = [limit.acceleration_m_s2 for limit in limits]
    request.max_jerk = [limit.jerk_m_s3 for limit in limits]
    profile: MotionProfile = ruckig.Trajectory(len(limits))
    try:
        result = ruckig.Ruckig(len(limits)).calculate(request, profile)
    # A ValueError: the Python binding lacks names for some of the results, such as -101, a
    # duration beyond what Ruckig allows (seen in 0.19).
    except (ruckig.RuckigError, ValueError) as error:
        raise TrajectoryError(f"Ruckig rejects {request}: {error}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise TrajectoryError(f"Ruckig finds no trajectory ({result}) for {request}")
    return profile
