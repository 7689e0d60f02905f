"""Motions along a line, and from one velocity to another, each calculated by Ruckig.

Each is one profile on axes that are chosen so that the norm of the horizontal velocity is
known, because Ruckig itself limits every axis on its own. `profiles` says what takes its place
where it is not installed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    across,
    add,
    distance,
    dot,
    norm,
    scale,
    subtract,
    unit_between,
)
from navigation_core.limits import Limits
from navigation_core.trajectories.profiles import MotionProfile
from navigation_core.trajectories.solver import installed_solver

Array: TypeAlias = NDArray[np.float64]

UP: Vector3 = (0.0, 0.0, 1.0)
EAST: Vector3 = (1.0, 0.0, 0.0)
# Below these, numbers count as zero: far under what a vehicle or its estimator resolves,
# far above what double precision leaves of a 10 km position.
TINY_M = 1e-6
TINY_M_S = 1e-6
TINY_M_S2 = 1e-6
TINY_S = 1e-6
# From about rest, all three axes keep in step, so that the path is as good as straight.
# From a faster start the climb rate changes by itself, as fast as it may: a descent must not
# be drawn out by a long turn, because there is ground below.
_ABOUT_REST_M_S = 0.3
# Ruckig 0.19 finds no solution from an acceleration such as 1e-159 m/s2.
_NOTHING = 1e-12
_SOLVER = installed_solver()


@dataclass(frozen=True)
class MotionPiece:
    """One profile along fixed axes of the map frame.

    Attributes:
        origin_enu_m: where the profile's zero lies.
        axes_enu: unit vectors, one for each degree of freedom.
        profile: what was calculated.
        duration_s: its duration.
        limits: what it was planned with.
        begin_s: where in the profile it begins.
    """

    origin_enu_m: Vector3
    axes_enu: tuple[Vector3, ...]
    profile: MotionProfile
    duration_s: float
    limits: Limits
    begin_s: float = 0.0

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since the beginning of the piece."""
        positions, velocities, accelerations = self.profile.at_time(self.begin_s + t_s)
        if len(self.axes_enu) == 1:  # most are straight
            x, y, z = self.axes_enu[0]
            x0, y0, z0 = self.origin_enu_m
            along, speed, change = positions[0], velocities[0], accelerations[0]
            return KinematicState(
                (x0 + along * x, y0 + along * y, z0 + along * z),
                (speed * x, speed * y, speed * z),
                (change * x, change * y, change * z),
            )
        return KinematicState(
            add(self.origin_enu_m, self._combine(positions)),
            self._combine(velocities),
            self._combine(accelerations),
        )

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""
        times_s = self.begin_s + times_s
        positions, velocities, accelerations = np.zeros((3, len(times_s), 3))
        positions += self.origin_enu_m
        for (starts_s, states), axis in zip(self._phases, self.axes_enu, strict=True):
            phase = np.searchsorted(starts_s, times_s, side="right") - 1
            t_s = times_s - starts_s[phase]
            place, speed, change, jerk = states[:, phase]
            axis_enu = np.array(axis)
            half_s2 = 0.5 * t_s * t_s
            along = place + t_s * speed + half_s2 * (change + t_s / 3.0 * jerk)
            positions += along[:, None] * axis_enu
            velocities += (speed + t_s * change + half_s2 * jerk)[:, None] * axis_enu
            accelerations += (change + t_s * jerk)[:, None] * axis_enu
        return positions, velocities, accelerations

    @cached_property
    def _phases(self) -> tuple[tuple[Array, Array], ...]:
        """For each axis the beginnings of times of steady jerk (K,), and the states then (4, K).

        They are place, speed, acceleration and jerk. Ruckig brings a start beyond the limits back
        to them first, by up to two phases; after the seven of its profile the speed stays.
        """
        axes = []
        for profile in self.profile.profiles[0]:
            brake, rows, begin_s = profile.brake, [], 0.0
            if brake.duration > 0.0:
                for k in range(2):
                    rows.append((begin_s, brake.p[k], brake.v[k], brake.a[k], brake.j[k]))
                    begin_s += brake.t[k]
            lasts, jerks = profile.t, profile.j
            for row in zip(profile.p, profile.v, profile.a, jerks, lasts, strict=False):
                rows.append((begin_s, *row[:4]))
                begin_s += row[4]
            rows.append((begin_s, profile.p[-1], profile.v[-1], profile.a[-1], 0.0))
            table = np.array(rows).T
            axes.append((table[0], table[1:]))
        return tuple(axes)

    @property
    def end(self) -> KinematicState:
        """State at the end of the piece."""
        return self.sample(self.duration_s)

    def _combine(self, values: list[float]) -> Vector3:
        x = y = z = 0.0
        for value, axis in zip(values, self.axes_enu, strict=True):
            x += value * axis[0]
            y += value * axis[1]
            z += value * axis[2]
        return (x, y, z)


def plan_straight(
    state: KinematicState, goal_enu_m: Vector3, limits: Limits, end_speed_m_s: float = 0.0
) -> MotionPiece:
    """Plan along the line to the goal, from a state that moves along it, to a speed there."""
    axis = unit_between(state.position_enu_m, goal_enu_m) or EAST
    axis_limits = limits.along(axis)
    profile = _SOLVER.to_position(
        _along((axis,), state.velocity_enu_m_s)[0],
        _along((axis,), state.acceleration_enu_m_s2)[0],
        distance(state.position_enu_m, goal_enu_m),
        min(end_speed_m_s, axis_limits.speed_forward_m_s),
        axis_limits,
    )
    return MotionPiece(state.position_enu_m, (axis,), profile, profile.duration, limits)


def change_velocity(state: KinematicState, target_m_s: Vector3, limits: Limits) -> MotionPiece:
    """Plan from a state to a velocity without acceleration, wherever that ends."""
    axes = _turn_axes(state, subtract(target_m_s, state.velocity_enu_m_s))
    return _reach(state, target_m_s, axes, limits)


def change_along(state: KinematicState, target_m_s: Vector3, limits: Limits) -> MotionPiece:
    """Plan a change of velocity along its chord, in space; across it, nothing changes."""
    chord = unit_between(ZERO, subtract(target_m_s, state.velocity_enu_m_s))
    if chord is None:
        chord = unit_between(ZERO, state.velocity_enu_m_s) or EAST
    side = unit_between(ZERO, across(state.velocity_enu_m_s, chord))
    return _reach(state, target_m_s, (chord,) if side is None else (chord, side), limits)


def speed_change_m(
    direction_enu: Vector3,
    from_m_s: float,
    to_m_s: float,
    limits: Limits,
    acceleration_m_s2: float = 0.0,
) -> float:
    """Return the path that a change of speed along a direction takes, in metres."""
    state = KinematicState(
        ZERO, scale(direction_enu, from_m_s), scale(direction_enu, acceleration_m_s2)
    )
    piece = _reach(state, scale(direction_enu, to_m_s), (direction_enu,), limits)
    return dot(piece.end.position_enu_m, direction_enu)


def _reach(
    state: KinematicState, target_m_s: Vector3, axes: tuple[Vector3, ...], limits: Limits
) -> MotionPiece:
    """Reach a velocity on each axis as fast as it goes."""
    profile = _SOLVER.to_velocity(
        _along(axes, state.velocity_enu_m_s),
        _along(axes, state.acceleration_enu_m_s2),
        _along(axes, target_m_s),
        [limits.along(axis) for axis in axes],
    )
    return MotionPiece(state.position_enu_m, axes, profile, profile.duration, limits)


def _turn_axes(state: KinematicState, change_m_s: Vector3) -> tuple[Vector3, ...]:
    """Choose axes for a change of velocity: the chord in velocity space comes first."""
    chord = unit_between(ZERO, change_m_s)
    if (
        chord is not None
        and norm(state.velocity_enu_m_s) <= _ABOUT_REST_M_S
        and norm(across(state.acceleration_enu_m_s2, chord)) < TINY_M_S2
    ):
        # A component of the velocity that stays constant gets an axis of its own, across the chord.
        side = unit_between(ZERO, across(state.velocity_enu_m_s, chord))
        return (chord,) if side is None else (chord, side)
    level = unit_between(ZERO, (change_m_s[0], change_m_s[1], 0.0)) or EAST
    return (level, (-level[1], level[0], 0.0), UP)


def _along(axes: tuple[Vector3, ...], vector: Vector3) -> list[float]:
    """Return the components along axes, without those that are next to nothing."""
    components = [dot(vector, axis) for axis in axes]
    return [0.0 if abs(component) < _NOTHING else component for component in components]


def relaxed_velocity(state: KinematicState, limits: Limits) -> Vector3:
    """Return the velocity that is left once the acceleration has gone, at the full jerk."""
    ax, ay, az = state.acceleration_enu_m_s2
    vx, vy, vz = state.velocity_enu_m_s
    level = 0.5 * math.hypot(ax, ay) / limits.jerk_m_s3
    return (vx + ax * level, vy + ay * level, vz + 0.5 * az * abs(az) / limits.jerk_m_s3)


def relax(state: KinematicState, limits: Limits) -> MotionPiece:
    """Take the acceleration away as fast as the jerk allows, along its own direction."""
    ax, ay, _ = state.acceleration_enu_m_s2
    level = unit_between(ZERO, (ax, ay, 0.0)) or EAST
    axes = (level, (-level[1], level[0], 0.0), UP)
    return _reach(state, relaxed_velocity(state, limits), axes, limits)
