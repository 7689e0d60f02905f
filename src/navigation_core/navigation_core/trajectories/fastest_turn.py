"""The search for the fastest turn onto a line to the goal."""

from __future__ import annotations

import math
from collections.abc import Sequence

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    distance,
    horizontal_norm,
    norm,
    scale,
    unit_between,
)
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import (
    EAST,
    TINY_M,
    TINY_M_S,
    TINY_M_S2,
    MotionPiece,
    change_velocity,
    plan_straight,
    relax,
    relaxed_velocity,
)
from navigation_core.trajectories.overlaps import Piece
from navigation_core.trajectories.profiles import TrajectoryError

# Shares of the maximum speed at which a turn may end.
_TURN_FRACTIONS = (1.0, 0.85, 0.7, 0.55, 0.4, 0.28, 0.18, 0.1, 0.05, 0.0)
_TURN_REFINEMENTS = 5
_TURN_ITERATIONS = 20
# A step of the iteration must be this much smaller than the one before.
_TURN_CONVERGENCE = 0.8
_SPEED_SAMPLES = 32
_SPEED_TOLERANCE = 1e-4


def turn_and_straight(
    state: KinematicState, goal_enu_m: Vector3, limits: Limits
) -> list[MotionPiece]:
    """Plan a turn onto a line to the goal and the flight along it, as fast as it goes.

    Raises:
        TrajectoryError: Ruckig finds no solution.
    """
    plans = _turns(state, goal_enu_m, limits)
    if norm(state.acceleration_enu_m_s2) >= TINY_M_S2:
        # A turn that begins with an acceleration leaves the chord, and may be too fast.
        plans = [plan for plan in plans if _keeps_to_speed(plan[0], limits)]
        relaxation = relax(state, limits)
        relaxed = _turns(relaxation.end, goal_enu_m, limits)
        plans += [[relaxation, *plan] for plan in relaxed]
    return min(plans, key=total_duration_s)


def _turns(state: KinematicState, goal_enu_m: Vector3, limits: Limits) -> list[list[MotionPiece]]:
    """Plan turns that end at different speeds, each with its line to the goal."""
    found: dict[float, list[MotionPiece]] = {}

    def attempt(fraction: float) -> bool:
        try:
            pieces = _turn_at(state, goal_enu_m, limits, fraction)
        except TrajectoryError:
            return False  # One turn that Ruckig cannot solve is no reason to give up.
        if pieces is None:
            return False
        found[fraction] = pieces
        return True

    def fastest() -> float:
        return min(found, key=lambda fraction: total_duration_s(found[fraction]))

    for fraction in _TURN_FRACTIONS:
        # Below the fastest turn, slower turns only take longer.
        if attempt(fraction) and fastest() != fraction:
            break
    if not found:
        raise TrajectoryError(f"Ruckig finds no turn from {state} to {goal_enu_m} m.")
    low = fastest()
    index = _TURN_FRACTIONS.index(low)
    high = _TURN_FRACTIONS[index - 1] if index else low
    for _ in range(_TURN_REFINEMENTS if index else 0):
        middle = 0.5 * (low + high)
        if attempt(middle):
            low = middle
        else:
            high = middle
    return list(found.values())


def _turn_at(
    state: KinematicState, goal_enu_m: Vector3, limits: Limits, fraction: float
) -> list[MotionPiece] | None:
    """Plan a turn that ends at a share of the maximum speed.

    Where the turn ends decides where the line to the goal points, and that decides the
    turn: solved by fixed-point iteration.

    Returns:
        Turn and line; None if the speed is too high to come to rest at the goal without
        going past it, or the iteration does not settle.
    """
    direction = unit_between(state.position_enu_m, goal_enu_m) or EAST
    step_before = math.inf
    for _ in range(_TURN_ITERATIONS):
        speed = fraction * limits.along(direction).speed_forward_m_s
        turn = change_velocity(state, scale(direction, speed), limits)
        end = turn.end
        line = unit_between(end.position_enu_m, goal_enu_m)
        if line is None and speed > TINY_M_S:
            return None
        step = 0.0 if line is None else distance(line, direction)
        if step * speed < TINY_M_S:
            return _line_after(turn, end, goal_enu_m, limits)
        if line is None or step > _TURN_CONVERGENCE * step_before:
            return None
        direction, step_before = line, step
    return None


def _line_after(
    turn: MotionPiece, end: KinematicState, goal_enu_m: Vector3, limits: Limits
) -> list[MotionPiece] | None:
    """Add the line to the goal to a turn; None if it would go past the goal."""
    straight = plan_straight(end, goal_enu_m, limits)
    length_m = distance(end.position_enu_m, goal_enu_m)
    passes = straight.profile.position_extrema[0].max > length_m + TINY_M
    return None if passes else [turn, straight]


def _keeps_to_speed(turn: MotionPiece, limits: Limits) -> bool:
    """Whether the horizontal speed of a turn keeps to its limit, also if it is broken off.

    Checked is the velocity that is left once the acceleration has been taken away. So
    every state of every trajectory can be relaxed and turned again within the limits.
    """
    speed_max = limits.speed_horizontal_m_s * (1.0 + _SPEED_TOLERANCE)
    for i in range(1, _SPEED_SAMPLES):
        state = turn.sample(turn.duration_s * i / _SPEED_SAMPLES)
        if horizontal_norm(relaxed_velocity(state, limits)) > speed_max:
            return False
    return True


def total_duration_s(pieces: Sequence[Piece]) -> float:
    """Return how long a number of pieces take one after the other."""
    return math.fsum(piece.duration_s for piece in pieces)
