"""Jerk-limited trajectories from any state to a standstill, on Ruckig.

Ruckig (Berscheid and Kroeger, "Jerk-limited Real-time Trajectory Generation with
Arbitrary Target States", RSS 2021) limits every axis by itself, whereas a ground speed is
a norm over two axes. So a trajectory is put together from motions whose norm is known:

1. Only if the start is faster than the limits: a brake along the present velocity.
2. Only if the start does not move along the line to the goal: a turn. The velocity goes
   from the present one to one along the new line. Without an initial acceleration it
   does so along a straight chord in velocity space, and because a disc is convex, the
   horizontal speed along the chord never exceeds that of its ends.
3. A straight line to the goal: one axis, whose limits are those of its direction.

The speed at which the turn ends is searched for the shortest duration. Position, velocity
and acceleration are continuous throughout. Why this and not Ruckig on three axes with
smaller limits: ``docs/adr/0010-ruckig-trajectories.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import ruckig

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    across,
    add,
    distance,
    dot,
    horizontal_norm,
    norm,
    scale,
    subtract,
)
from navigation_core.limits import AxisLimits, Limits, LimitsError

__all__ = ["Limits", "LimitsError", "Trajectory", "TrajectoryError", "plan_stop", "plan_to"]

_UP: Vector3 = (0.0, 0.0, 1.0)
_EAST: Vector3 = (1.0, 0.0, 0.0)
# Below these, numbers count as zero: far under what a vehicle or its estimator resolves,
# far above what double precision leaves of a 10 km position.
_TINY_M = 1e-6
_TINY_M_S = 1e-6
_TINY_M_S2 = 1e-6
# A start may be this much faster than the limit before it is braked first.
_OVERSPEED = 1e-4
# A turn may be flown as one chord in space if the start hardly climbs or sinks. Otherwise
# the climb rate changes by itself, as fast as it may: a descent must not be drawn out by
# a long turn, because there is ground below.
_LEVEL_M_S = 0.1
# Shares of the greatest speed at which a turn may end.
_TURN_FRACTIONS = (1.0, 0.85, 0.7, 0.55, 0.4, 0.28, 0.18, 0.1, 0.05, 0.0)
_TURN_REFINEMENTS = 5
_TURN_ITERATIONS = 20
_LENGTH_SAMPLES = 64


class TrajectoryError(RuntimeError):
    """No trajectory could be calculated from the given state; the vehicle should hold."""


@dataclass(frozen=True)
class _Piece:
    """One Ruckig profile along fixed axes of the map frame.

    Attributes:
        origin_enu_m: where the profile's zero lies.
        axes_enu: unit vectors, one for each degree of freedom.
        profile: what Ruckig calculated.
        duration_s: its duration.
    """

    origin_enu_m: Vector3
    axes_enu: tuple[Vector3, ...]
    profile: ruckig.Trajectory
    duration_s: float

    def sample(self, t_s: float) -> KinematicState:
        positions, velocities, accelerations = self.profile.at_time(t_s)
        return KinematicState(
            add(self.origin_enu_m, self._combine(positions)),
            self._combine(velocities),
            self._combine(accelerations),
        )

    @property
    def end(self) -> KinematicState:
        return self.sample(self.duration_s)

    def _combine(self, values: list[float]) -> Vector3:
        x = y = z = 0.0
        for value, axis in zip(values, self.axes_enu, strict=True):
            x += value * axis[0]
            y += value * axis[1]
            z += value * axis[2]
        return (x, y, z)


@dataclass(frozen=True)
class Trajectory:
    """A motion over time that ends in a standstill.

    Attributes:
        start: state at its beginning.
        end_position_enu_m: where it comes to rest.
        duration_s: time it takes.
        limits: what it was planned with.
    """

    start: KinematicState
    end_position_enu_m: Vector3
    duration_s: float
    limits: Limits
    _pieces: tuple[_Piece, ...]

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time; before the beginning and after the end it is clamped.

        Args:
            t_s: time since the beginning of the trajectory.
        """
        if t_s <= 0.0:
            return self.start
        for piece in self._pieces:
            if t_s < piece.duration_s:
                return piece.sample(t_s)
            t_s -= piece.duration_s
        return KinematicState(self.end_position_enu_m)

    def remaining_distance_m(self, t_s: float) -> float:
        """Return the length of the path that lies ahead at a time."""
        times, lengths = self._length_table
        if t_s >= self.duration_s:
            return 0.0
        # Equal steps over the whole duration, so the next sample is found by division.
        index = max(0, min(int(t_s / self.duration_s * _LENGTH_SAMPLES), _LENGTH_SAMPLES - 1))
        here = self.sample(t_s).position_enu_m
        following = self.sample(times[index + 1]).position_enu_m
        return distance(here, following) + lengths[index + 1]

    @cached_property
    def _length_table(self) -> tuple[list[float], list[float]]:
        """Sample times, and the length of the path from each to the end."""
        times = [self.duration_s * i / _LENGTH_SAMPLES for i in range(_LENGTH_SAMPLES + 1)]
        points = [self.sample(t).position_enu_m for t in times]
        lengths = [0.0] * len(points)
        for i in range(len(points) - 2, -1, -1):
            lengths[i] = lengths[i + 1] + distance(points[i], points[i + 1])
        return times, lengths


def plan_to(start: KinematicState, goal_enu_m: Vector3, limits: Limits) -> Trajectory:
    """Plan a motion from any state to a standstill at a point.

    From rest, and from a motion along the line to the goal, the path is straight and
    minimal in time. From any other state it turns first. A start faster than the limits
    is braked first, as fast as acceleration and jerk allow; from then on the horizontal
    speed keeps to its limit.

    Args:
        start: state at the beginning, in the map frame.
        goal_enu_m: where to come to rest, in the map frame.
        limits: what to keep to.

    Raises:
        TrajectoryError: the input is not finite, or Ruckig finds no solution.
    """
    _check_finite(start, goal_enu_m)
    pieces: list[_Piece] = []
    state = start
    if _is_too_fast(state, limits):
        target = limits.clip_velocity(state.velocity_enu_m_s)
        pieces.append(_change_velocity(state, target, limits))
        state = pieces[-1].end
    if _moves_along(state, _direction(state.position_enu_m, goal_enu_m)):
        pieces.append(_straight(state, goal_enu_m, limits))
    else:
        pieces.extend(_turn_and_straight(state, goal_enu_m, limits))
    return _assemble(start, goal_enu_m, limits, pieces)


def plan_stop(start: KinematicState, limits: Limits) -> Trajectory:
    """Plan the brake from any state to a standstill, as fast as the limits allow.

    Raises:
        TrajectoryError: the input is not finite, or Ruckig finds no solution.
    """
    _check_finite(start, start.position_enu_m)
    piece = _change_velocity(start, ZERO, limits)
    return _assemble(start, piece.end.position_enu_m, limits, [piece])


def _assemble(
    start: KinematicState, end_enu_m: Vector3, limits: Limits, pieces: list[_Piece]
) -> Trajectory:
    duration_s = sum(piece.duration_s for piece in pieces)
    error_m = distance(pieces[-1].end.position_enu_m, end_enu_m)
    if not (math.isfinite(duration_s) and error_m < 1e-3):
        raise TrajectoryError(
            f"The trajectory of {duration_s} s ends {error_m} m off its goal {end_enu_m} m; "
            "hold and report this."
        )
    return Trajectory(start, end_enu_m, duration_s, limits, tuple(pieces))


def _check_finite(start: KinematicState, goal_enu_m: Vector3) -> None:
    if not (start.is_finite and all(math.isfinite(value) for value in goal_enu_m)):
        raise TrajectoryError(
            f"Cannot plan from {start} to {goal_enu_m} m: a number is NaN or infinite."
        )


def _is_too_fast(state: KinematicState, limits: Limits) -> bool:
    velocity = state.velocity_enu_m_s
    margin = 1.0 + _OVERSPEED
    return (
        horizontal_norm(velocity) > limits.speed_horizontal_m_s * margin
        or velocity[2] > limits.speed_up_m_s * margin
        or -velocity[2] > limits.speed_down_m_s * margin
    )


def _direction(origin_enu_m: Vector3, target_enu_m: Vector3) -> Vector3 | None:
    """Return the unit vector between two points; None if they are the same."""
    offset = subtract(target_enu_m, origin_enu_m)
    length = norm(offset)
    return None if length < _TINY_M else scale(offset, 1.0 / length)


def _moves_along(state: KinematicState, direction: Vector3 | None) -> bool:
    """Whether a state rests or moves on the line through it along ``direction``."""
    velocity, acceleration = state.velocity_enu_m_s, state.acceleration_enu_m_s2
    if direction is not None:
        velocity, acceleration = across(velocity, direction), across(acceleration, direction)
    return norm(velocity) < _TINY_M_S and norm(acceleration) < _TINY_M_S2


def _straight(state: KinematicState, goal_enu_m: Vector3, limits: Limits) -> _Piece:
    """Plan along the line to the goal, from a state that moves along it."""
    axis = _direction(state.position_enu_m, goal_enu_m) or _EAST
    axis_limits = limits.along(axis)
    request = ruckig.InputParameter(1)
    request.target_position = [distance(state.position_enu_m, goal_enu_m)]
    request.max_velocity = [axis_limits.speed_forward_m_s]
    request.min_velocity = [-axis_limits.speed_backward_m_s]
    return _solve(request, state, (axis,), (axis_limits,))


def _change_velocity(state: KinematicState, target_m_s: Vector3, limits: Limits) -> _Piece:
    """Plan from a state to a velocity without acceleration, wherever that ends."""
    axes = _turn_axes(state, subtract(target_m_s, state.velocity_enu_m_s))
    request = ruckig.InputParameter(len(axes))
    request.control_interface = ruckig.ControlInterface.Velocity
    request.synchronization = ruckig.Synchronization.No
    request.target_velocity = [dot(target_m_s, axis) for axis in axes]
    return _solve(request, state, axes, tuple(limits.along(axis) for axis in axes))


def _turn_axes(state: KinematicState, change_m_s: Vector3) -> tuple[Vector3, ...]:
    """Choose axes for a change of velocity: the chord in velocity space comes first."""
    chord = _direction(ZERO, change_m_s)
    if (
        chord is not None
        and abs(state.velocity_enu_m_s[2]) <= _LEVEL_M_S
        and norm(across(state.acceleration_enu_m_s2, chord)) < _TINY_M_S2
    ):
        # What does not change is carried on by a second axis.
        side = _direction(ZERO, across(state.velocity_enu_m_s, chord))
        return (chord,) if side is None else (chord, side)
    level = _direction(ZERO, (change_m_s[0], change_m_s[1], 0.0)) or _EAST
    return (level, (-level[1], level[0], 0.0), _UP)


def _solve(
    request: ruckig.InputParameter,
    state: KinematicState,
    axes: tuple[Vector3, ...],
    axis_limits: tuple[AxisLimits, ...],
) -> _Piece:
    """Fill in start and limits and let Ruckig calculate.

    Raises:
        TrajectoryError: Ruckig finds no solution.
    """
    request.current_position = [0.0] * len(axes)
    request.current_velocity = [dot(state.velocity_enu_m_s, axis) for axis in axes]
    request.current_acceleration = [dot(state.acceleration_enu_m_s2, axis) for axis in axes]
    request.max_acceleration = [limit.acceleration_m_s2 for limit in axis_limits]
    request.max_jerk = [limit.jerk_m_s3 for limit in axis_limits]
    profile = ruckig.Trajectory(len(axes))
    try:
        result = ruckig.Ruckig(len(axes)).calculate(request, profile)
    except ruckig.RuckigError as error:
        raise TrajectoryError(f"Ruckig refuses {request}: {error}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise TrajectoryError(f"Ruckig finds no trajectory ({result}) for {request}")
    return _Piece(state.position_enu_m, axes, profile, profile.duration)


def _turn_and_straight(state: KinematicState, goal_enu_m: Vector3, limits: Limits) -> list[_Piece]:
    """Plan a turn onto a line to the goal and the flight along it, as fast as it goes."""
    found: list[tuple[float, float, list[_Piece]]] = []

    def attempt(fraction: float) -> bool:
        pieces = _turn_at(state, goal_enu_m, limits, fraction)
        if pieces is not None:
            found.append((sum(piece.duration_s for piece in pieces), fraction, pieces))
        return pieces is not None

    for fraction in _TURN_FRACTIONS:
        attempt(fraction)
    _, low, _ = min(found, key=lambda item: item[0])
    index = _TURN_FRACTIONS.index(low)
    high = _TURN_FRACTIONS[index - 1] if index else low
    for _ in range(_TURN_REFINEMENTS if index else 0):
        middle = 0.5 * (low + high)
        if attempt(middle):
            low = middle
        else:
            high = middle
    return min(found, key=lambda item: item[0])[2]


def _turn_at(
    state: KinematicState, goal_enu_m: Vector3, limits: Limits, fraction: float
) -> list[_Piece] | None:
    """Plan a turn that ends at a share of the greatest speed.

    Where the turn ends decides where the line to the goal points, and that decides the
    turn: solved by fixed-point iteration.

    Returns:
        Turn and line; None if the speed is too high to come to rest at the goal without
        going past it, or the iteration does not settle.
    """
    direction = _direction(state.position_enu_m, goal_enu_m) or _EAST
    for _ in range(_TURN_ITERATIONS):
        speed = fraction * limits.along(direction).speed_forward_m_s
        turn = _change_velocity(state, scale(direction, speed), limits)
        end = turn.end
        line = _direction(end.position_enu_m, goal_enu_m)
        if line is None and speed > _TINY_M_S:
            return None
        if line is None or distance(line, direction) * speed < _TINY_M_S:
            straight = _straight(end, goal_enu_m, limits)
            length_m = distance(end.position_enu_m, goal_enu_m)
            passes = straight.profile.position_extrema[0].max > length_m + _TINY_M
            return None if passes else [turn, straight]
        direction = line
    return None
