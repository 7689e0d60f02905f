"""Trajectories that other programs have planned: points with times, checked and made flyable.

Between points the motion is a polynomial of degree five where velocities and accelerations are
given, of degree three where only velocities are, and else the cubic spline that begins and ends at
rest. A trajectory that ends in motion is followed by a brake.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from navigation_core.geometry import (
    KinematicState,
    distance,
    is_finite,
    limit_norm,
    norm,
    scale,
)
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import Array
from navigation_core.trajectories.polynomials import (
    PolynomialPiece,
    between,
    spline_velocities,
    through,
)
from navigation_core.trajectories.timed_point import TimedPoint
from navigation_core.trajectories.timed_yaw import TimedYaw
from navigation_core.trajectories.trajectory import Trajectory, plan_stop

__all__ = ["TimedTrajectory", "TrajectoryFault", "join", "plan_timed"]

POINTS_MAX = 2000
"""More points are a mistake, or too many for one setpoint period."""
DURATION_MAX_S = 600.0
"""Longest duration."""
_STEP_MIN_S = 1e-3
# To catch typing errors, before anything is calculated.
_NUMBER_MAX = 1e6
# Steps in which limits are looked at, and how many of each piece at least: between two of these a
# quintic polynomial from rest to rest accelerates at most 1 % more.
_SAMPLE_S, _SAMPLES_MAX = 0.05, 400
_PIECE_SAMPLES = 20
# Limits are exceeded by more than this: programs plan up to them, and messages round.
_ROUNDING = 1.02
# A trajectory that would have to be slowed down further is not what was meant.
_SLOWER_MAX = 20.0
# Slower than this it ends at rest.
_RESTS_M_S = 0.02
# Times for which a trajectory is joined, the shortest first.
_JOINS_S = (0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
_SAME_M, _SAME_M_S, _SAME_M_S2 = 1e-3, 1e-3, 1e-2
# While a trajectory is joined, the limits may be exceeded by this share.
_JOIN_SHARE = 1.1


@dataclass(frozen=True)
class TrajectoryFault:
    """Why a trajectory cannot be flown: a sentence that names the point and the limit."""

    text: str


@dataclass(frozen=True)
class TimedTrajectory:
    """A trajectory that can be flown.

    Attributes:
        trajectory: the motion, with the brake at its end if it does not end at rest.
        times_s: of its points, from 0 on.
        yaw: along it; None for the direction of travel.
        ends_at_rest: whether it was planned to end at rest.
        slower: how many times slower it is than it was planned; 1 if it is not.
        why_slower: the limit for which it is slower, a sentence; empty if it is not.
        begins_s: moment from which its time counts; None for at once.
    """

    trajectory: Trajectory
    times_s: tuple[float, ...]
    yaw: TimedYaw | None = None
    ends_at_rest: bool = True
    slower: float = 1.0
    why_slower: str = ""
    begins_s: float | None = None

    def yaw_at(self, time_s: float) -> float | None:
        """Return the yaw at a time of the trajectory; None for the direction of travel."""
        return None if self.yaw is None else self.yaw.at(time_s)

    def begun_s(self, now: float) -> float:
        """Return the time of the trajectory at a moment; below 0 before it begins."""
        return 0.0 if self.begins_s is None else (now - self.begins_s) / self.slower


Planned: TypeAlias = TimedTrajectory | TrajectoryFault


def plan_timed(points: Sequence[TimedPoint], limits: Limits, may_slow_down: bool) -> Planned:
    """Return the motion through points, or why there is none that keeps the limits.

    Args:
        points: the points, times rising; those of the result count from the first.
        limits: speeds, accelerations and yaw rate that are kept.
        may_slow_down: whether it may be made slower as a whole to keep them.
    """
    fault = _check_points(points)
    if fault is not None:
        return fault
    begin_s = points[0].time_s
    points = [replace(point, time_s=point.time_s - begin_s) for point in points]
    piece = _through(points, limits)
    slower, text = _exceeded(points, piece, limits)
    if not text:
        return _with_stop(points, piece)
    if not may_slow_down:
        return TrajectoryFault(f"{text} Plan it slower, or allow it with may_slow_down.")
    if not slower <= _SLOWER_MAX:
        return TrajectoryFault(f"{text} It would have to be {slower:.0f} times slower.")
    points = [_slower(point, slower) for point in points]
    slowed = _with_stop(points, _through(points, limits))
    return replace(slowed, slower=slower, why_slower=text)


def join(
    start: KinematicState, timed: TimedTrajectory, from_s: float, limits: Limits
) -> tuple[Trajectory, float] | None:
    """Return a motion from a state into a trajectory, and along it to its end.

    The shortest lead-in that keeps the limits is taken. It takes the longer, the slower it begins:
    from rest it lets the trajectory's first part be flown in twice its time.

    Args:
        start: the state.
        timed: the trajectory.
        from_s: where it is joined, or a little further on.
        limits: what is kept.

    Returns:
        The motion, and what to add to its time to get the trajectory's; None if there is none.
    """
    whole = timed.trajectory
    here = whole.sample(from_s)
    if _is_same(start, here):
        return whole.after(from_s), from_s
    planned_m_s = norm(here.velocity_enu_m_s)
    share = 1.0
    if planned_m_s > _RESTS_M_S:
        share = min(norm(start.velocity_enu_m_s) / planned_m_s, 1.0)
    for ahead_s in _JOINS_S:
        until_s = min(from_s + ahead_s, whole.duration_s)
        duration_s = max((until_s - from_s) * 2.0 / (1.0 + share), ahead_s)
        piece = between(start, whole.sample(until_s), duration_s, limits)
        if _keeps(piece.samples(np.linspace(0.0, duration_s, 20)), limits):
            return whole.after(until_s, piece), until_s - duration_s
    return None


def _is_same(a: KinematicState, b: KinematicState) -> bool:
    return (
        distance(a.position_enu_m, b.position_enu_m) < _SAME_M
        and distance(a.velocity_enu_m_s, b.velocity_enu_m_s) < _SAME_M_S
        and distance(a.acceleration_enu_m_s2, b.acceleration_enu_m_s2) < _SAME_M_S2
    )


def _check_points(points: Sequence[TimedPoint]) -> TrajectoryFault | None:
    """Return the first fault of points that has nothing to do with limits, or None."""
    count = len(points)
    if not 2 <= count <= POINTS_MAX:
        return TrajectoryFault(f"It has {count} points; give 2 to {POINTS_MAX}.")
    first = points[0]
    if first.acceleration_enu_m_s2 is not None and first.velocity_enu_m_s is None:
        return TrajectoryFault("Point 0 has an acceleration, but no velocity; give both.")
    before_s = -math.inf
    for number, point in enumerate(points):
        text = _fault(point, points[0], before_s)
        if text:
            return TrajectoryFault(f"Point {number} {text}.")
        before_s = point.time_s
    if points[-1].time_s - points[0].time_s > DURATION_MAX_S:
        return TrajectoryFault(f"It lasts longer than {DURATION_MAX_S:g} s.")
    return None


def _fault(point: TimedPoint, first: TimedPoint, before_s: float) -> str:
    """Return what is wrong with a point beside the first and the time before; or nothing."""
    if not _is_sound(point):
        return f"has a number that is not finite, or beyond {_NUMBER_MAX:g}"
    if point.time_s < 0.0:
        return f"has the time {point.time_s:g} s; give 0 or more"
    if point.time_s < before_s + _STEP_MIN_S:
        return f"comes {point.time_s - before_s:g} s after the one before; times must rise"
    for name, one, other in (
        ("a velocity", point.velocity_enu_m_s, first.velocity_enu_m_s),
        ("an acceleration", point.acceleration_enu_m_s2, first.acceleration_enu_m_s2),
        ("a rotation", point.yaw_enu_rad, first.yaw_enu_rad),
    ):
        if (one is None) is not (other is None):
            return f"differs from point 0 in whether it has {name}"
    return ""


def _is_sound(point: TimedPoint) -> bool:
    vectors = [point.position_enu_m, point.velocity_enu_m_s, point.acceleration_enu_m_s2]
    numbers = [n for vector in vectors if vector is not None for n in vector]
    numbers += [
        point.time_s,
        point.yaw_rate_rad_s,
        0.0 if point.yaw_enu_rad is None else point.yaw_enu_rad,
    ]
    return is_finite(point.position_enu_m) and all(abs(n) <= _NUMBER_MAX for n in numbers)


def _through(points: Sequence[TimedPoint], limits: Limits) -> PolynomialPiece:
    """Return the motion through sound points whose times begin at 0."""
    times_s = np.array([point.time_s for point in points])
    positions = np.array([point.position_enu_m for point in points])
    accelerations = None
    if points[0].velocity_enu_m_s is None:
        velocities = spline_velocities(times_s, positions)
    else:
        velocities = np.array([point.velocity_enu_m_s for point in points])
    if points[0].acceleration_enu_m_s2 is not None:
        accelerations = np.array([point.acceleration_enu_m_s2 for point in points])
    return through(times_s, positions, velocities, accelerations, limits)


def _with_stop(points: Sequence[TimedPoint], piece: PolynomialPiece) -> TimedTrajectory:
    """Return a motion within the limits with the brake at its end, if it does not end at rest."""
    last, limits = points[-1].position_enu_m, piece.limits
    end = replace(piece.end, position_enu_m=last)
    motion = Trajectory(piece.sample(0.0), last, piece.duration_s, limits, (piece,))
    rests = norm(end.velocity_enu_m_s) <= _RESTS_M_S
    if not rests:
        x, y, z = end.acceleration_enu_m_s2
        east, north, _ = limit_norm((x, y, 0.0), limits.acceleration_horizontal_m_s2)
        most = limits.acceleration_vertical_m_s2
        end = replace(end, acceleration_enu_m_s2=(east, north, min(max(z, -most), most)))
        motion = motion.then(plan_stop(end, limits))
    times_s = tuple(point.time_s for point in points)
    return TimedTrajectory(motion, times_s, TimedYaw.of(points), rests)


def _slower(point: TimedPoint, slower: float) -> TimedPoint:
    velocity, acceleration = point.velocity_enu_m_s, point.acceleration_enu_m_s2
    return replace(
        point,
        time_s=point.time_s * slower,
        yaw_rate_rad_s=point.yaw_rate_rad_s / slower,
        velocity_enu_m_s=None if velocity is None else scale(velocity, 1.0 / slower),
        acceleration_enu_m_s2=(
            None if acceleration is None else scale(acceleration, 1.0 / (slower * slower))
        ),
    )


def _measures(samples: tuple[Array, Array, Array]) -> tuple[Array, ...]:
    """Return speed over ground, climb, descent, and both accelerations of samples."""
    _, velocities, accelerations = samples
    return (
        np.hypot(velocities[:, 0], velocities[:, 1]),
        velocities[:, 2],
        -velocities[:, 2],
        np.hypot(accelerations[:, 0], accelerations[:, 1]),
        np.abs(accelerations[:, 2]),
    )


def _bounds(limits: Limits) -> tuple[tuple[str, float, str, int], ...]:
    """Return for each measure its name, its limit, its unit, and its power of time."""
    return (
        ("flies", limits.speed_horizontal_m_s, "m/s over ground", 1),
        ("climbs", limits.speed_up_m_s, "m/s", 1),
        ("descends", limits.speed_down_m_s, "m/s", 1),
        ("accelerates", limits.acceleration_horizontal_m_s2, "m/s2 over ground", 2),
        ("accelerates", limits.acceleration_vertical_m_s2, "m/s2 up or down", 2),
    )


def _keeps(samples: tuple[Array, Array, Array], limits: Limits) -> bool:
    return all(
        bool((measure <= _JOIN_SHARE * bound).all())
        for measure, (_, bound, _, _) in zip(_measures(samples), _bounds(limits), strict=True)
    )


def _looked_at_s(point_times_s: Sequence[float]) -> Array:
    """Return times at which limits are looked at: often, and often within each piece."""
    pieces, end_s = len(point_times_s) - 1, point_times_s[-1]
    count = min(math.ceil(end_s / _SAMPLE_S), _SAMPLES_MAX * pieces)
    evenly = np.linspace(0.0, end_s, count + 1)
    within = np.linspace(0.0, pieces, _PIECE_SAMPLES * pieces + 1)
    return np.concatenate((evenly, np.interp(within, np.arange(pieces + 1), point_times_s)))


def _exceeded(
    points: Sequence[TimedPoint], piece: PolynomialPiece, limits: Limits
) -> tuple[float, str]:
    """Return how many times slower it must be, and the worst excess; 1 and no text for none."""
    slower, text = 1.0, ""
    point_times_s = [point.time_s for point in points]
    times_s = _looked_at_s(point_times_s)
    measures = _measures(piece.samples(times_s))
    for measure, (verb, bound, unit, power) in zip(measures, _bounds(limits), strict=True):
        row = int(np.argmax(measure))
        value = float(measure[row])
        factor = (value / bound) ** (1.0 / power) if value > 0.0 else 0.0
        if value > _ROUNDING * bound and factor > slower:
            number = min(bisect_right(point_times_s, float(times_s[row])), len(points) - 1)
            slower = factor
            text = (
                f"It {verb} with {value:.2f} {unit} up to point {number}; the limit is {bound:g}."
            )
    yaw = TimedYaw.of(points)
    for number, rate in enumerate(() if yaw is None else yaw.greatest_rates(), 1):
        factor = rate / limits.yaw_rate_rad_s
        if factor > _ROUNDING and factor > slower:
            slower = factor
            text = (
                f"It turns with {math.degrees(rate):.0f} degrees/s up to point {number}; the "
                f"limit is {math.degrees(limits.yaw_rate_rad_s):.0f}."
            )
    return slower, text
