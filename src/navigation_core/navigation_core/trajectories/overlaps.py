"""Motions that begin before the ones ahead of them have ended.

Where one motion ends without acceleration and another begins without, both take their time to
let it go and to build it up. When both happen at once, the acceleration goes from the one to the
other in a straight line: it stays within limits that are convex, if each motion keeps to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    norm,
    scale,
    subtract,
)
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import TINY_M_S2, TINY_S, Array, MotionPiece

__all__ = ["Overlap", "Piece", "in_a_row", "overlap_s"]

# Of both jerks together, beyond the greater one.
_JERK_SHARE = 1.01


@dataclass(frozen=True)
class Overlap:
    """The end of one motion and the beginning of another at once.

    The velocity is the one of the first, changed by as much as the second changes it.

    Attributes:
        first: its last part; it ends with the velocity that the second begins with.
        second: its first part, as long; it begins where the first would be then at its last
            velocity.
    """

    first: MotionPiece
    second: MotionPiece

    @property
    def duration_s(self) -> float:
        """That of both."""
        return self.first.duration_s

    @property
    def limits(self) -> Limits:
        """Those of the faster one: a brake has not ended yet, or speeding up has begun."""
        both = (self.first.limits, self.second.limits)
        return max(both, key=lambda limits: limits.speed_horizontal_m_s)

    @property
    def end(self) -> KinematicState:
        """State at its end."""
        return self.sample(self.duration_s)

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since its beginning."""
        one, other = self.first.sample(t_s), self.second.sample(t_s)
        begin = self.second.sample(0.0)
        steady = add(begin.position_enu_m, scale(begin.velocity_enu_m_s, t_s))
        return KinematicState(
            add(one.position_enu_m, subtract(other.position_enu_m, steady)),
            add(one.velocity_enu_m_s, subtract(other.velocity_enu_m_s, begin.velocity_enu_m_s)),
            add(one.acceleration_enu_m_s2, other.acceleration_enu_m_s2),
        )

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""
        one, other = self.first.samples(times_s), self.second.samples(times_s)
        begin = self.second.sample(0.0)
        velocity = begin.velocity_enu_m_s
        return (
            one[0] + other[0] - begin.position_enu_m - times_s[:, None] * velocity,
            one[1] + other[1] - velocity,
            one[2] + other[2],
        )


class Piece(Protocol):
    """A part of a trajectory, as `MotionPiece` and `Overlap` are."""

    @property
    def duration_s(self) -> float:
        """Its duration."""

    @property
    def limits(self) -> Limits:
        """The limits that it was planned with."""

    @property
    def end(self) -> KinematicState:
        """State at its end."""

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since its beginning."""

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""


def overlap_s(first: MotionPiece, second: MotionPiece) -> float:
    """Return how long a motion and the next one may overlap; 0 if they may not.

    While the acceleration of the first goes and that of the second comes, both at a steady jerk,
    and as long as both jerks together are no greater than one of them.
    """
    (lasts_s, leaving), (rises_s, coming) = _ramp(first, last=True), _ramp(second, last=False)
    if norm(add(leaving, coming)) > _JERK_SHARE * max(norm(leaving), norm(coming)):
        return 0.0
    return min(lasts_s, rises_s)


def _ramp(motion: MotionPiece, *, last: bool) -> tuple[float, Vector3]:
    """Return how long the acceleration changes evenly at an end of a motion, and its jerk.

    Only from or to no acceleration, and along one axis.
    """
    found: list[tuple[float, Vector3]] = []
    for profile, axis in zip(motion.profile.profiles[0], motion.axes_enu, strict=True):
        phases = [k for k, phase_s in enumerate(profile.t) if phase_s > TINY_S]
        if not phases:
            continue
        phase = phases[-1 if last else 0]
        jerk = profile.j[phase]
        if jerk and (last or (abs(profile.a[phase]) < TINY_M_S2 and not profile.brake.duration)):
            found.append((profile.t[phase], scale(axis, jerk)))
        else:
            return 0.0, ZERO
    return found[0] if len(found) == 1 else (0.0, ZERO)


def in_a_row(motions: Sequence[tuple[MotionPiece, float]]) -> list[Piece]:
    """Return the pieces of motions, of which each may overlap the one before it.

    Args:
        motions: each with how long it does so.
    """
    pieces: list[Piece] = []
    late_s = [early_s for _, early_s in motions[1:]] + [0.0]
    for number, ((motion, early_s), last_s) in enumerate(zip(motions, late_s, strict=True)):
        end_s = motion.duration_s - last_s
        pieces.append(replace(motion, begin_s=early_s, duration_s=max(end_s - early_s, 0.0)))
        if last_s > 0.0:
            first = replace(motion, begin_s=end_s, duration_s=last_s)
            second = replace(motions[number + 1][0], duration_s=last_s)
            pieces.append(Overlap(first, second))
    return pieces
