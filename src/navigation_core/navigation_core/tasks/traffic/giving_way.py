"""Gives way to intruders: slower along the path, or out of their path, and back once they passed.

Several times a second the planned flight is compared with the motion of the intruders. Nothing
changes while the required distance is kept. Otherwise the vehicle flies the fastest ground speed
along the path that keeps it. If no speed does, not even standing, it flies the evasion that keeps
the most distance.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from navigation_core.geometry import KinematicState, norm
from navigation_core.planning.conflicts import MotionSamples
from navigation_core.tasks.conditions import measured_state
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traffic.entries import TrafficWait, wait_for
from navigation_core.tasks.traffic.evasions import AFTER_S, ENOUGH, TOO_NEAR, EvasionSearch
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Array, densified
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.trajectory import Trajectory, plan_to

__all__ = ["GivingWay"]

_CHECK_PERIOD_S = 0.2
# An evasion is flown for this time at least; another one replaces it if its penalty is at most this
# share of the present one's.
_EVASION_MIN_S, _BETTER_SHARE = 0.6, 0.8
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
# Below this planned speed the share is not computed from it.
_PLANNED_SPEED_MIN_M_S = 0.5
# Progress: the remaining length is the least ever, by this much.
_PROGRESS_MIN_M = 1.0

_IsFree = Callable[[Array], bool]


class GivingWay:
    """Lets the flight of one goal give way."""

    def __init__(self, traits: Traits, follower: PathFollower) -> None:
        """Prepare.

        Args:
            traits: what the vehicle can do.
            follower: of its path.
        """
        self._traits = traits
        self._follower = follower
        self._checked_s = self._taken_s = -math.inf
        self._share = 1.0
        self._evasion: Carrot | None = None
        self._stepped_s = -math.inf
        self._least_left_m = math.inf
        self.waiting: TrafficWait | None = None
        """The intruder that it gives way to, and why; None while it does not."""
        self.waited_s = 0.0
        """Time for which it has given way since its last progress."""

    @property
    def evades(self) -> bool:
        """Whether it flies an evasion, or has flown it and waits at its end."""
        return self._evasion is not None and self._evasion is self._follower.carrot

    def forget(self) -> None:
        """Forget the path; the vehicle does not follow it now."""
        self._evasion, self.waiting, self._share = None, None, 1.0

    def step(
        self,
        view: TrafficView,
        observation: Observation,
        carrot: Carrot,
        share: float,
        is_free: _IsFree,
        now: float,
    ) -> float:
        """Return the share of its speed that the setpoint may have.

        The path may be changed: for an evasion, or forgotten, to be planned again to the goal.

        Args:
            view: the traffic.
            observation: the measurements.
            carrot: the motion that is flown.
            share: the share that it may have without intruders.
            is_free: whether a line of points (N, 3) of the map is clear of obstacles.
            now: time in seconds.
        """
        self._count(observation, now)
        evades = self.evades
        if now - self._checked_s < _CHECK_PERIOD_S:
            return share if evades else share * self._share
        self._checked_s = now
        state = self._state(observation, carrot)
        search = self._search(view, state, now)
        if search is None:
            self._return(evades)
            return share
        if evades:
            self._continue(search, view, state, carrot, is_free, now)
            return share
        best, least, who = 0.0, math.inf, ""
        for one in _SHARES:
            kept, penalty, name = search.judged(
                self._motion_at(carrot, observation, share * one)[None]
            )
            if penalty < least:
                best, least = one, penalty
            who = who or name
            if kept >= (1.0 if one <= self._share else ENOUGH):
                self._limit_speed(one, who, now)
                return share * one
        if self._evade(search, view, state, least, is_free, now):
            carrot, share, best = self._follower.carrot or carrot, 1.0, 1.0
        self._share = best
        motion = self._motion_at(carrot, observation, share * best)
        self.waiting = search.wait(self.waiting, who, motion, now)
        return share * best

    def stand(
        self, view: TrafficView, observation: Observation, is_free: _IsFree, now: float
    ) -> bool:
        """Leave the position where the vehicle stands, if an intruder comes and an evasion helps.

        Returns:
            Whether the follower has another path.
        """
        carrot = self._follower.carrot
        if carrot is None or not self._traits.flies or now - self._checked_s < _CHECK_PERIOD_S:
            return False
        self._checked_s = now
        state = self._state(observation, carrot)
        search = self._search(view, state, now)
        if search is None or now - self._taken_s < _EVASION_MIN_S:
            return False
        kept, penalty, _ = search.judged(self._motion_at(carrot, observation, 1.0)[None])
        return kept < 1.0 and self._evade(
            search, view, state, _BETTER_SHARE * penalty, is_free, now
        )

    def _count(self, observation: Observation, now: float) -> None:
        """Count the time without progress: an intruder that circles comes back repeatedly."""
        stepped_s, self._stepped_s = self._stepped_s, now
        if self.waiting is None:
            return
        self.waited_s += min(now - stepped_s, _CHECK_PERIOD_S)
        places = [measured_state(observation).position_enu_m]
        places += [point.position_enu_m for point in self._follower.points]
        left_m = sum(itertools.starmap(math.dist, itertools.pairwise(places)))
        if left_m < self._least_left_m - _PROGRESS_MIN_M:
            self._least_left_m, self.waited_s = left_m, 0.0

    def _search(self, view: TrafficView, state: KinematicState, now: float) -> EvasionSearch | None:
        if not view.reservations.has_intruders:
            return None
        limits = self._follower.limits
        speed_m_s = math.hypot(limits.speed_horizontal_m_s, limits.speed_up_m_s)
        intruders = view.intruders(state.position_enu_m, speed_m_s, now)
        if not len(intruders):
            return None
        return EvasionSearch(view, intruders, limits, self._traits.flies)

    def _return(self, evades: bool) -> None:
        """Fly to the goal, as no intruder is near."""
        if evades:
            self._follower.leave_path()  # the next path begins at the setpoint
        self._evasion, self.waiting, self._share = None, None, 1.0

    def _limit_speed(self, of_allowed: float, who: str, now: float) -> None:
        self._share = of_allowed
        if of_allowed == 1.0:
            self.waiting = None
        else:
            self.waiting = wait_for(self.waiting, who, TOO_NEAR, now)

    def _continue(
        self,
        search: EvasionSearch,
        view: TrafficView,
        state: KinematicState,
        carrot: Carrot,
        is_free: _IsFree,
        now: float,
    ) -> None:
        """Return to the goal once that is safe; else continue the evasion, or a better one."""
        points = [point.position_enu_m for point in self._follower.points]
        kept, _, who = search.along(state, points)
        if kept >= ENOUGH:
            self._return(True)
            return
        motion = self._trajectory(carrot, 1.0, 1.0)
        self.waiting = search.wait(self.waiting, who, motion, now)
        kept, penalty, _ = search.judged(motion[None])
        if kept < 1.0 and now - self._taken_s >= _EVASION_MIN_S:
            self._evade(search, view, state, _BETTER_SHARE * penalty, is_free, now)

    def _evade(
        self,
        search: EvasionSearch,
        view: TrafficView,
        state: KinematicState,
        penalty_max: float,
        is_free: _IsFree,
        now: float,
    ) -> bool:
        """Take the best evasion with less than a penalty; return whether there is one."""
        follower = self._follower
        target = follower.points[0].position_enu_m
        for found in search.evasions(state, target, penalty_max, is_free):
            start = state if self._traits.flies else KinematicState(state.position_enu_m)
            trajectory = plan_to(start, found.end_enu_m, follower.limits)
            samples = MotionSamples.of(trajectory)
            line, _ = densified(samples.positions_enu_m, samples.times_s)
            if not (view.admits(line, ends_where_asked=False) and is_free(line)):
                continue  # the motion begins with the present velocity, beside the line
            if view.reservations.blocked_by(view.name, view.volume(line)) is not None:
                continue
            follower.take(CheckedPath(trajectory, (), samples), leads_to_goal=False)
            self._evasion, self._taken_s, self._share = follower.carrot, now, 1.0
            return True
        return False

    # --- motions -----------------------------------------------------------------------------

    def _state(self, observation: Observation, carrot: Carrot) -> KinematicState:
        return carrot.state if self._traits.flies else measured_state(observation)

    def _motion_at(self, carrot: Carrot, observation: Observation, share: float) -> Array:
        """Return where the vehicle is at each moment, at a share of the planned speed, (T, 3)."""
        rate = carrot.rate
        if not self._traits.flies:
            planned_m_s = max(norm(carrot.nominal.velocity_enu_m_s), _PLANNED_SPEED_MIN_M_S)
            rate = min(norm(measured_state(observation).velocity_enu_m_s) / planned_m_s, 1.0)
        return self._trajectory(carrot, rate, share)

    def _trajectory(self, carrot: Carrot, rate: float, share: float) -> Array:
        trajectory: Trajectory = carrot.trajectory
        speed_m_s = max(norm(carrot.nominal.velocity_enu_m_s), _PLANNED_SPEED_MIN_M_S)
        changes_s = max(
            abs(share - rate) * speed_m_s / trajectory.limits.acceleration_horizontal_m_s2, 1e-3
        )
        rates = rate + (share - rate) * np.clip(AFTER_S / changes_s, 0.0, 1.0)
        steps_s = np.diff(AFTER_S) * 0.5 * (rates[1:] + rates[:-1])
        times_s = carrot.time_s + np.concatenate([[0.0], np.cumsum(steps_s)])
        return trajectory.samples(times_s)[0]
