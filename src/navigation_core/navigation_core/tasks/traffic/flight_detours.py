"""Looks for a detour of one flight around other vehicles, and goes over to it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import KinematicState, Vector3, norm
from navigation_core.limits import Limits, stopping_distance_m
from navigation_core.planning.conflicts import MotionSamples, first_conflict
from navigation_core.searches import Search
from navigation_core.tasks.conditions import measured_state
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.path_search import joins
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traffic.detours import Detour, DetourSearch
from navigation_core.tasks.traffic.reserved_path import STANDS_M_S, ReservedPath
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Array
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint, plan_route
from navigation_core.trajectories.trajectory import TrajectoryError

__all__ = ["NO_DETOUR_RETRY_S", "FlightDetours", "IsFree"]

NO_DETOUR_RETRY_S = 5.0
"""Time for which a vehicle that found no detour need not search for one again"""

# Number of points ahead that are checked for other vehicles.
_LOOK_AHEAD_POINTS = 160
# Delay from which a detour is searched for, time that it must save, time between two searches.
_DETOUR_DELAY_MIN_S, _DETOUR_GAIN_MIN_S, _DETOUR_RETRY_S = 1.0, 1.0, 2.0
# Maximum number of times a flight steps aside, so that it ends.
_ASIDES_MAX = 5
# Radius by which corners of a detour are cut.
_CORNER_M = 1.0


class IsFree:
    """Whether a line keeps clear of obstacles."""

    def __init__(self, observation: Observation, clearance_m: float, avoids: bool) -> None:
        self._obstacles = observation.obstacles
        self._clearance_m = clearance_m
        self._avoids = avoids and len(observation.obstacles) > 0
        self._fence = observation.fence

    def __call__(self, line: Array) -> bool:
        """Return whether a line of points (N, 3) of the map is clear."""
        if self._fence is not None:
            places = [_vector(place) for place in line]
            legs = itertools.pairwise(places)
            if any(self._fence.check_leg(*leg) is not None for leg in legs):
                return False
        if not self._avoids:
            return True
        return first_conflict(line, self._obstacles, self._clearance_m) is None


@dataclass(frozen=True)
class _PendingSearch:
    """A search for a detour.

    Attributes:
        search: the search.
        carrot: the motion that the detour branches off from.
        joint_s: time of the branch on that motion's clock.
        is_needed: whether the vehicle has to give way.
    """

    search: Search[tuple[CheckedPath | None, bool]]
    carrot: Carrot
    joint_s: float
    is_needed: bool


class FlightDetours:
    """The detours of one flight."""

    def __init__(self, traits: Traits, follower: PathFollower) -> None:
        """Prepare.

        Args:
            traits: what the vehicle can do.
            follower: of its path.
        """
        self._traits = traits
        self._follower = follower
        self._pending: _PendingSearch | None = None
        # The path that was looked at last, and when.
        self._looked_at: ReservedPath | None = None
        self._looked_s = -math.inf
        self._asides = 0

    @property
    def searches(self) -> bool:
        """Whether a search is pending."""
        return self._pending is not None

    def forget(self) -> None:
        """Abandon a search; the vehicle does not follow its path now."""
        if self._pending is not None:
            self._pending.search.abandon()
            self._pending = None

    def look(
        self,
        view: TrafficView,
        path: ReservedPath,
        observation: Observation,
        carrot: Carrot,
        is_free: IsFree,
        is_stuck: bool,
        now: float,
    ) -> None:
        """Begin to look for a detour where waiting would take longer.

        Args:
            view: the traffic.
            path: the present path.
            observation: the measurements.
            carrot: the setpoint on the path.
            is_free: whether a line is clear of obstacles.
            is_stuck: whether the vehicle stands and waits.
            now: time in seconds.
        """
        if self._follower.ring.part is not None:
            return  # the straight line to the end of a circle is not around anybody: it waits
        is_new = path is not self._looked_at
        if self._pending is not None or not (is_new or now - self._looked_s >= _DETOUR_RETRY_S):
            return
        is_needed = is_stuck and view.must_give_way(now)
        first = int(np.searchsorted(path.times_s, carrot.time_s))
        after_s = path.times_s[first : first + _LOOK_AHEAD_POINTS] - carrot.time_s
        ahead = path.volume.part(first, first + _LOOK_AHEAD_POINTS)
        self._looked_at, self._looked_s = path, now
        if not len(ahead):
            return
        delay_s = view.reservations.delay_s(view.name, ahead, after_s, now)
        if delay_s >= _DETOUR_DELAY_MIN_S or is_needed:
            self._begin(view, observation, carrot, is_free, delay_s, is_needed, now)

    def _begin(
        self,
        view: TrafficView,
        observation: Observation,
        carrot: Carrot,
        is_free: IsFree,
        delay_s: float,
        is_needed: bool,
        now: float,
    ) -> None:
        joint_s, start = carrot.ahead(view.searcher.lead_s)
        if not self._traits.flies:
            here = measured_state(observation)
            if norm(here.velocity_enu_m_s) > 2.0 * STANDS_M_S:
                return
            start = KinematicState(here.position_enu_m)
        points, limits = self._follower.points, self._follower.limits
        left_s = carrot.time_remaining_s
        frozen = replace(view, reservations=view.reservations.snapshot())
        search = DetourSearch(frozen, limits, is_free, now)
        may_step_aside = is_needed and self._asides < _ASIDES_MAX

        def work(_is_wanted: object) -> tuple[CheckedPath | None, bool]:
            place = np.array(start.position_enu_m)
            targets = np.array([point.position_enu_m for point in points])
            found = search.find(place, targets, stands=is_needed)
            if found is not None and not found.points_enu_m and math.isfinite(delay_s):
                found = None  # the present path is as good
            saves = found is not None and found.cost_s < left_s + delay_s - _DETOUR_GAIN_MIN_S
            if found is not None and (saves or is_needed):
                return _planned(start, found, points, limits), False
            if not may_step_aside:
                return None, False
            away = search.aside(place)
            return (None if away is None else _planned(start, away, (), limits)), True

        self._pending = _PendingSearch(view.searcher.begin(work), carrot, joint_s, is_needed)

    def take(self, view: TrafficView, braking_m_s2: float, now: float) -> bool | None:
        """Go over to a detour that was found; return whether it leads aside, None without one."""
        pending = self._pending
        if pending is None:
            return None
        if pending.carrot is not self._follower.carrot:
            self.forget()
            return None
        try:
            result = pending.search.result()
        except TrajectoryError:
            result = (None, False)
        if result is None or (
            not pending.carrot.ended
            and pending.carrot.time_s < pending.joint_s
            and self._traits.flies
        ):
            return None
        self._pending = None
        path, leads_aside = result
        if path is None:
            _note_stuck(pending, view, now)
            return None
        late_s = pending.carrot.time_s - pending.joint_s if self._traits.flies else 0.0
        if pending.carrot.ended:
            late_s = 0.0
        commanded = self._follower.sent.commanded
        if self._traits.flies and (commanded is None or not joins(commanded.state, path, late_s)):
            return None
        speed = norm(path.trajectory.start.velocity_enu_m_s)
        needed_m = stopping_distance_m(speed, 0.0, braking_m_s2) + 0.5
        if not ReservedPath(path.trajectory, view).begins_free(view, needed_m):
            _note_stuck(pending, view, now)
            return None
        self._asides += leads_aside
        self._follower.take(replace(path, entered_s=max(late_s, 0.0)), not leads_aside)
        return leads_aside


def _note_stuck(pending: _PendingSearch, view: TrafficView, now: float) -> None:
    """Let the others in a wait cycle search for a detour if the vehicle that had to found none."""
    if pending.is_needed:
        view.reservations.entry(view.name).stuck_until_s = now + NO_DETOUR_RETRY_S


def _vector(point: Array) -> Vector3:
    return (float(point[0]), float(point[1]), float(point[2]))


def _planned(
    start: KinematicState,
    detour: Detour,
    points: Sequence[RoutePoint],
    limits: Limits,
) -> CheckedPath:
    """Return the motion along a detour and on through the points that were asked for."""
    corner_m = 0.0 if detour.leads_aside else _CORNER_M
    vias = [RoutePoint(point, corner_m, limits) for point in detour.points_enu_m]
    route = plan_route(start, [*vias, *points])
    passed_s = route.passed_s[len(vias) :]
    return CheckedPath(route.trajectory, passed_s, MotionSamples.of(route.trajectory))
