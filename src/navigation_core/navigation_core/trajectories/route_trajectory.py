"""Trajectories through several points without a stop, on the same motions as to one.

A corner is a change of velocity along the chord between the two directions, at one speed.
Such a turn is symmetric: it begins as far before the corner as it ends behind it, and in its
middle it is nearest to the corner, on the chord through it. So its speed follows from how
far from the corner the path may pass, and the straight lines between the turns are motions
along one axis. A turn begins while the brake before it ends, and the next line while the turn ends.
Position, velocity and acceleration are continuous throughout, and the path never leaves the lines
by more than what is allowed at a corner.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    distance,
    dot,
    norm,
    scale,
    subtract,
    unit_between,
)
from navigation_core.limits import Limits
from navigation_core.trajectories.fastest_turn import total_duration_s
from navigation_core.trajectories.motions import (
    TINY_M,
    TINY_S,
    MotionPiece,
    change_along,
    plan_straight,
    speed_change_m,
)
from navigation_core.trajectories.overlaps import in_a_row, overlap_s
from navigation_core.trajectories.profiles import TrajectoryError
from navigation_core.trajectories.trajectory import (
    Trajectory,
    assemble,
    check_finite,
    lead_in,
    plan_to,
)

# Slower than this, a corner is a stop.
_SPEED_MIN_M_S = 0.05
_HALVINGS = 14
# Ruckig wants a little room for a change of speed, and for the speed at its end.
_ROOM_M = 0.01
_SPEED_SHARE = 0.999
# Share of a leg that the turn at one of its ends may take.
_LEG_SHARE = 0.5


@dataclass(frozen=True)
class RoutePoint:
    """One point of a route.

    Attributes:
        position_enu_m: where, in the map frame.
        corner_m: how far from the point the path may pass; 0 stops there. The last point is
            always a stop.
        limits: what to keep to on the way to it.
    """

    position_enu_m: Vector3
    corner_m: float
    limits: Limits


@dataclass(frozen=True)
class RouteTrajectory:
    """A trajectory through several points.

    Attributes:
        trajectory: the motion.
        passed_s: when each point is passed, in trajectory time.
    """

    trajectory: Trajectory
    passed_s: tuple[float, ...]


@dataclass(frozen=True)
class _Leg:
    direction: Vector3
    length_m: float
    limits: Limits

    @property
    def speed_m_s(self) -> float:
        return _SPEED_SHARE * self.limits.along(self.direction).speed_forward_m_s


def plan_route(start: KinematicState, points: Sequence[RoutePoint]) -> RouteTrajectory:
    """Plan from any state through points to a standstill at the last.

    Args:
        start: state at the beginning, in the map frame.
        points: at least one.

    Raises:
        TrajectoryError: the input is not finite or empty, or Ruckig finds no solution.
    """
    if not points:
        raise TrajectoryError("A route needs at least one point; hold and report this.")
    for point in points:
        check_finite(start, point.position_enu_m)
    lead = lead_in(start, points[0].position_enu_m, points[0].limits)
    state = lead[-1].end if lead else start
    legs = _legs(state.position_enu_m, points)
    corners = None if legs is None else _choose_corners(state, points, legs)
    if legs is None or corners is None:
        return _stop_first(start, points)
    row: list[tuple[MotionPiece, float]] = []
    before: MotionPiece | None = None
    passed_s = []
    time_s = total_duration_s(lead)
    for point, leg, corner in zip(points, legs, corners, strict=True):
        to = add(point.position_enu_m, scale(leg.direction, -corner.reach_m))
        turn = None if corner.turn is None else _turn_at(to, leg, corner.speed_m_s, corner.turn)
        straight, early_s, turn_early_s = _straight(state, to, leg, corner, before, turn)
        row.append((straight, early_s))
        time_s += straight.duration_s - early_s
        passed_s.append(time_s)
        state = straight.end
        if turn is not None:
            row.append((turn, turn_early_s))
            time_s += turn.duration_s - turn_early_s
            passed_s[-1] = time_s - 0.5 * turn.duration_s
            state = turn.end
        before = turn
    last = points[-1]
    trajectory = assemble(start, last.position_enu_m, last.limits, [*lead, *in_a_row(row)])
    return RouteTrajectory(trajectory, tuple(passed_s))


def _straight(
    state: KinematicState,
    to_enu_m: Vector3,
    leg: _Leg,
    corner: _Corner,
    before: MotionPiece | None,
    after: MotionPiece | None,
) -> tuple[MotionPiece, float, float]:
    """Plan a straight line from one turn to the next, each of which it may overlap.

    With an overlap it begins farther back and ends farther ahead: the turns stay where they are.

    Returns:
        The motion, and how long it and the turns before and after it overlap.
    """
    alone = plan_straight(state, to_enu_m, leg.limits, corner.speed_m_s)
    early_s, late_s = _overlaps_s(before, alone, after)
    if early_s == late_s == 0.0:
        return alone, 0.0, 0.0
    begin_enu_m = subtract(state.position_enu_m, scale(state.velocity_enu_m_s, early_s))
    to_enu_m = add(to_enu_m, scale(leg.direction, corner.speed_m_s * late_s))
    begin = replace(state, position_enu_m=begin_enu_m)
    longer = plan_straight(begin, to_enu_m, leg.limits, corner.speed_m_s)
    has_s = _overlaps_s(before, longer, after)
    if has_s[0] < early_s - TINY_S or has_s[1] < late_s - TINY_S:
        return alone, 0.0, 0.0
    return longer, early_s, late_s


def _overlaps_s(
    before: MotionPiece | None, straight: MotionPiece, after: MotionPiece | None
) -> tuple[float, float]:
    return (
        0.0 if before is None else overlap_s(before, straight),
        0.0 if after is None else overlap_s(straight, after),
    )


def _stop_first(start: KinematicState, points: Sequence[RoutePoint]) -> RouteTrajectory:
    """Plan with a stop at the first point: the start is too fast to take it as a corner."""
    first = plan_to(start, points[0].position_enu_m, points[0].limits)
    if len(points) == 1:
        return RouteTrajectory(first, (first.duration_s,))
    rest = plan_route(KinematicState(points[0].position_enu_m), points[1:])
    later = tuple(first.duration_s + time_s for time_s in rest.passed_s)
    return RouteTrajectory(first.then(rest.trajectory), (first.duration_s, *later))


def _legs(position_enu_m: Vector3, points: Sequence[RoutePoint]) -> list[_Leg] | None:
    """Return the straight lines between the points; None if two of them are the same."""
    legs = []
    for point in points:
        direction = unit_between(position_enu_m, point.position_enu_m)
        length_m = distance(position_enu_m, point.position_enu_m)
        if direction is None or length_m < TINY_M:
            return None
        legs.append(_Leg(direction, length_m, point.limits))
        position_enu_m = point.position_enu_m
    return legs


# --- corners ----------------------------------------------------------------------------


@dataclass(frozen=True)
class _Turn:
    """A change of direction: the velocity afterwards, and what it keeps to."""

    velocity_enu_m_s: Vector3
    limits: Limits


@dataclass(frozen=True)
class _Corner:
    """How a point is passed: at a speed, in a turn that begins `reach_m` before it, or a stop."""

    speed_m_s: float
    reach_m: float
    turn: _Turn | None


_STOP = _Corner(0.0, 0.0, None)


def _choose_corners(
    state: KinematicState, points: Sequence[RoutePoint], legs: Sequence[_Leg]
) -> list[_Corner] | None:
    """Choose how each point is passed, as fast as its corner and its neighbours allow.

    Returns:
        The corners; None if the start is too fast for the first of them.
    """
    pairs = list(itertools.pairwise(legs))
    corners = [
        _fastest(before, after, partial(_keeps_near, point.corner_m, before, after))
        for point, (before, after) in zip(points, pairs, strict=False)
    ]
    corners.append(_STOP)
    # Limit each corner's speed so that the vehicle can brake for the next one, from the end back.
    for i in range(len(pairs) - 1, -1, -1):
        sound = partial(_can_brake, legs[i + 1], corners[i + 1])
        corners[i] = _fastest(*pairs[i], sound, corners[i].speed_m_s)
    # Limit each corner's speed to what can be reached by speeding up, from the start forwards.
    speed_m_s = dot(state.velocity_enu_m_s, legs[0].direction)
    entry = _Corner(speed_m_s, 0.0, None)
    acceleration_m_s2 = dot(state.acceleration_enu_m_s2, legs[0].direction)
    if _room_m(legs[0], entry, corners[0], acceleration_m_s2) < 0.0 and (
        corners[0].speed_m_s < speed_m_s
    ):
        return None
    for i, pair in enumerate(pairs):
        sound = partial(_can_speed_up, legs[i], entry, acceleration_m_s2)
        corners[i] = _fastest(*pair, sound, corners[i].speed_m_s)
        entry, acceleration_m_s2 = corners[i], 0.0
    return corners


def _fastest(
    before: _Leg, after: _Leg, sound: Callable[[_Corner], bool], limit_m_s: float = math.inf
) -> _Corner:
    """Return the fastest corner between two legs that is sound; a stop if none is."""
    high = min(before.speed_m_s, after.speed_m_s, limit_m_s)
    best = _corner(before, after, high)
    if best is _STOP or sound(best):
        return best
    best, low = _STOP, 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        corner = _corner(before, after, middle)
        if corner is not _STOP and sound(corner):
            best, low = corner, middle
        else:
            high = middle
    return best


def _corner(before: _Leg, after: _Leg, speed_m_s: float) -> _Corner:
    if speed_m_s < _SPEED_MIN_M_S:
        return _STOP
    slower = min(before.limits, after.limits, key=lambda limits: limits.speed_horizontal_m_s)
    turn = _Turn(scale(after.direction, speed_m_s), slower)
    return _Corner(
        speed_m_s, 0.5 * speed_m_s * _turn_at(ZERO, before, speed_m_s, turn).duration_s, turn
    )


def _turn_at(place_enu_m: Vector3, before: _Leg, speed_m_s: float, turn: _Turn) -> MotionPiece:
    """Plan the turn out of a leg from a place on."""
    begin = KinematicState(place_enu_m, scale(before.direction, speed_m_s))
    return change_along(begin, turn.velocity_enu_m_s, turn.limits)


def _keeps_near(corner_m: float, before: _Leg, after: _Leg, corner: _Corner) -> bool:
    """Whether a turn stays near its corner and within its share of both legs."""
    if corner_m <= 0.0 or corner.turn is None:
        return False
    if corner.reach_m > _LEG_SHARE * min(before.length_m, after.length_m):
        return False
    piece = _turn_at(ZERO, before, corner.speed_m_s, corner.turn)
    middle = piece.sample(0.5 * piece.duration_s).position_enu_m
    return norm(subtract(middle, scale(before.direction, corner.reach_m))) <= corner_m


def _can_brake(leg: _Leg, following: _Corner, corner: _Corner) -> bool:
    return _room_m(leg, corner, following) >= 0.0


def _can_speed_up(leg: _Leg, entry: _Corner, acceleration_m_s2: float, corner: _Corner) -> bool:
    if corner.speed_m_s <= entry.speed_m_s:
        return True
    return _room_m(leg, entry, corner, acceleration_m_s2) >= 0.0


def _room_m(leg: _Leg, entry: _Corner, exit_: _Corner, acceleration_m_s2: float = 0.0) -> float:
    """Return what is left of a leg after the turns at its ends and the change of speed."""
    change_m = speed_change_m(
        leg.direction, entry.speed_m_s, exit_.speed_m_s, leg.limits, acceleration_m_s2
    )
    return leg.length_m - entry.reach_m - exit_.reach_m - change_m - _ROOM_M
