"""A track over waypoints: straight legs, joined by corners that are cut within a radius.

Each leg is a `LineProfile` from rest to rest. While one leg brakes the next one may already
accelerate; the two motions add up, so that the vehicle rounds the corner without stopping.
The next leg begins as soon as the rounded corner stays within the waypoint's radius and no
faster than either leg. The recordings (`copter_auto_cleared`) show ArduCopter do the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mavlink_sitl.array_ops import Ops
from mavlink_sitl.autopilot.control.control_state import ControllerGains
from mavlink_sitl.autopilot.control.controller import sqrt_approach
from mavlink_sitl.autopilot.control.straight_profile import LineProfile
from mavlink_sitl.exchange import Limits, Motion, Vector

_SCALAR = Ops()


class TrackTimeScale:
    """The share of its speed with which one track is flown."""

    def __init__(self, limits: Limits) -> None:
        """At full speed."""
        self._limits = limits
        self._speed_m_s = limits.speed_xy_m_s
        self.acceleration_m_s2 = 0.0
        """Of the speed that is allowed"""

    @property
    def share(self) -> float:
        """1 at full speed, 0 at a stand."""
        return self._speed_m_s / self._limits.speed_xy_m_s

    @property
    def steady(self) -> bool:
        """Whether it is at full speed."""
        return self.acceleration_m_s2 == 0.0 and self._speed_m_s == self._limits.speed_xy_m_s

    def advance(self, dt_s: float, paused: bool) -> None:
        """Let time pass."""
        limits = self._limits
        most, jerk = limits.acceleration_xy_m_s2, limits.jerk_xy_m_s3
        wanted = 0.0 if paused else limits.speed_xy_m_s
        self._speed_m_s = max(self._speed_m_s + self.acceleration_m_s2 * dt_s, 0.0)
        error = wanted - self._speed_m_s
        size = sqrt_approach(abs(error), jerk / most, jerk, _SCALAR)
        change = math.copysign(min(size, most, abs(error) / dt_s), error) - self.acceleration_m_s2
        self.acceleration_m_s2 += min(max(change, -jerk * dt_s), jerk * dt_s)
        if abs(error) < 1e-3 and abs(self.acceleration_m_s2) < 1e-2:
            self._speed_m_s, self.acceleration_m_s2 = wanted, 0.0


Motion3 = tuple[Vector, Vector, Vector]
"""Position, velocity, acceleration; NED, SI units"""


SNAP_S = 0.3
"""Time in which a copter's jerk changes: twice ATC_INPUT_TC (calc_scurve_jerk_and_snap)"""
MARGIN = 0.05
"""Share of its speed by which the vehicle may be slower than its track without delaying it"""
CORNER = 2.0
"""Acceleration in corners over WPNAV_ACCEL, where WPNAV_ACCEL_C is 0"""
TINY_M_S2 = 1e-6
"""Steady at its limit, an acceleration is not below it"""


class SmoothProfile:
    """A `LineProfile` averaged over a time, which limits the change of its jerk."""

    def __init__(self, line: LineProfile, snap_s: float) -> None:
        self._line = line
        self._snap_s = snap_s
        self.duration_s = line.duration_s + snap_s
        self.speeds_up_until_s = line.speeds_up_until_s + snap_s
        self.brakes_from_s = line.brakes_from_s

    def change_speed(self, speed_m_s: float, time_s: float) -> None:
        """Another largest speed for the rest, if it does not brake for its end yet."""
        line = self._line.with_speed(speed_m_s, max(time_s, 0.0))
        if line is not None:
            self._line = line
            self.duration_s = line.duration_s + self._snap_s
            self.brakes_from_s = line.brakes_from_s

    def at(self, time_s: float) -> Vector:
        """Distance, speed and acceleration `time_s` after the start."""
        snap_s = self._snap_s
        s0, v0, _ = self._line.at(time_s - snap_s)
        s1, _, _ = self._line.at(time_s - 0.5 * snap_s)
        s2, v2, _ = self._line.at(time_s)
        # Simpson's rule; exact but where two phases meet.
        return (s0 + 4.0 * s1 + s2) / 6.0, (s2 - s0) / snap_s, (v2 - v0) / snap_s


class TrackLeg:
    """A straight line in space, from rest to rest.

    Args:
        start: NED metres.
        end: NED metres.
        limits: speed and acceleration along it, as its slope allows.
        jerk_m_s3: jerk along it.
        snap_s: the time in which the jerk changes.
    """

    def __init__(
        self,
        start: Vector,
        end: Vector,
        limits: Limits,
        jerk_m_s3: float,
        snap_s: float = SNAP_S,
    ) -> None:
        self.start = start
        self.end = end
        self.limits = limits
        length = math.dist(start, end)
        self.direction: Vector = (0.0, 0.0, 0.0)
        if length > 0.0:
            self.direction = (
                (end[0] - start[0]) / length,
                (end[1] - start[1]) / length,
                (end[2] - start[2]) / length,
            )
        level = math.hypot(self.direction[0], self.direction[1])
        upright = abs(self.direction[2])
        speed = self.speed_m_s()
        acceleration = min(
            _share(limits.acceleration_xy_m_s2, level), _share(limits.acceleration_z_m_s2, upright)
        )
        if length == 0.0:
            speed = acceleration = 1.0
        line = LineProfile(length, speed, acceleration, jerk_m_s3)
        self.profile = SmoothProfile(line, snap_s)

    def speed_m_s(self) -> float:
        """The largest speed along it."""
        level = math.hypot(self.direction[0], self.direction[1])
        climb = self.limits.speed_down_m_s if self.direction[2] > 0.0 else self.limits.speed_up_m_s
        by_height = _share(climb, abs(self.direction[2]))
        return min(_share(self.limits.speed_xy_m_s, level), by_height)

    def change_limits(self, limits: Limits, time_s: float) -> None:
        """Other speeds from a time after the start on."""
        self.limits = limits
        if self.start != self.end:
            self.profile.change_speed(self.speed_m_s(), time_s)

    def at(self, time_s: float) -> Motion3:
        """Position from `start`, velocity, acceleration."""
        s, v, a = self.profile.at(time_s)
        n, e, d = self.direction
        return (n * s, e * s, d * s), (n * v, e * v, d * v), (n * a, e * a, d * a)


def _share(limit: float, part: float) -> float:
    return limit / part if part > 1e-6 else math.inf


class LegTrack:
    """The leg in flight and, while a corner is rounded, the next one."""

    def __init__(
        self, leg: TrackLeg, now_s: float, position_gain_1_s: float = ControllerGains().position_xy
    ) -> None:
        """Begin a leg; the gain is from the distance to the track to a velocity."""
        self.leg = leg
        self._position_gain_1_s = position_gain_1_s
        self.time_scale = TrackTimeScale(leg.limits)
        self._seen_s = now_s
        self._progress = 1.0
        """Seconds of the track in a second"""
        self._late_s = 0.0
        """How much less time has passed for the track"""
        self._began_s = now_s
        self._next: TrackLeg | None = None
        self._next_began_s = 0.0

    def advance(self, now_s: float, paused: bool, motion: Motion, jerk_m_s3: float) -> None:
        """Let time pass: slower while it is paused, and while the vehicle lags behind.

        Args:
            now_s: the time.
            paused: whether the mission is.
            motion: estimated position and velocity of the vehicle.
            jerk_m_s3: WPNAV_JERK.
        """
        dt_s, self._seen_s = now_s - self._seen_s, now_s
        if dt_s <= 0.0:
            return
        # advance_wp_target_along_track of ArduPilot: 2.5 s to follow with default parameters.
        filter_s = self.leg.limits.acceleration_xy_m_s2 / jerk_m_s3
        wanted = self._keeping_up(now_s, motion)
        self._progress += (wanted - self._progress) * min(dt_s / filter_s, 1.0)
        if paused or not self.time_scale.steady:
            self.time_scale.advance(dt_s, paused)
        self._late_s += (1.0 - self._progress * self.time_scale.share) * dt_s

    def _keeping_up(self, now_s: float, motion: Motion) -> float:
        """The share of the track's speed that the vehicle has, less what it is behind."""
        position, velocity, _ = self.at(now_s)
        speed = math.hypot(*velocity)
        if speed == 0.0:
            return 1.0
        behind = _along(_subtract(position, motion[:3]), velocity) / speed
        real_m_s = _along(velocity, motion[3:6]) / speed
        lag_m_s = self._position_gain_1_s * behind
        return min(max(MARGIN + (real_m_s - lag_m_s) / speed, 0.0), 1.0)

    def _remaining_s(self, track_s: float) -> float:
        return self._began_s + self.leg.profile.duration_s - track_s

    def change_limits(self, limits: Limits, now_s: float) -> None:
        """Other speeds from now on, for the leg in flight and one that has begun after it."""
        now_s -= self._late_s
        self.leg.change_limits(limits, now_s - self._began_s)
        if self._next is not None:
            self._next.change_limits(limits, now_s - self._next_began_s)
        if self.time_scale.steady:
            self.time_scale = TrackTimeScale(limits)

    @property
    def rounding(self) -> bool:
        """Whether the next leg has begun before the end of this one."""
        return self._next is not None

    def offer(self, following: TrackLeg, radius_m: float, now_s: float) -> None:
        """Begin with the following leg when the corner stays within its radius and all limits.

        As SCurve::advance_target_along_track: while this leg brakes and the following one speeds
        up, by the motion in the middle of the corner.
        """
        now_s -= self._late_s
        left_s, elapsed_s = self._remaining_s(now_s), now_s - self._began_s
        brakes = elapsed_s >= self.leg.profile.brakes_from_s
        speeds_up = 0.0 < left_s <= following.profile.speeds_up_until_s
        if self._next is not None or not (brakes and speeds_up):
            return
        old, new = self.leg.at(elapsed_s + 0.5 * left_s), following.at(0.5 * left_s)
        moved, velocity, push = (_add(a, b) for a, b in zip(old, new, strict=True))
        beside_m = math.dist(moved, _subtract(self.leg.end, self.leg.start))
        limits = self.leg.limits, following.limits
        slow = math.hypot(*velocity) < min(leg.speed_m_s() for leg in (self.leg, following))
        level = math.hypot(*push[:2]) < CORNER * self.leg.limits.acceleration_xy_m_s2
        upright = abs(push[2]) < min(each.acceleration_z_m_s2 for each in limits) - TINY_M_S2
        if beside_m < radius_m and slow and level and upright:
            self._next, self._next_began_s = following, now_s

    def passed(self, now_s: float) -> bool:
        """Whether the leg's end is behind: reached, or its corner half rounded."""
        now_s -= self._late_s
        if self._next is not None:
            return now_s - self._next_began_s >= self._remaining_s(now_s)
        return self._remaining_s(now_s) <= 0.0

    def go_on(self, following: TrackLeg, now_s: float) -> None:
        """Make the next leg the one in flight; the rest of the old one still counts."""
        now_s -= self._late_s
        if self._next is None:
            self._tail = None
            self.leg, self._began_s = following, now_s
            return
        self._tail = (self.leg, self._began_s)
        self.leg, self._began_s = self._next, self._next_began_s
        self._next = None

    _tail: tuple[TrackLeg, float] | None = None

    def at(self, now_s: float) -> Motion3:
        """The present reference: the sum of the legs under way."""
        motion = self._at(now_s - self._late_s)
        if self.time_scale.steady:
            return motion
        position, velocity, acceleration = motion
        share = self.time_scale.share
        # The speed along the way grows with the pace, too.
        grows = self.time_scale.acceleration_m_s2 / self.leg.limits.speed_xy_m_s
        slower = _times(velocity, share)
        return position, slower, _add(_times(acceleration, share * share), _times(velocity, grows))

    def _at(self, now_s: float) -> Motion3:
        position, velocity, acceleration = self.leg.at(now_s - self._began_s)
        position = _add(position, self.leg.start)
        others: list[Motion3] = []
        if self._tail is not None:
            tail, began_s = self._tail
            moved, v, a = tail.at(now_s - began_s)
            whole = tuple(y - x for x, y in zip(tail.start, tail.end, strict=True))
            others.append((_subtract(moved, whole), v, a))
        if self._next is not None:
            others.append(self._next.at(now_s - self._next_began_s))
        for moved, v, a in others:
            position, velocity, acceleration = (
                _add(position, moved),
                _add(velocity, v),
                _add(acceleration, a),
            )
        return position, velocity, acceleration


def _along(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _times(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _subtract(a: Vector, b: tuple[float, ...]) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
