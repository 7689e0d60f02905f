"""Reserves the path of one flight step by step, and says how far it may get within that."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import KinematicState, Vector3, dot, norm, scale, subtract
from navigation_core.limits import stopping_distance_m
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.traffic.entries import Ask, TrafficWait
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import NOWHERE, Volume, densified, joined
from navigation_core.trajectories.trajectory import Trajectory

__all__ = ["REACTION_S", "STANDS_M_S", "ReservedPath", "RunOut", "Within"]

REACTION_S = 0.3
"""Time until the stop at the end of the reservation begins"""

STANDS_M_S = 0.1
"""Below this speed the vehicle stands"""

# Time of flight at the present speed that is reserved beyond the stopping distance, and the least,
# below which the vehicle asks for more.
_RESERVED_AHEAD_S, _RESERVED_LEAST_S = 3.0, 1.5
# A distance that grows by less than this is position noise.
_LATE_NOISE_M = 0.3
# A path is straight if it is longer than the straight line by less than this.
_STRAIGHT_M = 0.03
# A vehicle within this distance of its path is well inside of what is held about it, by what it may
# stray (`TrafficView.radius_m`): nothing has to be held for its own position.
_ON_PATH_M = 0.3
# Time and change of speed for which it is enough to have looked at a straight path once: a little
# more than the longest period in which more of a path is asked for.
_STRETCH_S, _FASTER_M_S = 0.8, 1.0


@dataclass(frozen=True)
class RunOut:
    """How a vehicle comes to rest.

    Attributes:
        timeout_s: for how long it follows its last setpoint.
        braking_m_s2: its planned deceleration.
    """

    timeout_s: float
    braking_m_s2: float

    def length_m(self, speed_m_s: float) -> float:
        """Return how far it gets from a speed after its last setpoint."""
        return stopping_distance_m(speed_m_s, self.timeout_s + REACTION_S, self.braking_m_s2)


@dataclass(frozen=True)
class Within:
    """How far a vehicle may get.

    Attributes:
        room_m: length of the path that is reserved, from the setpoint.
        aside_m: free length of the line along which it runs out; infinite if all of it is free.
        waiting: why the reservation is not what was wanted, or None.
    """

    room_m: float
    aside_m: float
    waiting: TrafficWait | None


@dataclass(frozen=True)
class _Stretch:
    """A straight part of a path on which nothing is to be done until more is asked for.

    Attributes:
        start_enu_m: where the setpoint was when it was looked at.
        course: unit vector along it.
        length_m: how far the setpoint may get.
        behind_m: length of the path that is held behind the start.
        room_m: length of the path that is reserved ahead of the start.
        speed_max_m_s: up to this speed the vehicle runs out along it.
    """

    start_enu_m: Vector3
    course: Vector3
    length_m: float
    behind_m: float
    room_m: float
    speed_max_m_s: float

    def passed_m(self, setpoint: KinematicState, here_enu_m: Vector3) -> float | None:
        """Return how far a setpoint on the path has got; None if it or the vehicle is off it.

        Args:
            setpoint: the setpoint.
            here_enu_m: where the vehicle is.
        """
        if norm(setpoint.velocity_enu_m_s) > self.speed_max_m_s:
            return None
        passed_m = dot(subtract(setpoint.position_enu_m, self.start_enu_m), self.course)
        offset = subtract(here_enu_m, self.start_enu_m)
        along_m = dot(offset, self.course)
        # A vehicle ahead of its setpoint is on what is reserved, too: one in a tailwind leads it.
        is_within = 0.0 <= passed_m <= self.length_m and -self.behind_m <= along_m <= self.length_m
        if not is_within or norm(subtract(offset, scale(self.course, along_m))) > _ON_PATH_M:
            return None
        return passed_m


class ReservedPath:
    """A trajectory as points that are reserved one after the other.

    Attributes:
        trajectory: the motion.
        times_s: shape (N,), trajectory time.
        points_enu_m: shape (N, 3), map frame.
        lengths_m: from the beginning to each point, shape (N,).
        volume: the same points as a volume.
    """

    def __init__(self, trajectory: Trajectory, view: TrafficView) -> None:
        """Begin without a reservation."""
        self.trajectory = trajectory
        samples = MotionSamples.of(trajectory)
        self.points_enu_m, self.times_s = densified(samples.positions_enu_m, samples.times_s)
        steps = np.linalg.norm(np.diff(self.points_enu_m, axis=0), axis=1)
        self.lengths_m = np.concatenate([[0.0], np.cumsum(steps)])
        self.volume = view.volume(self.points_enu_m)
        self._granted = 0
        self._stretch: _Stretch | None = None
        # Single numbers of these are read in a tenth of the time; lists take five times the memory.
        self._times_s = array("d", self.times_s.tobytes())
        self._lengths_m = array("d", self.lengths_m.tobytes())

    def reserve(
        self,
        view: TrafficView,
        carrot: Carrot,
        here_enu_m: Vector3,
        speed_m_s: float,
        run_out: RunOut,
        now: float,
    ) -> Within:
        """Reserve more of the path, and return how much of it is.

        Args:
            view: the traffic.
            carrot: the setpoint on it.
            here_enu_m: where the vehicle is.
            speed_m_s: its speed.
            run_out: how it comes to rest.
            now: time in seconds.
        """
        first = max(bisect_right(self._times_s, carrot.time_s) - 1, 0)
        count, granted = len(self._times_s), max(self._granted - first, 0)
        beside, aside_m = self._beside(view, carrot, first, run_out)
        begin = self._behind(first, here_enu_m)
        tail = (
            view.volume(np.array([here_enu_m, carrot.state.position_enu_m])),
            self.volume.part(begin, first + 1),
            beside,
        )
        if view.reservations.is_settled(view.name, self, now):
            held = joined(*tail, self.volume.part(first, first + granted))
            waiting = view.reservations.follow(view.name, held, now)
        else:
            ask = self._ask(carrot, first, granted, speed_m_s, run_out)
            grant = view.reservations.extend(view.name, ask, joined(*tail), now)
            granted, waiting = grant.granted, grant.waiting
        self._granted = first + granted
        room_m, passed_m = math.inf, self._length_m(carrot.time_s, first)
        if self._granted < count:
            room_m = max(self._lengths_m[max(self._granted - 1, 0)] - passed_m, 0.0)
        behind_m = passed_m - self._lengths_m[begin]
        self._stretch = self._straight_on(carrot, passed_m, behind_m, room_m, run_out)
        return Within(room_m, aside_m, waiting)

    def stay(
        self, view: TrafficView, carrot: Carrot, here_enu_m: Vector3, now: float
    ) -> Within | None:
        """Hold what is held, and return how much of the path that is; None if more is to be done.

        Args:
            view: the traffic.
            carrot: the setpoint on it.
            here_enu_m: where the vehicle is.
            now: time in seconds.
        """
        stretch = self._stretch
        if stretch is None or not view.reservations.is_settled(view.name, self, now):
            return None
        passed_m = stretch.passed_m(carrot.state, here_enu_m)
        if passed_m is None:
            return None
        # All of it was held at the last question.
        waiting = view.reservations.stay(view.name, now)
        return Within(max(stretch.room_m - passed_m, 0.0), math.inf, waiting)

    def _straight_on(
        self, carrot: Carrot, passed_m: float, behind_m: float, room_m: float, run_out: RunOut
    ) -> _Stretch | None:
        """Return the straight stretch that the setpoint is on; None if the path turns soon."""
        state = carrot.state
        speed_m_s = norm(state.velocity_enu_m_s)
        if speed_m_s < STANDS_M_S:
            return None
        speed_max_m_s = speed_m_s + _FASTER_M_S
        course = scale(state.velocity_enu_m_s, 1.0 / speed_m_s)
        length_m = run_out.length_m(speed_max_m_s) + _STRETCH_S * speed_max_m_s
        start = state.position_enu_m
        if not self._is_straight(passed_m, start, course, length_m):
            return None
        length_m = min(_STRETCH_S * speed_max_m_s, room_m)
        return _Stretch(start, course, length_m, behind_m, room_m, speed_max_m_s)

    def begins_free(self, view: TrafficView, stop_m: float) -> bool:
        """Whether its beginning, up to where the vehicle could stop, can be reserved."""
        count = max(int(np.searchsorted(self.lengths_m, stop_m)) + 1, 2)
        return view.reservations.blocked_by(view.name, self.volume, count) is None

    def _ask(
        self, carrot: Carrot, first: int, granted: int, speed_m_s: float, run_out: RunOut
    ) -> Ask:
        start_s = 0.0 if speed_m_s > 0.5 else 1.0
        top_m_s = carrot.trajectory.limits.speed_horizontal_m_s
        needed_m = self._lengths_m[first] + run_out.length_m(top_m_s)
        count = len(self._times_s)
        wanted = bisect_right(self._lengths_m, needed_m + _RESERVED_AHEAD_S * speed_m_s)
        enough = bisect_right(self._lengths_m, needed_m + _RESERVED_LEAST_S * speed_m_s)
        return Ask(
            self.volume.rest(first),
            np.maximum(self.times_s[first:] - carrot.time_s, 0.0) + start_s,
            granted,
            min(wanted + 1, count) - first,
            min(enough + 1, count) - first,
            self,
            first,
        )

    def _behind(self, first: int, here_enu_m: Vector3) -> int:
        """Return where the path between a vehicle that is late and its setpoint begins."""
        begin, points = first, self.points_enu_m
        nearest_m = math.dist(points[first], here_enu_m)
        while begin > 0:
            away_m = math.dist(points[begin - 1], here_enu_m)
            if away_m > nearest_m + _LATE_NOISE_M:
                break
            begin, nearest_m = begin - 1, min(nearest_m, away_m)
        return begin

    def _length_m(self, time_s: float, first: int) -> float:
        """Return the length of the path up to a time, at which its point `first` was passed."""
        begin_m, last = self._lengths_m[first], len(self._times_s) - 1
        if first == last:
            return begin_m
        begin_s, end_s = self._times_s[first], self._times_s[first + 1]
        share = min(max((time_s - begin_s) / (end_s - begin_s), 0.0), 1.0)
        return begin_m + share * (self._lengths_m[first + 1] - begin_m)

    def _beside(
        self, view: TrafficView, carrot: Carrot, first: int, run_out: RunOut
    ) -> tuple[Volume, float]:
        """Return the free part of the line along which the vehicle runs out, and its length.

        Where the path turns, this line leaves the granted part of the path. If others are on the
        line, the setpoint must be slow enough to stop before them.
        """
        state = carrot.state
        speed = norm(state.velocity_enu_m_s)
        if speed < STANDS_M_S:
            return NOWHERE, math.inf
        length_m = run_out.length_m(speed)
        course = scale(state.velocity_enu_m_s, 1.0 / speed)
        begin_m = self._length_m(carrot.time_s, first)
        if self._is_straight(begin_m, state.position_enu_m, course, length_m):
            return NOWHERE, math.inf  # the path itself is what is reserved
        start, direction = np.array(state.position_enu_m), np.array(course)
        line, away_m = densified(
            np.array([start, start + direction * length_m]), np.array([0.0, length_m])
        )
        until_m = self.lengths_m[first] + length_m + 1.0
        ahead = self.points_enu_m[first : int(np.searchsorted(self.lengths_m, until_m)) + 1]
        apart = np.linalg.norm(line[:, None] - ahead, axis=2).min(axis=1) > _LATE_NOISE_M + 0.5
        if not apart.any():
            return NOWHERE, math.inf
        volume = view.volume(line)
        count = view.reservations.free_count(view.name, volume)
        free_m = math.inf if count >= len(line) else float(away_m[max(count - 1, 0)])
        return volume.part(0, max(count, 1)), free_m

    def _is_straight(
        self, begin_m: float, start: Vector3, course: Vector3, length_m: float
    ) -> bool:
        """Whether the path leads straight on from a point for a length at least.

        Args:
            begin_m: length of the path up to that point.
            start: the point.
            course: unit vector, where it leads straight on to.
            length_m: that length.
        """
        last = bisect_left(self._lengths_m, begin_m + length_m)
        if last >= len(self._lengths_m):
            return False
        x, y, z = self.points_enu_m[last].tolist()
        ahead = subtract((x, y, z), start)
        along_m = dot(ahead, course)
        aside_m = norm(subtract(ahead, scale(course, along_m)))
        return (
            self._lengths_m[last] - begin_m < along_m + _STRAIGHT_M and aside_m < 2.0 * _STRAIGHT_M
        )
