"""Flies a path among other vehicles: as fast as what is reserved allows, or around them.

At every step more of the path is reserved (:mod:`navigation_core.traffic.reservations`), and the
setpoint is only so fast that the vehicle stops within that, even if no other setpoint follows. If
it would have to wait for long, or must give way, a detour is searched for. It gives way to
intruders, which reserve nothing, in :mod:`navigation_core.tasks.leading.giving_way`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    norm,
    scale,
    unit_between,
)
from navigation_core.limits import Limits
from navigation_core.planning.conflicts import MotionSamples, first_conflict
from navigation_core.safety.stopping_distance import stopping_distance_m, stopping_speed_m_s
from navigation_core.searches import Search
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.giving_way import GivingWay
from navigation_core.tasks.leading.path_follower import PathFollower, joins
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.measurement import measured_state
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.traits import Traits
from navigation_core.traffic.detours import Detour, DetourSearch
from navigation_core.traffic.entries import Ask
from navigation_core.traffic.right_of_way import TrafficWait
from navigation_core.traffic.traffic_view import TrafficView
from navigation_core.traffic.volumes import NOWHERE, Array, Volume, densified, joined
from navigation_core.trajectories.route_trajectory import RoutePoint, plan_route
from navigation_core.trajectories.trajectory import Trajectory, TrajectoryError

__all__ = ["BRAKE_SHARE", "NO_DETOUR_RETRY_S", "REACTION_S", "IsFree", "PathInTraffic"]

BRAKE_SHARE = 0.6
"""Share of the maximum acceleration that is planned for the stop at the end of the reservation"""

REACTION_S = 0.3
"""Time until that stop begins"""

NO_DETOUR_RETRY_S = 5.0
"""Time for which a vehicle that found no detour need not search for one again"""

# Up to this speed a flying vehicle is led by positions alone: without a velocity in the setpoint it
# does not fly on when setpoints end.
_BY_POSITION_M_S = 1.0
# Time of flight at the present speed that is reserved beyond the stopping distance, and the least,
# below which the vehicle asks for more.
_RESERVED_AHEAD_S, _RESERVED_LEAST_S = 3.0, 1.5
# Number of points ahead that are checked for other vehicles.
_LOOK_AHEAD_POINTS = 160
# Delay from which a detour is searched for, time that it must save, time between two searches.
_DETOUR_DELAY_MIN_S, _DETOUR_GAIN_MIN_S, _DETOUR_RETRY_S = 1.0, 1.0, 2.0
# Below this speed the vehicle stands; a distance that grows by less than this is position noise.
_STANDS_M_S, _LATE_NOISE_M = 0.1, 0.3
# A path is straight if it is longer than the straight line by less than this.
_STRAIGHT_M = 0.03
# Maximum number of times a flight steps aside, so that it ends.
_ASIDES_MAX = 5
# Radius by which corners of a detour are cut.
_CORNER_M = 1.0


@dataclass(frozen=True, eq=False)
class _Course:
    """A trajectory as points that can be reserved.

    Attributes:
        trajectory: the motion.
        times_s: shape (N,), trajectory time.
        points_enu_m: shape (N, 3), map frame.
        lengths_m: from the beginning to each point, shape (N,).
        volume: the same points as a volume.
    """

    trajectory: Trajectory
    times_s: Array
    points_enu_m: Array
    lengths_m: Array
    volume: Volume

    @classmethod
    def of(cls, trajectory: Trajectory, view: TrafficView) -> _Course:
        samples = MotionSamples.of(trajectory)
        points, times_s = densified(samples.positions_enu_m, samples.times_s)
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        lengths_m = np.concatenate([[0.0], np.cumsum(steps)])
        return cls(trajectory, times_s, points, lengths_m, view.volume(points))

    def is_straight(self, time_s: float, start: Array, direction: Array, length_m: float) -> bool:
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


@dataclass(frozen=True)
class _Looking:
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


class PathInTraffic:
    """The pace of one flight among others."""

    def __init__(
        self, traits: Traits, follower: PathFollower, avoidance: AvoidanceConfig | None
    ) -> None:
        """Prepare.

        Args:
            traits: what the vehicle can do.
            follower: of its path.
            avoidance: how it keeps away from obstacles; None for not at all.
        """
        self._traits = traits
        self._follower = follower
        self._avoidance = avoidance
        self._giving_way = GivingWay(traits, follower)
        self._course: _Course | None = None
        self._granted = 0
        self._allowed_m_s = math.inf
        self._running_m_s = self._aside_m = math.inf
        self._braking_m_s2 = self._braking()
        # The stop or detour that was put in place of the path. After a replan the follower has
        # another motion, and this one no longer counts.
        self._elsewhere: Carrot | None = None
        self._stops = False
        self._looking: _Looking | None = None
        self._looked_s = -math.inf
        self._waiting: TrafficWait | None = None
        # Time since which it stands and waits.
        self._stood_s: float | None = None
        self._asides = 0
        self.detours = 0
        """How often a detour was taken."""

    @property
    def waiting(self) -> TrafficWait | None:
        """The vehicle that this one waits for, and why; None while it is not slowed down."""
        return self._giving_way.waiting or self._waiting

    @property
    def leads_elsewhere(self) -> bool:
        """Whether the path is a stop, or leads aside, so that its end is not the target."""
        return self._left_path or self._giving_way.evades

    @property
    def _left_path(self) -> bool:
        """Whether the path is its own stop or detour, not one that replaced it since."""
        return self._elsewhere is not None and self._elsewhere is self._follower.carrot

    @property
    def _is_stop(self) -> bool:
        """Whether the path is a stop, which lies within the reserved part of the path before it."""
        return self._stops and self._left_path

    def progress(self, progress: Progress) -> Progress:
        """Return the progress of a flight, with what it waits for."""
        waiting = self.waiting
        if waiting is None:
            return progress
        return replace(progress, status=Status.WAITING_FOR_TRAFFIC, blocked=waiting.text)

    def is_over(self, observation: Observation, now: float) -> bool:
        """Whether the vehicle has waited for too long."""
        view = observation.traffic
        if view is None:
            return False
        if self._giving_way.waiting is not None:
            return self._giving_way.waited_s > view.timeout_s
        if self._waiting is None or self._stood_s is None:
            return False
        return now - self._stood_s > view.timeout_s

    def gives_way(self, observation: Observation, now: float) -> bool:
        """Leave the position where the vehicle stands, if an intruder comes and an evasion helps.

        Returns:
            Whether the follower has another path.
        """
        view = observation.traffic
        return view is not None and self._giving_way.stand(
            view, observation, self._clear(observation), now
        )

    def forget(self) -> None:
        """Forget the path; the vehicle does not follow it now."""
        self._giving_way.forget()
        self._course, self._granted, self._waiting = None, 0, None
        self._stood_s = None
        self._elsewhere = None
        if self._looking is not None:
            self._looking.search.abandon()
            self._looking = None

    def step(self, observation: Observation, now: float) -> float:
        """Reserve what is ahead, and return the share of its speed that the setpoint may have.

        There must be a path. It may be changed: for a detour, or for a stop.
        """
        view = observation.traffic
        if view is not None and self._follower.carrot is not None:
            self._braking_m_s2 = self._braking()
            self._take_detour(view, observation, now)
        carrot = self._follower.carrot
        if view is None or carrot is None:
            self.forget()
            return 1.0
        if self._left_path and carrot.ended:
            # The next path begins at the setpoint, where the vehicle stands.
            self._elsewhere = self._follower.carrot = None
            return 1.0
        if self._is_stop:
            return 1.0
        course = self._course_of(carrot, view, now)
        room_m = self._reserve(view, course, carrot, observation, now)
        self._running_m_s = self._speed_for(min(room_m, self._aside_m), runs_out=True)
        self._allowed_m_s = min(
            self._speed_for(room_m, runs_out=False), max(self._running_m_s, _BY_POSITION_M_S)
        )
        speed_m_s = self._speed_m_s(carrot, observation)
        if self._traits.flies and speed_m_s > self._stopping_speed_m_s(room_m) + _STANDS_M_S:
            self._follower.plan_stop(observation)
            self._course, self._elsewhere, self._stops = None, self._follower.carrot, True
            return 1.0
        if self._giving_way.waiting is None:
            self._look_around(view, course, observation, carrot, now)
        share = self._share(carrot)
        share = self._giving_way.step(
            view, observation, carrot, share, self._clear(observation), now
        )
        if self.waiting is not None:
            carrot.restart_patience()
        if self._waiting is None or speed_m_s > _STANDS_M_S:
            self._stood_s = None
        elif self._stood_s is None:
            self._stood_s = now
        return share

    def limited(self, setpoint: Setpoint, observation: Observation) -> Setpoint:
        """Return a setpoint that leads no further than the reservation if no other follows."""
        if observation.traffic is None or self._course is None or self._is_stop:
            return setpoint
        speed = norm(setpoint.velocity_enu_m_s)
        if self._traits.flies:
            if speed <= self._running_m_s * 1.02 or speed < _STANDS_M_S:
                return setpoint
            return replace(setpoint, velocity_enu_m_s=ZERO, acceleration_enu_m_s2=ZERO)
        allowed_m_s = min(self._allowed_m_s, self._running_m_s)
        if speed <= allowed_m_s:
            return setpoint
        if allowed_m_s < _STANDS_M_S:
            return without_turn(replace(setpoint, velocity_enu_m_s=ZERO), observation)
        return replace(
            setpoint, velocity_enu_m_s=scale(setpoint.velocity_enu_m_s, allowed_m_s / speed)
        )

    # --- what is reserved --------------------------------------------------------------------

    def _course_of(self, carrot: Carrot, view: TrafficView, now: float) -> _Course:
        """Return the path as it can be reserved; of another path, nothing is reserved yet."""
        course = self._course
        if course is None or course.trajectory is not carrot.trajectory:
            course = self._course = _Course.of(carrot.trajectory, view)
            self._granted = 0
            self._looked_s = min(self._looked_s, now - _DETOUR_RETRY_S)
        return course

    def _reserve(
        self,
        view: TrafficView,
        course: _Course,
        carrot: Carrot,
        observation: Observation,
        now: float,
    ) -> float:
        """Reserve more of the path, and return how much of it is, in metres from the setpoint."""
        here = measured_state(observation).position_enu_m
        first = max(int(np.searchsorted(course.times_s, carrot.time_s, side="right")) - 1, 0)
        count, granted = len(course.times_s), max(self._granted - first, 0)
        tail = (
            view.volume(np.array([here, carrot.state.position_enu_m])),
            self._behind(course, first, here),
            self._run_out(view, carrot, course, first),
        )
        if view.reservations.is_settled(view.name, course, now):
            held = joined(*tail, course.volume.part(first, first + granted))
            self._waiting = view.reservations.follow(view.name, held, now)
        else:
            ask = self._ask(carrot, course, first, granted, self._speed_m_s(carrot, observation))
            grant = view.reservations.extend(view.name, ask, joined(*tail), now)
            granted, self._waiting = grant.granted, grant.waiting
        self._granted = first + granted
        if self._granted >= count:
            return math.inf
        end_m = course.lengths_m[max(self._granted - 1, 0)]
        place_m = float(np.interp(carrot.time_s, course.times_s, course.lengths_m))
        return max(float(end_m) - place_m, 0.0)

    def _ask(
        self, carrot: Carrot, course: _Course, first: int, granted: int, speed_m_s: float
    ) -> Ask:
        start_s = 0.0 if speed_m_s > 0.5 else 1.0
        top_m_s = carrot.trajectory.limits.speed_horizontal_m_s
        needed_m = course.lengths_m[first] + self._run_out_m(top_m_s)
        ahead_m = needed_m + np.array([_RESERVED_AHEAD_S, _RESERVED_LEAST_S]) * speed_m_s
        count = len(course.times_s)
        wanted, enough = np.searchsorted(course.lengths_m, ahead_m, side="right").tolist()
        return Ask(
            course.volume.part(first),
            np.maximum(course.times_s[first:] - carrot.time_s, 0.0) + start_s,
            granted,
            min(wanted + 1, count) - first,
            min(enough + 1, count) - first,
            course,
            first,
        )

    def _run_out_m(self, speed_m_s: float) -> float:
        delay_s = self._traits.setpoint_timeout_s + REACTION_S
        return stopping_distance_m(speed_m_s, delay_s, self._braking_m_s2)

    def _braking(self) -> float:
        """Return the planned braking of a stop, m/s^2."""
        limit = self._follower.limits.acceleration_horizontal_m_s2
        if not self._traits.flies:
            limit = min(limit, self._traits.braking_m_s2)
        carrot = self._follower.carrot
        course = None if carrot is None else unit_between(ZERO, carrot.state.velocity_enu_m_s)
        if course is not None and self._traits.flies:
            limit = min(limit, self._follower.limits.along(course).acceleration_m_s2)
        return BRAKE_SHARE * limit

    @staticmethod
    def _behind(course: _Course, first: int, here: Vector3) -> Volume:
        """Return the part of the path between a vehicle that is late and its setpoint."""
        begin = first
        nearest_m = math.dist(course.points_enu_m[first], here)
        while begin > 0:
            away_m = math.dist(course.points_enu_m[begin - 1], here)
            if away_m > nearest_m + _LATE_NOISE_M:
                break
            begin, nearest_m = begin - 1, min(nearest_m, away_m)
        return course.volume.part(begin, first + 1)

    def _run_out(self, view: TrafficView, carrot: Carrot, course: _Course, first: int) -> Volume:
        """Return the free part of the line along which the vehicle runs out after a last setpoint.

        Where the path turns, this line leaves the granted part of the path. If others are on the
        line, the setpoint must be slow enough to stop before them.
        """
        state = carrot.state
        start = np.array(state.position_enu_m)
        self._aside_m = math.inf
        speed = norm(state.velocity_enu_m_s)
        if speed < _STANDS_M_S:
            return NOWHERE
        length_m = self._run_out_m(speed)
        direction = np.array(state.velocity_enu_m_s) / speed
        if course.is_straight(carrot.time_s, start, direction, length_m):
            return NOWHERE  # the path itself is what is reserved
        line, away_m = densified(
            np.array([start, start + direction * length_m]), np.array([0.0, length_m])
        )
        until_m = course.lengths_m[first] + length_m + 1.0
        ahead = course.points_enu_m[first : int(np.searchsorted(course.lengths_m, until_m)) + 1]
        apart = np.linalg.norm(line[:, None] - ahead, axis=2).min(axis=1) > _LATE_NOISE_M + 0.5
        if not apart.any():
            return NOWHERE
        volume = view.volume(line)
        count = view.reservations.free_count(view.name, volume)
        if count < len(line):
            self._aside_m = float(away_m[max(count - 1, 0)])
        return volume.part(0, max(count, 1))

    # --- how fast ------------------------------------------------------------------------------

    def _speed_m_s(self, carrot: Carrot, observation: Observation) -> float:
        if self._traits.flies:
            return norm(carrot.state.velocity_enu_m_s)
        return norm(measured_state(observation).velocity_enu_m_s)

    def _speed_for(self, room_m: float, runs_out: bool) -> float:
        """Return the maximum speed from which the vehicle stops, or runs out, within some room."""
        delay_s = self._traits.setpoint_timeout_s if runs_out else REACTION_S
        return stopping_speed_m_s(room_m, delay_s, self._braking_m_s2)

    def _stopping_speed_m_s(self, room_m: float) -> float:
        """Return the maximum speed from which the hardest braking stops within some room."""
        return stopping_speed_m_s(room_m, 0.0, self._braking_m_s2 / BRAKE_SHARE)

    def _share(self, carrot: Carrot) -> float:
        speed_m_s = norm(carrot.nominal.velocity_enu_m_s)
        ahead_m_s = norm(carrot.trajectory.sample(carrot.time_s + 0.3).velocity_enu_m_s)
        speed_m_s = max(speed_m_s, ahead_m_s, _STANDS_M_S)
        if self._allowed_m_s >= 0.9 * speed_m_s:
            self._waiting = None
        if self._allowed_m_s < _STANDS_M_S:
            return 0.0
        return min(self._allowed_m_s / speed_m_s, 1.0)

    # --- detours -------------------------------------------------------------------------------

    def _look_around(
        self,
        view: TrafficView,
        course: _Course,
        observation: Observation,
        carrot: Carrot,
        now: float,
    ) -> None:
        """Begin to look for a detour where waiting would take longer."""
        if self._looking is not None or now - self._looked_s < _DETOUR_RETRY_S:
            return
        stands = self._speed_m_s(carrot, observation) < _STANDS_M_S
        is_needed = self._waiting is not None and stands and view.must_give_way(now)
        first = int(np.searchsorted(course.times_s, carrot.time_s))
        after_s = course.times_s[first : first + _LOOK_AHEAD_POINTS] - carrot.time_s
        path = course.volume.part(first, first + _LOOK_AHEAD_POINTS)
        self._looked_s = now
        if not len(path):
            return
        delay_s = view.reservations.delay_s(view.name, path, after_s, now)
        if delay_s < _DETOUR_DELAY_MIN_S and not is_needed:
            return
        self._begin(view, observation, carrot, delay_s, is_needed, now)

    def _begin(
        self,
        view: TrafficView,
        observation: Observation,
        carrot: Carrot,
        delay_s: float,
        is_needed: bool,
        now: float,
    ) -> None:
        joint_s, start = carrot.ahead(view.searcher.lead_s)
        if not self._traits.flies:
            if norm(measured_state(observation).velocity_enu_m_s) > 2.0 * _STANDS_M_S:
                return
            start = KinematicState(measured_state(observation).position_enu_m)
        points = self._follower.points
        left_s = carrot.time_remaining_s
        frozen = replace(view, reservations=view.reservations.snapshot())
        search = DetourSearch(frozen, self._follower.limits, self._clear(observation), now)
        limits = self._follower.limits
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

        self._looking = _Looking(view.searcher.begin(work), carrot, joint_s, is_needed)

    def _clear(self, observation: Observation) -> IsFree:
        config = self._avoidance
        clearance_m = 0.0 if config is None else config.plan_clearance_m
        return IsFree(observation, clearance_m, config is not None)

    def _take_detour(self, view: TrafficView, observation: Observation, now: float) -> None:
        looking = self._looking
        if looking is None:
            return
        if looking.carrot is not self._follower.carrot:
            looking.search.abandon()
            self._looking = None
            return
        try:
            result = looking.search.result()
        except TrajectoryError:
            result = (None, False)
        if result is None or (
            not looking.carrot.ended
            and looking.carrot.time_s < looking.joint_s
            and self._traits.flies
        ):
            return
        self._looking = None
        path, leads_aside = result
        if path is None:
            _note_stuck(looking, view, now)
            return
        late_s = looking.carrot.time_s - looking.joint_s if self._traits.flies else 0.0
        if looking.carrot.ended:
            late_s = 0.0
        commanded = self._follower.commanded
        if self._traits.flies and (commanded is None or not joins(commanded.state, path, late_s)):
            return
        if not self._begins_free(view, path, now):
            _note_stuck(looking, view, now)
        else:
            self.detours += 1
            self._asides += leads_aside
            self._follower.take(replace(path, entered_s=max(late_s, 0.0)), not leads_aside)
            self._elsewhere = self._follower.carrot if leads_aside else None
            self._course, self._stops = None, False

    def _begins_free(self, view: TrafficView, path: CheckedPath, now: float) -> bool:
        """Whether its beginning, up to where the vehicle could stop, can be reserved."""
        course = _Course.of(path.trajectory, view)
        speed = norm(path.trajectory.start.velocity_enu_m_s)
        needed_m = stopping_distance_m(speed, 0.0, self._braking_m_s2) + 0.5
        count = max(int(np.searchsorted(course.lengths_m, needed_m)) + 1, 2)
        return view.reservations.blocked_by(view.name, course.volume, count) is None


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


def _note_stuck(looking: _Looking, view: TrafficView, now: float) -> None:
    """Let the others in a wait cycle search for a detour if the vehicle that had to found none."""
    if looking.is_needed:
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
