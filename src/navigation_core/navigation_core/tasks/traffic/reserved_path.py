"""Reserves the path of one flight step by step, and says how far it may get within that."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import Vector3, norm
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.safety.stopping_distance import stopping_distance_m
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.traffic.entries import Ask, TrafficWait
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import NOWHERE, Array, Volume, densified, joined
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
        first = max(int(np.searchsorted(self.times_s, carrot.time_s, side="right")) - 1, 0)
        count, granted = len(self.times_s), max(self._granted - first, 0)
        beside, aside_m = self._beside(view, carrot, first, run_out)
        tail = (
            view.volume(np.array([here_enu_m, carrot.state.position_enu_m])),
            self._behind(first, here_enu_m),
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
        if self._granted >= count:
            return Within(math.inf, aside_m, waiting)
        end_m = self.lengths_m[max(self._granted - 1, 0)]
        place_m = float(np.interp(carrot.time_s, self.times_s, self.lengths_m))
        return Within(max(float(end_m) - place_m, 0.0), aside_m, waiting)

    def begins_free(self, view: TrafficView, stop_m: float) -> bool:
        """Whether its beginning, up to where the vehicle could stop, can be reserved."""
        count = max(int(np.searchsorted(self.lengths_m, stop_m)) + 1, 2)
        return view.reservations.blocked_by(view.name, self.volume, count) is None

    def _ask(
        self, carrot: Carrot, first: int, granted: int, speed_m_s: float, run_out: RunOut
    ) -> Ask:
        start_s = 0.0 if speed_m_s > 0.5 else 1.0
        top_m_s = carrot.trajectory.limits.speed_horizontal_m_s
        needed_m = self.lengths_m[first] + run_out.length_m(top_m_s)
        ahead_m = needed_m + np.array([_RESERVED_AHEAD_S, _RESERVED_LEAST_S]) * speed_m_s
        count = len(self.times_s)
        wanted, enough = np.searchsorted(self.lengths_m, ahead_m, side="right").tolist()
        return Ask(
            self.volume.part(first),
            np.maximum(self.times_s[first:] - carrot.time_s, 0.0) + start_s,
            granted,
            min(wanted + 1, count) - first,
            min(enough + 1, count) - first,
            self,
            first,
        )

    def _behind(self, first: int, here_enu_m: Vector3) -> Volume:
        """Return the part of the path between a vehicle that is late and its setpoint."""
        begin = first
        nearest_m = math.dist(self.points_enu_m[first], here_enu_m)
        while begin > 0:
            away_m = math.dist(self.points_enu_m[begin - 1], here_enu_m)
            if away_m > nearest_m + _LATE_NOISE_M:
                break
            begin, nearest_m = begin - 1, min(nearest_m, away_m)
        return self.volume.part(begin, first + 1)

    def _beside(
        self, view: TrafficView, carrot: Carrot, first: int, run_out: RunOut
    ) -> tuple[Volume, float]:
        """Return the free part of the line along which the vehicle runs out, and its length.

        Where the path turns, this line leaves the granted part of the path. If others are on the
        line, the setpoint must be slow enough to stop before them.
        """
        state = carrot.state
        start = np.array(state.position_enu_m)
        speed = norm(state.velocity_enu_m_s)
        if speed < STANDS_M_S:
            return NOWHERE, math.inf
        length_m = run_out.length_m(speed)
        direction = np.array(state.velocity_enu_m_s) / speed
        if self._is_straight(carrot.time_s, start, direction, length_m):
            return NOWHERE, math.inf  # the path itself is what is reserved
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

    def _is_straight(self, time_s: float, start: Array, direction: Array, length_m: float) -> bool:
        """Whether the path leads straight on from its point at a time, for this length at least."""
        begin_m = float(np.interp(time_s, self.times_s, self.lengths_m))
        last = int(np.searchsorted(self.lengths_m, begin_m + length_m))
        if last >= len(self.lengths_m):
            return False
        ahead = self.points_enu_m[last] - start
        along_m = float(ahead @ direction)
        aside_m = float(np.linalg.norm(ahead - along_m * direction))
        return (
            self.lengths_m[last] - begin_m < along_m + _STRAIGHT_M and aside_m < 2.0 * _STRAIGHT_M
        )
