"""Jerk-limited profiles of motion on single axes, and the solver that calculates them.

Ruckig is that solver where it is installed. It is no package of Ubuntu's, so a Python without it
calculates the same with its own means, slower.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from navigation_core.limits import AxisLimits

__all__ = ["MotionProfile", "Solver", "TrajectoryError"]


class TrajectoryError(RuntimeError):
    """No trajectory could be calculated from the given state; the vehicle should hold."""


class Phases(Protocol):
    """Times of steady jerk on one axis: K of them, of which some may last no time.

    Attributes:
        t: how long each lasts, in seconds.
        j: jerk in each, in m/s3.
        p: position at the beginning of each, in metres, and for all but `Brake` at the end, too.
        v: the same for the velocity, in m/s.
        a: the same for the acceleration, in m/s2.
    """

    @property
    def t(self) -> Sequence[float]: ...
    @property
    def j(self) -> Sequence[float]: ...
    @property
    def p(self) -> Sequence[float]: ...
    @property
    def v(self) -> Sequence[float]: ...
    @property
    def a(self) -> Sequence[float]: ...


class Brake(Phases, Protocol):
    """Up to two phases that bring a start beyond the limits back to them."""

    @property
    def duration(self) -> float: ...


class AxisProfile(Phases, Protocol):
    """The motion on one axis, after its brake."""

    @property
    def brake(self) -> Brake: ...


class Extrema(Protocol):
    """Bounds of a position during a motion, in metres."""

    @property
    def max(self) -> float: ...


class MotionProfile(Protocol):
    """A motion on one or several axes."""

    @property
    def duration(self) -> float:
        """In seconds, of the axis that takes longest."""
        ...

    @property
    def profiles(self) -> Sequence[Sequence[AxisProfile]]:
        """For each section, of which there is one, the motion on each axis."""
        ...

    @property
    def position_extrema(self) -> Sequence[Extrema]:
        """Bounds of the position on each axis.

        Ruckig 0.19's are too small for many starts that pass their target, by up to half of what
        they pass it by; that they pass it is to be seen from them all the same.
        """
        ...

    def at_time(self, t_s: float, /) -> tuple[list[float], list[float], list[float]]:
        """Return positions, velocities and accelerations on all axes."""
        ...


class Solver(Protocol):
    """Calculates profiles that begin at position 0 and end without acceleration.

    Attributes:
        NOTE: a sentence for users about what is used; empty for Ruckig.
    """

    NOTE: str

    def to_velocity(
        self,
        velocity_m_s: list[float],
        acceleration_m_s2: list[float],
        target_m_s: list[float],
        limits: list[AxisLimits],
    ) -> MotionProfile:
        """Reach a velocity on each axis as fast as it goes, wherever that ends.

        Raises:
            TrajectoryError: there is no solution.
        """
        ...

    def to_position(
        self,
        velocity_m_s: float,
        acceleration_m_s2: float,
        target_m: float,
        target_m_s: float,
        limits: AxisLimits,
    ) -> MotionProfile:
        """Reach a position with a velocity, on one axis.

        Raises:
            TrajectoryError: there is no solution.
        """
        ...
