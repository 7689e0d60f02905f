"""A circle in the plane, and the motion along it from rest to rest.

The motion is one along a straight line that is wound around the circle: its speed has a bounded
jerk, and the acceleration towards the centre follows from the speed. So the motion begins and ends
along the tangent, at rest, and position, velocity and acceleration are continuous.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import ZERO, KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.trajectories.motions import (
    Array,
    MotionPiece,
    change_velocity,
    plan_straight,
)
from navigation_core.trajectories.trajectory import Trajectory

__all__ = ["Ring", "RingMotion", "plan_ring", "ring_speed_m_s"]

# Shares of the acceleration that are planned with: towards the centre, and along the circle. The
# norm of both is the whole.
_INWARD_SHARE, _ALONG_SHARE = 0.8, 0.6
# Of a motion of many laps as many are planned: it is wound back after the first, so that at least
# a lap is ahead.
_LAPS_AHEAD = 2


@dataclass(frozen=True)
class Ring:
    """A level circle with a direction. Angles are anticlockwise from east (REP-103).

    Attributes:
        centre_enu_m: its centre, in the map frame.
        radius_m: its radius.
        anticlockwise: whether it is flown anticlockwise, seen from above.
    """

    centre_enu_m: Vector3
    radius_m: float
    anticlockwise: bool = True

    @property
    def sign(self) -> float:
        """1 for anticlockwise, -1 for clockwise."""
        return 1.0 if self.anticlockwise else -1.0

    def point(self, angle_rad: float) -> Vector3:
        """Return the point at an angle."""
        x, y, z = self.centre_enu_m
        return (
            x + self.radius_m * math.cos(angle_rad),
            y + self.radius_m * math.sin(angle_rad),
            z,
        )

    def angle_rad(self, position_enu_m: Vector3) -> float:
        """Return the angle at which a position is seen from the centre."""
        x, y, _ = self.centre_enu_m
        return math.atan2(position_enu_m[1] - y, position_enu_m[0] - x)

    def error_m(self, position_enu_m: Vector3) -> float:
        """Return the horizontal distance from the circle, positive outside."""
        x, y, _ = self.centre_enu_m
        return math.hypot(position_enu_m[0] - x, position_enu_m[1] - y) - self.radius_m

    def tangent_rad(self, angle_rad: float) -> float:
        """Return the direction of travel at an angle."""
        return angle_rad + self.sign * 0.5 * math.pi

    def entry_rad(self, position_enu_m: Vector3) -> float:
        """Return the angle at which a straight line from a position meets the circle tangentially.

        From inside of the circle there is no such line: then it is the nearest angle.
        """
        away_m = self.error_m(position_enu_m) + self.radius_m
        return self.angle_rad(position_enu_m) + self.sign * math.acos(
            self.radius_m / max(away_m, self.radius_m)
        )


def ring_speed_m_s(limits: Limits, radius_m: float, *, turns: bool) -> float:
    """Return the greatest speed on a circle that the acceleration and the yaw rate allow.

    Args:
        limits: of the vehicle.
        radius_m: of the circle.
        turns: whether the yaw goes round with the vehicle.
    """
    speed_m_s = math.sqrt(_INWARD_SHARE * limits.acceleration_horizontal_m_s2 * radius_m)
    return min(speed_m_s, limits.yaw_rate_rad_s * radius_m) if turns else speed_m_s


@dataclass(frozen=True)
class _RingPiece:
    """A motion along a line, wound around a circle; see `overlaps.Piece`.

    Attributes:
        ring: the circle.
        from_rad: where it begins.
        motion: along the x axis, from 0 on.
        limits: those of the flight.
    """

    ring: Ring
    from_rad: float
    motion: MotionPiece
    limits: Limits

    @property
    def duration_s(self) -> float:
        """That of the motion."""
        return self.motion.duration_s

    @property
    def end(self) -> KinematicState:
        """State at its end."""
        return self.sample(self.duration_s)

    def sample(self, t_s: float) -> KinematicState:
        """Return the state at a time since its beginning."""
        line, ring = self.motion.sample(t_s), self.ring
        speed, change = line.velocity_enu_m_s[0], line.acceleration_enu_m_s2[0]
        angle = self.from_rad + ring.sign * line.position_enu_m[0] / ring.radius_m
        out_x, out_y = math.cos(angle), math.sin(angle)
        along_x, along_y = -ring.sign * out_y, ring.sign * out_x
        inward = speed * speed / ring.radius_m
        return KinematicState(
            ring.point(angle),
            (speed * along_x, speed * along_y, 0.0),
            (change * along_x - inward * out_x, change * along_y - inward * out_y, 0.0),
        )

    def samples(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Return the same for many times (N,): positions, velocities, accelerations (N, 3)."""
        ring, nothing = self.ring, np.zeros(len(times_s))
        places, speeds, changes = (values[:, 0] for values in self.motion.samples(times_s))
        angles = self.from_rad + ring.sign * places / ring.radius_m
        out = np.stack([np.cos(angles), np.sin(angles), nothing], axis=1)
        along = ring.sign * np.stack([-out[:, 1], out[:, 0], nothing], axis=1)
        inward = speeds * speeds / ring.radius_m
        return (
            np.array(ring.centre_enu_m) + ring.radius_m * out,
            speeds[:, None] * along,
            changes[:, None] * along - inward[:, None] * out,
        )


@dataclass(frozen=True)
class RingMotion:
    """A motion of any number of laps, of which a few are planned.

    Attributes:
        trajectory: the planned part. From ``steady_s`` on it has a steady speed for longer than a
            lap, if ``windings`` is not 0: a lap later it is in the same state.
        windings: how often the trajectory is wound back by a lap; infinite for a motion without
            an end.
        steady_s: from when on, in trajectory time.
        lap_s: duration of a lap at the steady speed.
    """

    trajectory: Trajectory
    windings: float
    steady_s: float
    lap_s: float

    def after(self, before: Trajectory) -> RingMotion:
        """Return this motion after another one, from whose standstill it begins."""
        return replace(
            self,
            trajectory=before.then(self.trajectory),
            steady_s=before.duration_s + self.steady_s,
        )


def plan_ring(ring: Ring, from_rad: float, turn_rad: float, limits: Limits) -> RingMotion:
    """Plan a motion along a circle, from rest to rest.

    Args:
        ring: the circle, with its direction.
        from_rad: where the motion begins.
        turn_rad: how far it leads, in the direction of the circle; above 0, infinite for a motion
            without an end.
        limits: what to keep to; the speed is expected not to be above `ring_speed_m_s`.

    Raises:
        TrajectoryError: no trajectory could be calculated.
    """
    along = replace(
        limits,
        acceleration_horizontal_m_s2=_ALONG_SHARE * limits.acceleration_horizontal_m_s2,
    )
    speed_m_s, lap_m = along.speed_horizontal_m_s, math.tau * ring.radius_m
    rise = change_velocity(KinematicState(ZERO), (speed_m_s, 0.0, 0.0), along)
    # It brakes as it speeds up.
    changes_m = 2.0 * rise.end.position_enu_m[0]
    windings = max((turn_rad * ring.radius_m - changes_m) // lap_m - _LAPS_AHEAD, 0.0)
    if math.isinf(turn_rad):
        windings, length_m = math.inf, changes_m + _LAPS_AHEAD * lap_m
    else:
        length_m = turn_rad * ring.radius_m - windings * lap_m
    motion = plan_straight(KinematicState(ZERO), (length_m, 0.0, 0.0), along)
    piece = _RingPiece(ring, from_rad, motion, along)
    trajectory = Trajectory(
        piece.sample(0.0), piece.end.position_enu_m, piece.duration_s, along, (piece,)
    )
    return RingMotion(trajectory, windings, rise.duration_s, lap_m / speed_m_s)
