"""Profiles calculated without Ruckig, by closed forms and one search. See `profiles.Solver`.

A change of velocity is the fastest: the acceleration rises to a peak and falls to zero, at the
full jerk. A motion to a position is two of them, by way of the velocity for which the distances
add up; if that is the greatest, it is kept for a time between the two. So the acceleration is zero
once on the way. Only from a start that brakes already, harder than it needs to, a faster motion may
exist, whose acceleration does not return to zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import scipy

from navigation_core.limits import AxisLimits
from navigation_core.trajectories.profiles import TrajectoryError

__all__ = ["NOTE", "to_position", "to_velocity"]

NOTE = "Trajectories are calculated without Ruckig, which is not installed: plans take longer."
_Steps = list[tuple[float, float]]
"""Jerk in m/s3 and duration in seconds, one after the other"""


@dataclass(frozen=True)
class _Brake:
    """See `profiles.Brake`; it is part of the phases here."""

    duration: float = 0.0
    t: tuple[float, ...] = ()
    j: tuple[float, ...] = ()
    p: tuple[float, ...] = ()
    v: tuple[float, ...] = ()
    a: tuple[float, ...] = ()


@dataclass(frozen=True)
class _AxisProfile:
    """See `profiles.AxisProfile`."""

    t: list[float]
    j: list[float]
    p: list[float]
    v: list[float]
    a: list[float]
    brake: _Brake = field(default_factory=_Brake)

    @property
    def duration_s(self) -> float:
        """Duration of all phases."""
        return math.fsum(self.t)

    def at_time(self, t_s: float) -> tuple[float, float, float]:
        """Return position, velocity and acceleration; after the end, the velocity stays."""
        k, last = 0, len(self.t)
        while k < last and t_s > self.t[k]:
            t_s -= self.t[k]
            k += 1
        jerk = self.j[k] if k < last else 0.0
        return _after(self.p[k], self.v[k], self.a[k], jerk, t_s)


@dataclass(frozen=True)
class _Extrema:
    """See `profiles.Extrema`."""

    max: float


class _MotionProfile:
    """See `profiles.MotionProfile`."""

    def __init__(self, axes: list[_AxisProfile]) -> None:
        """Keep the motion on each axis."""
        self.profiles = [axes]
        self.duration = max(axis.duration_s for axis in axes)

    def at_time(self, t_s: float, /) -> tuple[list[float], list[float], list[float]]:
        """See `profiles.MotionProfile`."""
        positions, velocities, accelerations = [], [], []
        for axis in self.profiles[0]:
            position, velocity, acceleration = axis.at_time(t_s)
            positions.append(position)
            velocities.append(velocity)
            accelerations.append(acceleration)
        return positions, velocities, accelerations

    @property
    def position_extrema(self) -> list[_Extrema]:
        """See `profiles.MotionProfile`."""
        return [_Extrema(max(_extreme_positions(axis))) for axis in self.profiles[0]]


def to_velocity(
    velocity_m_s: list[float],
    acceleration_m_s2: list[float],
    target_m_s: list[float],
    limits: list[AxisLimits],
) -> _MotionProfile:
    """See `profiles.Solver`."""
    starts = zip(velocity_m_s, acceleration_m_s2, target_m_s, limits, strict=True)
    return _MotionProfile(
        [_profile(v, a, _change(v, a, target, limit)) for v, a, target, limit in starts]
    )


def to_position(
    velocity_m_s: float,
    acceleration_m_s2: float,
    target_m: float,
    target_m_s: float,
    limits: AxisLimits,
) -> _MotionProfile:
    """See `profiles.Solver`."""

    def by_way_of(speed_m_s: float) -> tuple[_Steps, _Steps]:
        return (
            _change(velocity_m_s, acceleration_m_s2, speed_m_s, limits),
            _change(speed_m_s, 0.0, target_m_s, limits),
        )

    def remaining_m(speed_m_s: float) -> float:
        first, second = by_way_of(speed_m_s)
        return (
            target_m
            - _end(velocity_m_s, acceleration_m_s2, first)[0]
            - _end(speed_m_s, 0.0, second)[0]
        )

    low, high = -limits.speed_backward_m_s, limits.speed_forward_m_s
    relaxed = velocity_m_s + 0.5 * acceleration_m_s2 * abs(acceleration_m_s2) / limits.jerk_m_s3
    # Between these, the more distance, the faster.
    bounds = [min(max(bound, low), high) for bound in sorted((relaxed, target_m_s))]
    speed, upper = high, high
    for lower in (*reversed(bounds), low):
        if remaining_m(upper) >= 0.0:
            speed = upper
            break
        if remaining_m(lower) >= 0.0:
            speed = scipy.optimize.brentq(remaining_m, lower, upper, xtol=1e-15, rtol=1e-15)
            break
        speed = upper = lower
    first, second = by_way_of(speed)
    kept_s = max(remaining_m(speed) / speed, 0.0) if speed in (low, high) else 0.0
    return _MotionProfile(
        [_profile(velocity_m_s, acceleration_m_s2, [*first, (0.0, kept_s), *second])]
    )


def _change(velocity: float, acceleration: float, target: float, limits: AxisLimits) -> _Steps:
    """Change a velocity as fast as it goes; the acceleration is zero afterwards."""
    most, jerk = limits.acceleration_m_s2, limits.jerk_m_s3
    steps: _Steps = []
    if abs(acceleration) > most:
        # A start beyond the limits goes back to them first.
        back = (-math.copysign(jerk, acceleration), (abs(acceleration) - most) / jerk)
        _, velocity, acceleration = _after(0.0, velocity, acceleration, *back)
        steps.append(back)
        acceleration = math.copysign(most, acceleration)
    relaxed = velocity + 0.5 * acceleration * abs(acceleration) / jerk
    sign = 1.0 if target >= relaxed else -1.0
    begin, change = sign * acceleration, sign * (target - velocity)
    # The acceleration rises from `begin` to a peak and falls to zero: two ramps at the full jerk.
    peak = math.sqrt(max(jerk * change + 0.5 * begin * begin, 0.0))
    steady_s = 0.0
    if peak > most:
        peak = most
        steady_s = max(change - (most * most - 0.5 * begin * begin) / jerk, 0.0) / most
    peak = max(peak, begin)
    rise = (sign * jerk, (peak - begin) / jerk)
    return [*steps, rise, (0.0, steady_s), (-sign * jerk, peak / jerk)]


def _profile(velocity: float, acceleration: float, steps: _Steps) -> _AxisProfile:
    """Work out the states at which the steps begin."""
    if not all(math.isfinite(each) for step in steps for each in step):
        raise TrajectoryError(
            f"No trajectory from {velocity} m/s and {acceleration} m/s2: its steps are {steps}"
        )
    states = [(0.0, velocity, acceleration)]
    for jerk, duration_s in steps:
        states.append(_after(*states[-1], jerk, duration_s))
    positions, velocities, accelerations = (list(each) for each in zip(*states, strict=True))
    return _AxisProfile(
        [duration_s for _, duration_s in steps],
        [jerk for jerk, _ in steps],
        positions,
        velocities,
        accelerations,
    )


def _end(velocity: float, acceleration: float, steps: _Steps) -> tuple[float, float, float]:
    """Return the state after steps from position 0."""
    state = (0.0, velocity, acceleration)
    for jerk, duration_s in steps:
        state = _after(*state, jerk, duration_s)
    return state


def _after(
    position: float, velocity: float, acceleration: float, jerk: float, t_s: float
) -> tuple[float, float, float]:
    """Return the state after a time of steady jerk."""
    half = 0.5 * t_s * t_s
    return (
        position + t_s * velocity + half * (acceleration + t_s * jerk / 3.0),
        velocity + t_s * acceleration + half * jerk,
        acceleration + t_s * jerk,
    )


def _extreme_positions(axis: _AxisProfile) -> Iterator[float]:
    """Where a phase begins, where the last ends, and where the motion turns round."""
    yield from axis.p
    for k, (jerk, duration_s) in enumerate(zip(axis.j, axis.t, strict=True)):
        velocity, acceleration = axis.v[k], axis.a[k]
        # The velocity is zero at the roots of a polynomial of the second degree.
        root = acceleration * acceleration - 2.0 * jerk * velocity
        if root < 0.0:
            continue
        largest = -acceleration - math.copysign(math.sqrt(root), acceleration)
        times = [largest / jerk] if jerk else []
        times += [2.0 * velocity / largest] if largest else []
        for t_s in times:
            if 0.0 < t_s < duration_s:
                yield _after(axis.p[k], velocity, acceleration, jerk, t_s)[0]
