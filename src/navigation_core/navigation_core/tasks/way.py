"""A way through points and around obstacles, as a trajectory that was checked throughout.

The planner's lines become a route whose corners are cut by no more than there is room for.
Then the whole trajectory is sampled, the turn that it begins with included: it must keep a
clearance everywhere, and nowhere be so fast that the brake of :mod:`navigation_core.braking`
would act. Where it does not, that part is flown more slowly and with sharper corners. Where not
even that helps, the vehicle stops first.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from navigation_core.braking import must_brake, stopping_ends
from navigation_core.conflicts import Samples, clearance_at_m, first_conflict
from navigation_core.geometry import (
    ZERO,
    KinematicState,
    Vector3,
    add,
    distance,
    norm,
    scale,
    unit_between,
)
from navigation_core.limits import Limits
from navigation_core.obstacles import Array, Obstacles
from navigation_core.planner import NoPath, PlanLimits, plan
from navigation_core.routes import RoutePoint, RouteTrajectory, plan_route
from navigation_core.tasks.avoidance import AvoidanceConfig
from navigation_core.tasks.base import Traits
from navigation_core.trajectory import Trajectory, plan_stop, plan_to

# A route is planned around obstacles so far ahead, or for so many of its points, to bound the
# work; it is planned on so long before it gets there.
_HORIZON_M, _POINTS_MAX, _EXTEND_S = 100.0, 6, 10.0
# Slower than this a vehicle need not stop before it goes another way.
_SLOW_M_S = 0.3
# So many trajectories are tried along the same lines, and from the same beginning.
_TRIES_MAX, _TRIES_IN_ALL = 3, 4
_SPEED_FACTOR, _CORNER_FACTOR = 0.55, 0.4
# A corner that is cut by less is a stop; slower than this a flight helps nobody.
_CORNER_MIN_M, _SPEED_MIN_M_S = 0.08, 0.4
# Directions and steps in which a clear place is looked for, how many are tried, and what is kept
# there beyond the clearance.
_DIRECTIONS, _RING_M, _PLACES_MAX, _AWAY_M = 16, 0.5, 6, 0.2
# Shares of the corner allowance that are tried, one after the other.
_ALLOWANCE_SHARES = (1.0, 0.4, 0.0)
# What drives strays from its way by about this share of its turning radius.
_STRAY_SHARE = 0.5


@dataclass(frozen=True)
class Way:
    """What is flown.

    Attributes:
        trajectory: the motion.
        passed_s: when each of the points asked for is passed, in trajectory time.
        samples: the motion, to be checked against obstacles.
        extend_s: when it is to be planned on, in trajectory time.
    """

    trajectory: Trajectory
    passed_s: tuple[float, ...]
    samples: Samples
    extend_s: float = math.inf

    @property
    def length_m(self) -> float:
        """Its length."""
        return self.trajectory.remaining_distance_m(0.0)


@dataclass(frozen=True)
class NoWay:
    """There is none.

    Attributes:
        reason: a sentence with the numbers that matter.
    """

    reason: str


@dataclass(frozen=True)
class _Via:
    """A point on the way, and whether it was asked for or is there because of obstacles."""

    point: RoutePoint
    asked: bool


class _Fault(Enum):
    """Where a trajectory could not be made sound."""

    BEGINNING = auto()
    LATER = auto()


class WayPlanner:
    """Plans the ways of one goal."""

    def __init__(self, config: AvoidanceConfig, traits: Traits, limits: Limits) -> None:
        """Prepare.

        Args:
            config: what to keep clear of.
            traits: what the vehicle can do.
            limits: of the flight.
        """
        self._config = config
        self._traits = traits
        self._limits = limits
        self._far: tuple[tuple[RoutePoint, ...], RouteTrajectory] | None = None
        if traits.flies:
            self.braking_limits = limits
            self.emergency_limits = _harder(limits, config.emergency_factor)
        else:
            braking_m_s2 = min(limits.acceleration_horizontal_m_s2, traits.braking_m_s2)
            self.braking_limits = replace(limits, acceleration_horizontal_m_s2=braking_m_s2)
            self.emergency_limits = limits

    def plan(
        self,
        start: KinematicState,
        heading_enu_rad: float,
        points: Sequence[RoutePoint],
        obstacles: Obstacles,
    ) -> Way | NoWay:
        """Return a way from any state by way of points, or why there is none.

        Args:
            start: state at the beginning, in the map frame.
            heading_enu_rad: where the nose of what drives points.
            points: at least one; the last is where the way ends.
            obstacles: what is in the way.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        points, far = self._split(start.position_enu_m, points)
        nearest = min(points, key=lambda p: self._clearance_m(p.position_enu_m, obstacles))
        room_m = self._clearance_m(nearest.position_enu_m, obstacles)
        needed_m = self._config.plan_clearance_m
        if room_m < needed_m:
            x, y, z = nearest.position_enu_m
            return NoWay(
                f"The point ({x:.1f}, {y:.1f}, {z:.1f}) m, which is to be reached, is "
                f"{room_m:.2f} m from an obstacle, where {needed_m:g} m are to be kept."
            )
        reason = "The vehicle has to stop first."
        for begin in self._beginnings(start, obstacles):
            state = start if begin is None else KinematicState(begin.end_position_enu_m)
            left = _TRIES_IN_ALL
            for extra_m in self._extras_m(room_m - needed_m):
                lines = self._lines(state, heading_enu_rad, points, obstacles, extra_m)
                if isinstance(lines, NoPath):
                    reason = f"No way that keeps {needed_m:g} m to all obstacles: {lines.reason}"
                    continue
                tries = min(left, _TRIES_MAX)
                way = self._fly(state, begin, lines, obstacles, tries)
                left -= tries
                if isinstance(way, Way):
                    return self._continued(way, points[-1], far)
                reason = (
                    "A way exists, but none that can be flown from here and keeps "
                    f"{self._config.flown_clearance_m:g} m to all obstacles."
                )
                # Other lines begin with about the same turn.
                if way is _Fault.BEGINNING or left == 0:
                    break
        return NoWay(reason)

    def _split(
        self, place_enu_m: Vector3, points: Sequence[RoutePoint]
    ) -> tuple[Sequence[RoutePoint], tuple[RoutePoint, ...]]:
        """Return the points that are planned through now, and those that are for later."""
        ahead_m = 0.0
        for count, point in enumerate(points, 1):
            ahead_m += distance(place_enu_m, point.position_enu_m)
            place_enu_m = point.position_enu_m
            if count >= _POINTS_MAX or ahead_m >= _HORIZON_M:
                return points[:count], tuple(points[count:])
        return points, ()

    def _continued(self, way: Way, last: RoutePoint, far: tuple[RoutePoint, ...]) -> Way:
        """Add what is for later: as if nothing were in the way, after a stop that never comes."""
        if not far:
            return way
        if self._far is None or self._far[0] != far:
            self._far = (far, plan_route(KinematicState(last.position_enu_m), far))
        route, joint_s = self._far[1], way.trajectory.duration_s
        passed_s = (*way.passed_s, *(joint_s + time_s for time_s in route.passed_s))
        trajectory = way.trajectory.then(route.trajectory)
        return Way(trajectory, passed_s, way.samples, joint_s - _EXTEND_S)

    def _clearance_m(self, position_enu_m: Vector3, obstacles: Obstacles) -> float:
        config = self._config
        within_m = config.plan_clearance_m + config.corner_allowance_m + self._stray_m
        return clearance_at_m(position_enu_m, obstacles, within_m)

    @property
    def _stray_m(self) -> float:
        return _STRAY_SHARE * self._traits.turning_radius_m

    def _extras_m(self, room_m: float) -> list[float]:
        """Return what to keep beyond the clearance, as long as the points asked for have it."""
        extras_m = [
            self._stray_m + share * self._config.corner_allowance_m for share in _ALLOWANCE_SHARES
        ]
        return [extra_m for extra_m in dict.fromkeys((*extras_m, 0.0)) if extra_m <= room_m]

    def _beginnings(
        self, start: KinematicState, obstacles: Obstacles
    ) -> Iterator[Trajectory | None]:
        """Return what a way may begin with: nothing, or a brake if it moves."""
        if not self._acts(Samples.at(start), obstacles)[0]:
            yield None
        if norm(start.velocity_enu_m_s) < _SLOW_M_S:
            return
        stop = plan_stop(start, self.braking_limits)
        braked = Samples.of(stop).positions_enu_m
        if first_conflict(braked, obstacles, self._config.flown_clearance_m) is None:
            yield stop

    def _acts(self, motion: Samples, obstacles: Obstacles) -> NDArray[np.bool_]:
        """Return when the brake would act."""
        config = self._config
        return must_brake(
            motion, obstacles, self.braking_limits, config.brake_clearance_m, config.reaction_s
        )

    # --- lines ---------------------------------------------------------------------------

    def _lines(
        self,
        state: KinematicState,
        heading_enu_rad: float,
        points: Sequence[RoutePoint],
        obstacles: Obstacles,
        extra_m: float,
    ) -> list[_Via] | NoPath:
        """Plan the straight lines from point to point."""
        limits = PlanLimits(
            self._config.plan_clearance_m + extra_m,
            self._config.heights_m if self._traits.flies else None,
            self._traits.turning_radius_m,
            heading_enu_rad if self._traits.turning_radius_m > 0.0 else None,
        )
        corner_m = min(extra_m, self._config.corner_allowance_m)
        place, vias = state.position_enu_m, []
        for point in points:
            path = plan(place, point.position_enu_m, obstacles, limits)
            if isinstance(path, NoPath):
                return path
            corners = path.points_enu_m[1:-1]
            vias += [_Via(RoutePoint(corner, corner_m, point.limits), False) for corner in corners]
            vias.append(_Via(point, True))
            place = point.position_enu_m
            limits = replace(limits, heading_enu_rad=None)
        return vias

    # --- trajectories --------------------------------------------------------------------

    def _fly(
        self,
        state: KinematicState,
        begin: Trajectory | None,
        vias: list[_Via],
        obstacles: Obstacles,
        tries: int,
    ) -> Way | _Fault:
        """Return a trajectory along lines that was found sound, or where none was.

        Args:
            state: where the lines begin.
            begin: what comes before, or None.
            vias: the points of the lines.
            obstacles: what is in the way.
            tries: how many trajectories may be tried.
        """
        for _ in range(tries):
            route = plan_route(state, [via.point for via in vias])
            samples = Samples.of(route.trajectory)
            faults_s = self._faults_s(samples, obstacles)
            if not faults_s:
                return _joined(begin, route, vias)
            gentler = self._gentler(state, vias, route, faults_s)
            if gentler is None:
                break
            vias = gentler
        led_in_s = 0.5 * route.passed_s[0]
        moves = norm(state.velocity_enu_m_s) >= _SLOW_M_S
        return _Fault.BEGINNING if moves and faults_s[0] < led_in_s else _Fault.LATER

    def _faults_s(self, samples: Samples, obstacles: Obstacles) -> list[float]:
        """Return when a trajectory is too near to an obstacle, or too fast towards one."""
        clearance_m = self._config.flown_clearance_m
        near = first_conflict(samples.positions_enu_m, obstacles, clearance_m)
        fast = np.flatnonzero(self._acts(samples, obstacles))
        indices = [*([] if near is None else [near]), *fast]
        return sorted(float(samples.times_s[index]) for index in indices)

    def _gentler(
        self,
        state: KinematicState,
        vias: list[_Via],
        route: RouteTrajectory,
        faults_s: list[float],
    ) -> list[_Via] | None:
        """Return the same lines, to be flown more gently where there were faults."""
        legs: dict[int, float] = {}
        for time_s in faults_s:
            leg = min(bisect.bisect_left(route.passed_s, time_s), len(vias) - 1)
            end = vias[leg].point.position_enu_m
            left_m = distance(route.trajectory.sample(time_s).position_enu_m, end)
            legs[leg] = max(legs.get(leg, 0.0), left_m)
        gentler = []
        places = [state.position_enu_m, *(via.point.position_enu_m for via in vias)]
        for index, (via, place) in enumerate(zip(vias, places, strict=False)):
            point = via.point
            if index in legs or index + 1 in legs:
                point = _sharper(point)
            if index in legs:
                slow = _slower(point)
                if slow is None:
                    return None
                gentler += self._fast_part(place, point, legs[index])
                point = slow
            gentler.append(replace(via, point=point))
        return gentler

    def _fast_part(self, begin_enu_m: Vector3, point: RoutePoint, slow_m: float) -> list[_Via]:
        """Return the point up to which a long line may be flown as it was, if there is one."""
        length_m = distance(begin_enu_m, point.position_enu_m)
        course = unit_between(begin_enu_m, point.position_enu_m)
        if course is None:
            return []
        velocity = scale(course, point.limits.along(course).speed_forward_m_s)
        cruise = Samples.at(KinematicState(ZERO, velocity))
        brake = stopping_ends(cruise, self.braking_limits, self._config.reaction_s)
        slow_m += float(np.linalg.norm(brake))
        if length_m < 2.0 * slow_m:
            return []
        place = add(point.position_enu_m, scale(course, -slow_m))
        return [_Via(RoutePoint(place, self._config.corner_allowance_m, point.limits), False)]

    def stop(self, start: KinematicState, obstacles: Obstacles) -> Way:
        """Return the way of a brake: an emergency's if the usual one leads too near to something.

        Args:
            start: state at the beginning, in the map frame.
            obstacles: what is in the way.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        trajectory = plan_stop(start, self._limits)
        samples = Samples.of(trajectory)
        clearance_m = self._config.conflict_clearance_m
        if first_conflict(samples.positions_enu_m, obstacles, clearance_m) is not None:
            trajectory = plan_stop(start, self.emergency_limits)
            samples = Samples.of(trajectory)
        return Way(trajectory, (), samples)

    # --- giving way ----------------------------------------------------------------------

    def plan_away(self, start: KinematicState, obstacles: Obstacles) -> Way | None:
        """Return a way to the nearest clear place; None if there is none within reach.

        What drives has none: it could not leave sideways, and stands better than it turns.

        Args:
            start: state at the beginning, in the map frame.
            obstacles: what is in the way.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if not self._traits.flies:
            return None
        needed_m = self._config.plan_clearance_m + _AWAY_M
        places = self._places(start.position_enu_m)
        clear = obstacles.clearance_m(places) >= needed_m
        for x, y, z in places[clear][:_PLACES_MAX]:
            trajectory = plan_to(start, (float(x), float(y), float(z)), self.emergency_limits)
            samples = Samples.of(trajectory)
            clearance_m = self._config.conflict_clearance_m
            if first_conflict(samples.positions_enu_m, obstacles, clearance_m) is None:
                return Way(trajectory, (trajectory.duration_s,), samples)
        return None

    def _places(self, here_enu_m: Vector3) -> Array:
        """Return places about one, the nearest first."""
        reach_m, low, high = self._config.give_way_reach_m, here_enu_m[2], here_enu_m[2]
        if self._config.heights_m is not None:
            low, high = self._config.heights_m
        angles = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
        circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
        circle = np.concatenate([circle, [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]])
        radii_m = np.arange(_RING_M, reach_m + _RING_M, _RING_M)
        places = np.array(here_enu_m) + (radii_m[:, None, None] * circle).reshape(-1, 3)
        inside = (places[:, 2] >= low - _RING_M / 2) & (places[:, 2] <= high + _RING_M / 2)
        return np.asarray(places[inside])


def _joined(begin: Trajectory | None, route: RouteTrajectory, vias: list[_Via]) -> Way:
    """Return the way of a route, and of what comes before it."""
    trajectory, before_s = route.trajectory, 0.0
    if begin is not None:
        trajectory, before_s = begin.then(trajectory), begin.duration_s
    passed_s = [before_s + t for t, via in zip(route.passed_s, vias, strict=True) if via.asked]
    return Way(trajectory, tuple(passed_s), Samples.of(trajectory))


def _harder(limits: Limits, factor: float) -> Limits:
    """Return limits with more acceleration, built up and taken away the sooner."""
    return replace(
        limits,
        acceleration_horizontal_m_s2=factor * limits.acceleration_horizontal_m_s2,
        jerk_m_s3=factor * factor * limits.jerk_m_s3,
    )


def _sharper(point: RoutePoint) -> RoutePoint:
    corner_m = _CORNER_FACTOR * point.corner_m
    return replace(point, corner_m=corner_m if corner_m >= _CORNER_MIN_M else 0.0)


def _slower(point: RoutePoint) -> RoutePoint | None:
    speed_m_s = _SPEED_FACTOR * point.limits.speed_horizontal_m_s
    if speed_m_s < _SPEED_MIN_M_S:
        return None
    # All else stays: a gentler acceleration would make the turns only wider.
    return replace(point, limits=replace(point.limits, speed_horizontal_m_s=speed_m_s))
