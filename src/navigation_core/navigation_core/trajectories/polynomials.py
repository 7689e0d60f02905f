"""Motions whose coordinates are polynomials of time: between two states, and through points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import KinematicState
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import Array
from navigation_core.trajectories.overlaps import Piece

__all__ = ["LaterPart", "PolynomialPiece", "between", "spline_velocities", "through"]

_POWERS = np.arange(6)


@dataclass(frozen=True, eq=False)
class PolynomialPiece:
    """A motion through states, of degree five at most between two of them.

    Attributes:
        coefficients: shape (N, 6, 3), of each part and the powers of its time from 0 on, map frame,
            metres and seconds.
        begins_s: shape (N,), when each part begins; the first at 0.
        duration_s: duration of all.
        limits: what it is flown within.
    """

    coefficients: Array
    begins_s: Array
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
        part = np.maximum(np.searchsorted(self.begins_s, times_s, side="right") - 1, 0)
        own = self.coefficients[part]
        powers = (times_s - self.begins_s[part])[:, None] ** _POWERS
        first = own[:, 1:] * _POWERS[1:, None]
        second = first[:, 1:] * _POWERS[1:-1, None]
        return (
            np.einsum("nk,nki->ni", powers, own),
            np.einsum("nk,nki->ni", powers[:, :-1], first),
            np.einsum("nk,nki->ni", powers[:, :-2], second),
        )

    @property
    def end(self) -> KinematicState:
        """State at its end."""
        return self.sample(self.duration_s)


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


def through(
    times_s: Array, positions: Array, velocities: Array, accelerations: Array | None, limits: Limits
) -> PolynomialPiece:
    """Return the motion through states.

    Args:
        times_s: rising from 0 on, shape (N,), at least two.
        positions: shape (N, 3), map frame.
        velocities: the same.
        accelerations: the same, for polynomials of degree five; None for degree three.
        limits: what it is flown within.
    """
    t = np.diff(times_s)[:, None]
    p_0, v_0, v_1 = positions[:-1], velocities[:-1], velocities[1:]
    coefficients = np.zeros((len(t), len(_POWERS), 3))
    coefficients[:, 0], coefficients[:, 1] = p_0, v_0
    if accelerations is None:
        way = np.diff(positions, axis=0)
        coefficients[:, 2] = (3.0 * way - (2.0 * v_0 + v_1) * t) / t**2
        coefficients[:, 3] = (-2.0 * way + (v_0 + v_1) * t) / t**3
    else:
        a_0 = accelerations[:-1]
        # The lack at the end of position, velocity and acceleration.
        place = np.diff(positions, axis=0) - v_0 * t - 0.5 * a_0 * t**2
        speed = v_1 - v_0 - a_0 * t
        change = np.diff(accelerations, axis=0)
        coefficients[:, 2] = 0.5 * a_0
        coefficients[:, 3] = (10.0 * place - 4.0 * speed * t + 0.5 * change * t**2) / t**3
        coefficients[:, 4] = (-15.0 * place + 7.0 * speed * t - change * t**2) / t**4
        coefficients[:, 5] = (6.0 * place - 3.0 * speed * t + 0.5 * change * t**2) / t**5
    return PolynomialPiece(coefficients, times_s[:-1], float(times_s[-1]), limits)


def between(
    start: KinematicState, end: KinematicState, duration_s: float, limits: Limits
) -> PolynomialPiece:
    """Return the motion of degree five from one state to another.

    Args:
        start: the first state.
        end: the last state.
        duration_s: its duration, > 0.
        limits: what it is flown within.
    """
    return through(
        np.array([0.0, duration_s]),
        np.array([start.position_enu_m, end.position_enu_m]),
        np.array([start.velocity_enu_m_s, end.velocity_enu_m_s]),
        np.array([start.acceleration_enu_m_s2, end.acceleration_enu_m_s2]),
        limits,
    )


def spline_velocities(times_s: Array, positions: Array) -> Array:
    """Return the velocities of the cubic spline through points that begins and ends at rest.

    Its acceleration is continuous (natural in each inner point).

    Args:
        times_s: rising, shape (N,), at least two.
        positions: shape (N, 3), map frame.

    Returns:
        Shape (N, 3).
    """
    steps = np.diff(times_s)
    slopes = np.diff(positions, axis=0) / steps[:, None]
    velocities = np.zeros_like(positions)
    count = len(times_s)
    # Tridiagonal: forwards once, then back.
    ratios, values = np.zeros(count), np.zeros_like(positions)
    for i in range(1, count - 1):
        before, after = 1.0 / steps[i - 1], 1.0 / steps[i]
        diagonal = 2.0 * (before + after) - before * ratios[i - 1]
        ratios[i] = after / diagonal
        right = 3.0 * (slopes[i - 1] * before + slopes[i] * after)
        values[i] = (right - before * values[i - 1]) / diagonal
    for i in range(count - 2, 0, -1):
        velocities[i] = values[i] - ratios[i] * velocities[i + 1]
    return velocities
