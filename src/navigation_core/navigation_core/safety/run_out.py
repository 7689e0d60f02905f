"""The run-out of a last setpoint that none follows, and the speed that it allows.

An autopilot continues with the velocity and the acceleration of the last setpoint until its own
timeout (ArduPilot's GUID_TIMEOUT, 3 s; PX4's COM_OF_LOSS_T, 1 s), and only then does it brake. So
near obstacles every setpoint is such that this run-out ends clear of them: the server's process
may stop at any moment, and the machine may be late.
"""

from __future__ import annotations

import math

import numpy as np

from navigation_core.geometry import KinematicState, Vector3, add, norm, scale
from navigation_core.limits import Limits, stopping_distance_m, stopping_speed_m_s
from navigation_core.mapping.moving_obstacles import Moving
from navigation_core.mapping.obstacles import Array, Obstacles
from navigation_core.planning.conflicts import lines_clear
from navigation_core.safety.braking import STANDING_M_S, deceleration_along_m_s2, leads_away
from navigation_core.safety.keeping_apart import PREDICTED_S, apart_m, at_height

__all__ = ["run_out_is_clear", "safe_speed_beside_m_s", "safe_speed_m_s"]

# Shares of the run-out that are looked at when not all of it is clear.
_SHARES = np.linspace(0.0625, 1.0, 16)
# Shares of the speed that are tried, the greatest first, and moments that are looked at, beside
# what moves.
_SPEEDS, _STEP_S = np.linspace(1.0, 0.125, 8), 0.2
_NEARER_MAX_M, _SOONER_MAX_S = 0.05, 0.2
# Moments of a run-out with an acceleration, as shares of the timeout.
_MOMENTS = np.linspace(0.0, 1.0, 9)


class _RunOut:
    """The flight from a setpoint on that none follows; arrays in the map frame.

    Attributes:
        braking_m_s2: deceleration of the brake after the timeout.
        rest_s: time until the vehicle is at rest.
    """

    def __init__(
        self, place: Array, velocity: Array, acceleration: Array, limits: Limits, timeout_s: float
    ) -> None:
        self._place, self._velocity, self._acceleration = place, velocity, acceleration
        self._timeout_s = timeout_s
        last = velocity + acceleration * timeout_s
        self._last_m_s = math.sqrt(float(last @ last))
        self._course = last / max(self._last_m_s, 1e-9)
        self.braking_m_s2 = float(deceleration_along_m_s2(self._course[None], limits)[0])
        self.rest_s = timeout_s + self._last_m_s / self.braking_m_s2

    def places(self, times: Array) -> Array:
        """Return where the vehicle is at times (N,) in s, shape (N, 3)."""
        led = np.minimum(times, self._timeout_s)[:, None]
        braked = np.clip(times, self._timeout_s, self.rest_s)[:, None] - self._timeout_s
        braked_m = self._last_m_s * braked - 0.5 * self.braking_m_s2 * braked * braked
        led_m = self._velocity * led + 0.5 * self._acceleration * led * led
        return np.asarray(self._place + led_m + self._course * braked_m)


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
        timeout_s: for how long the vehicle continues.
        reach_m: how far obstacles are known; what is farther away is not.

    Returns:
        Speed in m/s; infinite if the whole run-out is known to be clear, or leads away from what
        is near.
    """
    speed = norm(velocity_enu_m_s)
    if speed < STANDING_M_S:
        return math.inf
    course = scale(velocity_enu_m_s, 1.0 / speed)
    braking = limits.along(course).acceleration_m_s2
    length_m = stopping_distance_m(speed, timeout_s, braking)
    known_m = max(reach_m - clearance_m, 0.0)
    limit_m_s = stopping_speed_m_s(known_m, timeout_s, braking) if length_m > known_m else math.inf
    end = add(position_enu_m, scale(course, length_m))
    x, y, z = zip(position_enu_m, end, strict=True)
    near = obstacles.near((min(x), min(y), min(z)), (max(x), max(y), max(z)), clearance_m)
    if not len(near):
        return limit_m_s
    place = np.array(position_enu_m)
    ends = place + (np.array(end) - place) * _SHARES[:, None]
    if near.is_clear(position_enu_m, end, clearance_m):
        return limit_m_s
    clear = near.are_clear(np.repeat(place[None], len(ends), axis=0), ends, clearance_m)
    if not clear[0] and leads_away(place, ends[0], near, clearance_m):
        return limit_m_s
    blocked = int(np.argmin(clear))
    free_m = 0.0 if blocked == 0 else length_m * float(_SHARES[blocked - 1])
    return min(stopping_speed_m_s(free_m, timeout_s, braking), limit_m_s)


def safe_speed_beside_m_s(
    position_enu_m: Vector3,
    velocity_enu_m_s: Vector3,
    moving: tuple[Moving, ...],
    limits: Limits,
    clearance_m: float,
    timeout_s: float,
) -> float:
    """Return how fast a setpoint may be so that its run-out does not meet what moves.

    A moving obstacle is assumed to keep its velocity. One that would come as near to a stationary
    vehicle is no reason to be slower.

    Args as for :func:`safe_speed_m_s`; ``moving``: obstacles that move.

    Returns:
        Speed in m/s; 0 if every speed leads nearer to something than standing still does,
        infinite if the speed need not be less.
    """
    speed, near = norm(velocity_enu_m_s), at_height(moving, position_enu_m[2])
    if speed < STANDING_M_S or not near:
        return math.inf
    place, velocity = np.array(position_enu_m), np.array(velocity_enu_m_s)
    for share in _SPEEDS:
        run_out = _RunOut(place, share * velocity, np.zeros(3), limits, timeout_s)
        times = np.arange(0.0, max(run_out.rest_s, PREDICTED_S) + _STEP_S, _STEP_S)
        path = run_out.places(times)[:, :2]
        if all(_passes(path, times, one, clearance_m) for one in near):
            return math.inf if share == 1.0 else float(share * speed)
    return 0.0


def _passes(path: Array, times: Array, moving: Moving, clearance_m: float) -> bool:
    """Whether places (N, 2) at times keep a clearance, or do no worse than standing still does."""
    passing_m = apart_m(path, times, moving)
    standing_m = apart_m(np.broadcast_to(path[0], path.shape), times, moving)
    clear, standing_clear = passing_m >= clearance_m, standing_m >= clearance_m
    if clear.all() or standing_clear.all():
        return bool(clear.all())
    sooner_s = times[standing_clear.argmin()] - times[clear.argmin()]
    return bool(sooner_s <= _SOONER_MAX_S and passing_m.min() >= standing_m.min() - _NEARER_MAX_M)


def run_out_is_clear(
    position_enu_m: Vector3,
    setpoint: KinematicState,
    obstacles: Obstacles,
    moving: tuple[Moving, ...],
    limits: Limits,
    clearance_m: float,
    timeout_s: float,
) -> bool:
    """Whether a setpoint with an acceleration leads clear of obstacles if none follows.

    Args as for :func:`safe_speed_m_s`; ``position_enu_m``: where the vehicle is to be now, which
    may be beside the position of the ``setpoint``; ``moving``: those of the obstacles that move.
    """
    if not len(obstacles) and not moving:
        return True
    run_out = _RunOut(
        np.array(setpoint.position_enu_m),
        np.array(setpoint.velocity_enu_m_s),
        np.array(setpoint.acceleration_enu_m_s2),
        limits,
        timeout_s,
    )
    here = np.array(position_enu_m)
    end_s = max(run_out.rest_s, PREDICTED_S)
    times = np.concatenate((_MOMENTS * timeout_s, (run_out.rest_s, end_s)))
    places = run_out.places(times)
    starts = np.concatenate((here[None], places[:-1]))
    near = at_height(moving, setpoint.position_enu_m[2])
    return bool(lines_clear(starts, places, obstacles, clearance_m).all()) and all(
        _passes(places[:, :2], times, one, clearance_m) for one in near
    )
