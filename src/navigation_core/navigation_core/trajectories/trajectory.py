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
smaller limits: ``docs/adr/0003-ruckig-trajectories.md``.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    across,
    distance,
    horizontal_norm,
    norm,
    unit_between,
)
from navigation_core.limits import Limits, LimitsError
from navigation_core.trajectories.fastest_turn import total_duration_s, turn_and_straight
from navigation_core.trajectories.motions import (
    TINY_M_S,
    TINY_M_S2,
    Array,
    MotionPiece,
    change_velocity,
    plan_straight,
    relaxed_velocity,
)
from navigation_core.trajectories.overlaps import Piece
from navigation_core.trajectories.polynomials import LaterPart
from navigation_core.trajectories.profiles import TrajectoryError

__all__ = ["Limits", "LimitsError", "Trajectory", "TrajectoryError", "plan_stop", "plan_to"]

# A start may be this much faster than the limit before it is braked first.
_OVERSPEED = 1e-4
# Steps in which the length of a path is measured. Linear between them, the error is a few
# millimetres at usual accelerations.
_LENGTH_STEP_S = 0.1
_LENGTH_STEPS_MAX = 1000
# Steps in which a path is shown to people and programs.
_PATH_STEP_S = 0.5
_PATH_POINTS_MAX = 500


@dataclass(frozen=True)
class Trajectory:
    """A motion over time that ends in a standstill.

    Attributes:
        start: state at its beginning.
        end_position_enu_m: where it comes to rest.
        duration_s: time it takes.
        limits: what its end was planned with; see :meth:`at`.
    """

    start: KinematicState
    end_position_enu_m: Vector3
    duration_s: float
    limits: Limits
    _pieces: tuple[Piece, ...]

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time; before the beginning and after the end it is clamped.

        Args:
            t_s: time since the beginning of the trajectory.
        """
        return self.at(t_s)[0]

    def at(self, t_s: float) -> tuple[KinematicState, Limits]:
        """Return the state at a time, as :meth:`sample` does, and what it was planned with.

        A route may be slower on one of its legs.
        """
        since_s = t_s
        for piece in self._pieces:
            if since_s < piece.duration_s:
                return (piece.sample(since_s) if t_s > 0.0 else self.start), piece.limits
            since_s -= piece.duration_s
        end = KinematicState(self.end_position_enu_m)
        return (end if t_s > 0.0 else self.start), self.limits

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the states at many times: positions, velocities and accelerations, all (N, 3).

        Args:
            times_s: rising, shape (N,); clamped as in :meth:`sample`.
        """
        ends_s = np.cumsum([piece.duration_s for piece in self._pieces])
        bounds = [int(np.searchsorted(times_s, 0.0, side="right"))]
        bounds += np.searchsorted(times_s, ends_s).tolist()
        positions, velocities, accelerations = np.zeros((3, len(times_s), 3))
        first = bounds[0]
        positions[:first] = self.start.position_enu_m
        velocities[:first] = self.start.velocity_enu_m_s
        accelerations[:first] = self.start.acceleration_enu_m_s2
        begin_s = 0.0
        for piece, end_s, (low, high) in zip(
            self._pieces, ends_s, itertools.pairwise(bounds), strict=True
        ):
            if high > low:
                part = slice(low, high)
                positions[part], velocities[part], accelerations[part] = piece.samples(
                    times_s[part] - begin_s
                )
            begin_s = float(end_s)
        positions[max(bounds) :] = self.end_position_enu_m
        return positions, velocities, accelerations

    def then(self, following: Trajectory) -> Trajectory:
        """Return this motion and, from its standstill on, another one."""
        return Trajectory(
            self.start,
            following.end_position_enu_m,
            self.duration_s + following.duration_s,
            following.limits,
            self._pieces + following._pieces,
        )

    def after(self, t_s: float, lead_in: Piece | None = None) -> Trajectory:
        """Return what is left of it at a time, with another motion before that.

        Args:
            t_s: the time, clamped as in :meth:`sample`.
            lead_in: a motion that ends in the state at that time; None for none.
        """
        left: list[Piece] = [] if lead_in is None else [lead_in]
        since_s = max(t_s, 0.0)
        for piece in self._pieces:
            if since_s < piece.duration_s:
                left.append(LaterPart(piece, since_s) if since_s > 0.0 else piece)
            since_s = max(since_s - piece.duration_s, 0.0)
        start = self.sample(t_s) if lead_in is None else lead_in.sample(0.0)
        duration_s = total_duration_s(left)
        return Trajectory(start, self.end_position_enu_m, duration_s, self.limits, tuple(left))

    def remaining_distance_m(self, t_s: float) -> float:
        """Return the length of the path that lies ahead at a time; it never grows."""
        if t_s >= self.duration_s:
            return 0.0
        lengths = self._lengths_ahead
        place = max(t_s, 0.0) / self.duration_s * (len(lengths) - 1)
        index = min(int(place), len(lengths) - 2)
        here, ahead = lengths[index], lengths[index + 1]
        return here + (ahead - here) * (place - index)

    @property
    def path_enu_m(self) -> tuple[Vector3, ...]:
        """Points along the path, from its beginning to its end."""
        count = min(max(math.ceil(self.duration_s / _PATH_STEP_S), 1), _PATH_POINTS_MAX)
        times_s = np.linspace(0.0, self.duration_s, count, endpoint=False)
        points = [(x, y, z) for x, y, z in self.samples(times_s)[0].tolist()]
        return (*points, self.end_position_enu_m)

    @cached_property
    def _lengths_ahead(self) -> array[float]:
        """Lengths of the path that lies ahead, at equal steps of time."""
        count = min(max(int(self.duration_s / _LENGTH_STEP_S), 1), _LENGTH_STEPS_MAX)
        points = self.samples(np.linspace(0.0, self.duration_s, count, endpoint=False))[0]
        steps = np.diff(points, axis=0, append=[self.end_position_enu_m])
        ahead_m = np.cumsum(np.linalg.norm(steps[::-1], axis=1))[::-1]
        return array("d", [*ahead_m.tolist(), 0.0])


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
    check_finite(start, goal_enu_m)
    pieces = lead_in(start, goal_enu_m, limits)
    state = pieces[-1].end if pieces else start
    pieces.append(plan_straight(state, goal_enu_m, limits))
    return assemble(start, goal_enu_m, limits, pieces)


def lead_in(start: KinematicState, goal_enu_m: Vector3, limits: Limits) -> list[MotionPiece]:
    """Plan what comes before the straight line to a point: a brake and a turn, if need be.

    Raises:
        TrajectoryError: Ruckig finds no solution.
    """
    pieces: list[MotionPiece] = []
    state = start
    unavoidable = relaxed_velocity(state, limits)
    if _is_too_fast(unavoidable, limits):
        target = limits.clip_velocity(unavoidable)
        pieces.append(change_velocity(state, target, limits))
        state = pieces[-1].end
    if not _moves_along(state, unit_between(state.position_enu_m, goal_enu_m)):
        pieces.extend(turn_and_straight(state, goal_enu_m, limits)[:-1])
    return pieces


def plan_stop(start: KinematicState, limits: Limits) -> Trajectory:
    """Plan the brake from any state to a standstill, as fast as the limits allow.

    Raises:
        TrajectoryError: the input is not finite, or Ruckig finds no solution.
    """
    check_finite(start, start.position_enu_m)
    piece = change_velocity(start, ZERO, limits)
    return assemble(start, piece.end.position_enu_m, limits, [piece])


def assemble(
    start: KinematicState, end_enu_m: Vector3, limits: Limits, pieces: Sequence[Piece]
) -> Trajectory:
    """Put pieces together that end in a standstill.

    Raises:
        TrajectoryError: they do not end where they should.
    """
    duration_s = total_duration_s(pieces)
    error_m = distance(pieces[-1].end.position_enu_m, end_enu_m)
    if not (math.isfinite(duration_s) and error_m < 1e-3):
        raise TrajectoryError(
            f"The trajectory of {duration_s} s ends {error_m} m off its goal {end_enu_m} m; "
            "hold and report this."
        )
    return Trajectory(start, end_enu_m, duration_s, limits, tuple(pieces))


def check_finite(start: KinematicState, goal_enu_m: Vector3) -> None:
    """Reject numbers that are NaN or infinite.

    Raises:
        TrajectoryError: says which.
    """
    if not (start.is_finite and all(math.isfinite(value) for value in goal_enu_m)):
        raise TrajectoryError(
            f"Cannot plan from {start} to {goal_enu_m} m: a number is NaN or infinite."
        )


def _is_too_fast(velocity: Vector3, limits: Limits) -> bool:
    margin = 1.0 + _OVERSPEED
    return (
        horizontal_norm(velocity) > limits.speed_horizontal_m_s * margin
        or velocity[2] > limits.speed_up_m_s * margin
        or -velocity[2] > limits.speed_down_m_s * margin
    )


def _moves_along(state: KinematicState, direction: Vector3 | None) -> bool:
    """Whether a state rests or moves on the line through it along ``direction``."""
    velocity, acceleration = state.velocity_enu_m_s, state.acceleration_enu_m_s2
    if direction is not None:
        velocity, acceleration = across(velocity, direction), across(acceleration, direction)
    return norm(velocity) < TINY_M_S and norm(acceleration) < TINY_M_S2
