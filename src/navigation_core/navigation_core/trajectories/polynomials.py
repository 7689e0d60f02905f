"""Motions whose coordinates are polynomials of time: between two states, and through points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import Array
from navigation_core.trajectories.overlaps import Piece

__all__ = ["LaterPart", "PolynomialPiece", "between", "spline_velocities"]

_DEGREE = 5


@dataclass(frozen=True, eq=False)
class PolynomialPiece:
    """A motion of degree five at most.

    Attributes:
        coefficients: shape (6, 3), of the powers of time from 0 on, map frame, metres and seconds.
        duration_s: its duration.
        limits: what it is flown within.
    """

    coefficients: Array
    duration_s: float
    limits: Limits

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since its beginning."""
        position, velocity, acceleration = (
            (float(row[0][0]), float(row[0][1]), float(row[0][2]))
            for row in self.samples(np.array([t_s]))
        )
        return KinematicState(position, velocity, acceleration)

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""
        powers = times_s[:, None] ** np.arange(_DEGREE + 1)
        first, second = self._derived
        return (
            np.asarray(powers @ self.coefficients),
            np.asarray(powers[:, :-1] @ first),
            np.asarray(powers[:, :-2] @ second),
        )

    @property
    def end(self) -> KinematicState:
        """State at its end."""
        return self.sample(self.duration_s)

    @cached_property
    def _derived(self) -> tuple[Array, Array]:
        """The coefficients of velocity and acceleration."""
        first = self.coefficients[1:] * np.arange(1, _DEGREE + 1)[:, None]
        return first, first[1:] * np.arange(1, _DEGREE)[:, None]


@dataclass(frozen=True)
class LaterPart:
    """The part of a motion that is left at a time.

    Attributes:
        whole: the motion.
        begin_s: the time.
    """

    whole: Piece
    begin_s: float

    @property
    def duration_s(self) -> float:
        """That of the part."""
        return self.whole.duration_s - self.begin_s

    @property
    def limits(self) -> Limits:
        """Those of the whole."""
        return self.whole.limits

    @property
    def end(self) -> KinematicState:
        """State at its end."""
        return self.whole.end

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since its beginning."""
        return self.whole.sample(self.begin_s + t_s)

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""
        return self.whole.samples(self.begin_s + times_s)


def between(
    start: KinematicState,
    end: KinematicState,
    duration_s: float,
    limits: Limits,
    with_accelerations: bool = True,
) -> PolynomialPiece:
    """Return the motion from one state to another.

    Args:
        start: the first state.
        end: the last state.
        duration_s: its duration, > 0.
        limits: what it is flown within.
        with_accelerations: whether the accelerations count, by a polynomial of degree five;
            otherwise it is of degree three.
    """
    p_0, v_0, a_0 = _rows(start)
    p_1, v_1, a_1 = _rows(end)
    t = duration_s
    coefficients = np.zeros((_DEGREE + 1, 3))
    coefficients[0], coefficients[1] = p_0, v_0
    if not with_accelerations:
        coefficients[2] = (3.0 * (p_1 - p_0) - (2.0 * v_0 + v_1) * t) / t**2
        coefficients[3] = (2.0 * (p_0 - p_1) + (v_0 + v_1) * t) / t**3
        return PolynomialPiece(coefficients, t, limits)
    coefficients[2] = 0.5 * a_0
    # The lack at the end of position, velocity and acceleration.
    place = p_1 - p_0 - v_0 * t - 0.5 * a_0 * t**2
    speed = v_1 - v_0 - a_0 * t
    change = a_1 - a_0
    coefficients[3] = (10.0 * place - 4.0 * speed * t + 0.5 * change * t**2) / t**3
    coefficients[4] = (-15.0 * place + 7.0 * speed * t - change * t**2) / t**4
    coefficients[5] = (6.0 * place - 3.0 * speed * t + 0.5 * change * t**2) / t**5
    return PolynomialPiece(coefficients, t, limits)


def spline_velocities(times_s: Sequence[float], positions_enu_m: Sequence[Vector3]) -> Array:
    """Return the velocities of the cubic spline through points that begins and ends at rest.

    Its acceleration is continuous (natural in each inner point).

    Args:
        times_s: rising, at least two.
        positions_enu_m: as many.

    Returns:
        Shape (N, 3).
    """
    steps = np.diff(np.array(times_s))
    places = np.array(positions_enu_m)
    slopes = np.diff(places, axis=0) / steps[:, None]
    velocities = np.zeros_like(places)
    count = len(times_s)
    # Tridiagonal: forwards once, then back.
    ratios, values = np.zeros(count), np.zeros_like(places)
    for i in range(1, count - 1):
        before, after = 1.0 / steps[i - 1], 1.0 / steps[i]
        diagonal = 2.0 * (before + after) - before * ratios[i - 1]
        ratios[i] = after / diagonal
        right = 3.0 * (slopes[i - 1] * before + slopes[i] * after)
        values[i] = (right - before * values[i - 1]) / diagonal
    for i in range(count - 2, 0, -1):
        velocities[i] = values[i] - ratios[i] * velocities[i + 1]
    return velocities


def _rows(state: KinematicState) -> tuple[Array, Array, Array]:
    return (
        np.array(state.position_enu_m),
        np.array(state.velocity_enu_m_s),
        np.array(state.acceleration_enu_m_s2),
    )
