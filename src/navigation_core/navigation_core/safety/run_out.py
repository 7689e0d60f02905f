"""The run-out of a last setpoint that none follows, and the speed that it allows.

An autopilot goes on with the velocity and the acceleration of the last setpoint until its own
timeout (ArduPilot's GUID_TIMEOUT, 3 s; PX4's COM_OF_LOSS_T, 1 s), and only then does it brake. So
near obstacles every setpoint is such that this run-out ends clear of them: the server's process
may stop at any moment, and the machine may be late.
"""

from __future__ import annotations

import math

import numpy as np

from navigation_core.geometry import Vector3, norm
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.conflicts import lines_clear
from navigation_core.safety.braking import STANDING_M_S, deceleration_along_m_s2, leads_away

__all__ = ["run_out_is_clear", "safe_speed_m_s"]

# Shares of the run-out that are looked at when not all of it is clear.
_SHARES = np.linspace(0.0625, 1.0, 16)


def safe_speed_m_s(
    position_enu_m: Vector3,
    velocity_enu_m_s: Vector3,
    obstacles: Obstacles,
    limits: Limits,
    clearance_m: float,
    timeout_s: float,
    reach_m: float = math.inf,
) -> float:
    """Return how fast a setpoint may be, in its direction, so that its run-out ends clear.

    Args:
        position_enu_m: of the setpoint, map frame.
        velocity_enu_m_s: of the setpoint.
        obstacles: the known obstacles.
        limits: what the brake after the timeout keeps to.
        clearance_m: that is to be kept.
        timeout_s: for how long the vehicle goes on.
        reach_m: how far obstacles are known; what is farther away is not.

    Returns:
        Speed in m/s; infinite if the whole run-out is known to be clear, or leads away from what
        is near.
    """
    speed = norm(velocity_enu_m_s)
    if speed < STANDING_M_S:
        return math.inf
    place, velocity = np.array(position_enu_m), np.array(velocity_enu_m_s)
    course = velocity / speed
    braking = float(deceleration_along_m_s2(course[None], limits)[0])
    length_m = speed * timeout_s + speed * speed / (2.0 * braking)
    known_m = max(reach_m - clearance_m, 0.0)
    limit_m_s = _speed_for(known_m, braking, timeout_s) if length_m > known_m else math.inf
    if not len(obstacles):
        return limit_m_s
    ends = place + course * length_m * _SHARES[:, None]
    if _is_clear(place, ends[-1], obstacles, clearance_m):
        return limit_m_s
    clear = lines_clear(np.repeat(place[None], len(ends), axis=0), ends, obstacles, clearance_m)
    if not clear[0] and leads_away(place, ends[0], obstacles, clearance_m):
        return limit_m_s
    blocked = int(np.argmin(clear))
    free_m = 0.0 if blocked == 0 else length_m * float(_SHARES[blocked - 1])
    return min(_speed_for(free_m, braking, timeout_s), limit_m_s)


def run_out_is_clear(
    position_enu_m: Vector3,
    velocity_enu_m_s: Vector3,
    acceleration_enu_m_s2: Vector3,
    obstacles: Obstacles,
    clearance_m: float,
    timeout_s: float,
) -> bool:
    """Whether a setpoint with an acceleration leads clear of obstacles until the timeout.

    Args:
        position_enu_m: of the setpoint, map frame.
        velocity_enu_m_s: of the setpoint.
        acceleration_enu_m_s2: of the setpoint.
        obstacles: the known obstacles.
        clearance_m: that is to be kept.
        timeout_s: for how long the vehicle goes on.
    """
    if not len(obstacles):
        return True
    times = np.array([0.5, 1.0])[:, None] * timeout_s
    velocity, acceleration = np.array(velocity_enu_m_s), np.array(acceleration_enu_m_s2)
    places = np.array(position_enu_m) + velocity * times + 0.5 * acceleration * times * times
    starts = np.concatenate([[position_enu_m], places[:-1]])
    return bool(lines_clear(starts, places, obstacles, clearance_m).all())


def _speed_for(free_m: float, braking_m_s2: float, timeout_s: float) -> float:
    """Solve v * timeout + v^2 / (2 * braking) = free."""
    lag = braking_m_s2 * timeout_s
    return math.sqrt(lag * lag + 2.0 * braking_m_s2 * free_m) - lag


def _is_clear(start: Array, end: Array, obstacles: Obstacles, clearance_m: float) -> bool:
    return bool(lines_clear(start[None], end[None], obstacles, clearance_m)[0])
