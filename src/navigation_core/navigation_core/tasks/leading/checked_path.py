"""A trajectory through points and around obstacles, with its clearance checked throughout.

The planner's lines become a route whose corners are cut by no more than there is room for.
Then the whole trajectory is sampled, the turn that it begins with included: it must keep a
clearance everywhere, and nowhere be so fast that the brake of :mod:`navigation_core.safety.braking`
would act. Where it does not, that part is flown more slowly and with sharper corners. Where not
even that helps, the vehicle stops first.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

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
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.clearance_escape import escape_point
from navigation_core.planning.conflicts import MotionSamples, clearance_at_m, first_conflict
from navigation_core.planning.planner import NoPath, PlanLimits, plan
from navigation_core.safety.braking import must_brake, stopping_ends
from navigation_core.searches import IsWanted
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint, RouteTrajectory, plan_route
from navigation_core.trajectories.trajectory import Trajectory, plan_stop

# A route is planned around obstacles for this distance ahead, or this many of its points, to bound
# the work; the path is extended this time before its end.
_HORIZON_M, _POINTS_MAX, _EXTEND_BEFORE_END_S = 100.0, 6, 10.0
# A place beside a target without room is worth a flight if it is this far away. Halfway there the
# target is looked at again, unless the rest takes less than this time.
_APPROACH_MIN_M, _LOOK_AGAIN_MIN_S = 1.0, 1.0
# Slower than this a vehicle need not stop before it takes another path.
_SLOW_M_S = 0.3
# Maximum number of trajectories tried along the same lines, and from the same start.
_TRIES_MAX, _TRIES_IN_ALL = 3, 4
# Shares of the corner allowance that are tried, one after the other.
_ALLOWANCE_SHARES = (1.0, 0.4, 0.0)
# A rover or boat strays from its path by about this share of its turning radius.
_STRAY_SHARE = 0.5
# At least this share of that margin is planned with, except to a target that has no such room.
_STRAY_LEAST_SHARE = 0.5
# How far it steers to either side to see whether it can leave a place that is too near to an
# obstacle, and by how much it may come nearer.
_STEERED_RAD, _STEERED_POINTS, _NEARER_MAX_M = 1.2, 6, 0.05
# Shares of speed and corner with which a line with faults is flown again.
_SPEED_FACTOR, _CORNER_FACTOR = 0.55, 0.4
# A corner that is cut by less is a stop; slower than this a flight helps nobody.
_CORNER_MIN_M, _SPEED_MIN_M_S = 0.08, 0.4
# Allowance of a point on a straight line, which is not cut at all.
_ON_THE_LINE_M = 0.5


@dataclass(frozen=True)
class CheckedPath:
    """The planned path and its trajectory.

    Attributes:
        trajectory: the motion.
        passed_s: when each of the points asked for is passed, in trajectory time.
        samples: the motion, to be checked against obstacles.
        extend_s: when it is to be planned on, in trajectory time.
        entered_s: where it is gone over to, in trajectory time.
        ends_short: why it ends before a point that was asked for; empty if it passes all of them.
    """

    trajectory: Trajectory
    passed_s: tuple[float, ...]
    samples: MotionSamples
    extend_s: float = math.inf
    entered_s: float = 0.0
    ends_short: str = ""

    @property
    def length_m(self) -> float:
        """Its length from where it is gone over to."""
        return self.trajectory.remaining_distance_m(self.entered_s)


def braking_limits(traits: Traits, limits: Limits) -> Limits:
    """Return the limits of a brake: what drives may brake less hard than it speeds up."""
    if traits.flies:
        return limits
    braking_m_s2 = min(limits.acceleration_horizontal_m_s2, traits.braking_m_s2)
    return replace(limits, acceleration_horizontal_m_s2=braking_m_s2)


@dataclass(frozen=True)
class _Via:
    """A point on the path, and whether it was asked for or is there because of obstacles."""

    point: RoutePoint
    asked: bool


@dataclass(frozen=True)
class _Stretch:
    """The part of a route that is planned through now.

    Attributes:
        points: at least one.
        room_m: the least clearance of them.
        far: the points that are for later.
        ends_short: why the last point stands for one that was asked for; empty if it does not.
    """

    points: tuple[RoutePoint, ...]
    room_m: float
    far: tuple[RoutePoint, ...]
    ends_short: str = ""


class _Fault(Enum):
    """Where a trajectory could not be made sound."""

    BEGINNING = auto()
    LATER = auto()


class PathPlanner:
    """Plans the paths of one goal."""

    def __init__(self, config: AvoidanceConfig, traits: Traits, limits: Limits) -> None:
        """Prepare.

        Args:
            config: what to keep clear of.
            traits: what the vehicle can do.
            limits: of the flight.
        """
        self._config = config
        self._traits = traits
        self._far: tuple[tuple[RoutePoint, ...], RouteTrajectory] | None = None
        self._braking_limits = braking_limits(traits, limits)

    def plan(
        self,
        start: KinematicState,
        heading_enu_rad: float,
        points: Sequence[RoutePoint],
        obstacles: Obstacles,
        seen: Obstacles | None = None,
        is_wanted: IsWanted = lambda: True,
    ) -> CheckedPath | NoPath:
        """Return a path from any state by way of points, or why there is none.

        A search makes several attempts, of which the first is mostly enough; all of them take
        several times as long as a setpoint may be late. It uses nothing that others change, so
        it may run beside the flight.

        Args:
            start: state at the beginning, in the map frame.
            heading_enu_rad: where the nose of what drives points.
            points: at least one; the last is where the path ends.
            obstacles: the known obstacles.
            seen: those, without where something that moves is about to be; None for the same.
            is_wanted: asked before each attempt; the search ends when nobody waits for it.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        stretch = self._stretch(start.position_enu_m, points, obstacles)
        if isinstance(stretch, NoPath):
            return stretch
        where_they_are = obstacles if seen is None else seen
        if self._is_cornered(start.position_enu_m, heading_enu_rad, where_they_are):
            return NoPath(
                "The vehicle is so close to an obstacle that it would have to turn on the spot "
                "or reverse, which it cannot do."
            )
        reason = "The vehicle must stop first."
        for begin in self._beginnings(start, obstacles):
            state = start if begin is None else KinematicState(begin.end_position_enu_m)
            left = _TRIES_IN_ALL
            for extra_m in self._extras_m(stretch.room_m - self._config.plan_clearance_m):
                if not is_wanted():
                    return NoPath("The search was abandoned.")
                lines = self._lines(state, heading_enu_rad, stretch.points, obstacles, extra_m)
                if isinstance(lines, NoPath):
                    reason = lines.reason
                    continue
                tries = min(left, _TRIES_MAX)
                path = self._fly(state, begin, lines, obstacles, tries)
                left -= tries
                if isinstance(path, CheckedPath):
                    if stretch.ends_short:
                        return _ended_short(path, stretch, len(points))
                    return self._continued(path, stretch.points[-1], stretch.far)
                reason = (
                    "A path exists, but none that can be flown from here with a clearance of "
                    f"{self._config.flown_clearance_m:g} m to all obstacles."
                )
                # Other lines begin with about the same turn.
                if path is _Fault.BEGINNING or left == 0:
                    break
        return NoPath(reason)

    def _stretch(
        self, start_enu_m: Vector3, points: Sequence[RoutePoint], obstacles: Obstacles
    ) -> _Stretch | NoPath:
        """Return what is planned through now: up to the horizon, or to what has no room."""
        near, far = _split(start_enu_m, points)
        needed_m = self._config.plan_clearance_m
        rooms_m = [self._clearance_m(point.position_enu_m, obstacles) for point in near]
        blocked = next((i for i, room_m in enumerate(rooms_m) if room_m < needed_m), None)
        if blocked is None:
            return _Stretch(near, min(rooms_m), far)
        x, y, z = near[blocked].position_enu_m
        reason = (
            f"The point ({x:.1f}, {y:.1f}, {z:.1f}) m on the route is {rooms_m[blocked]:.2f} m "
            f"from an obstacle; the required clearance is {needed_m:g} m."
        )
        beside = self._beside(start_enu_m, near[: blocked + 1], obstacles)
        if beside is None:
            return NoPath(reason)
        there_m = self._clearance_m(beside.position_enu_m, obstacles)
        room_m = min(*rooms_m[:blocked], there_m) if blocked else there_m
        return _Stretch((*near[:blocked], beside), room_m, (), reason)

    def _beside(
        self, start_enu_m: Vector3, points: Sequence[RoutePoint], obstacles: Obstacles
    ) -> RoutePoint | None:
        """Return a point with room near the last one, which has none; None if not worth a flight.

        From afar a sensor sees an obstacle as wide as its beam, and what moves may have gone when
        the vehicle is there.
        """
        before_enu_m = points[-2].position_enu_m if len(points) > 1 else start_enu_m
        place = escape_point(
            np.array(points[-1].position_enu_m),
            np.array(before_enu_m),
            obstacles,
            self._config.plan_clearance_m,
            self._config.heights_m if self._traits.flies else None,
        )
        if place is None:
            return None
        beside_enu_m = (float(place[0]), float(place[1]), float(place[2]))
        if len(points) == 1 and distance(start_enu_m, beside_enu_m) < _APPROACH_MIN_M:
            return None
        return RoutePoint(beside_enu_m, 0.0, points[-1].limits)

    def _continued(
        self, path: CheckedPath, last: RoutePoint, far: tuple[RoutePoint, ...]
    ) -> CheckedPath:
        """Add what is for later: as if there were no obstacles, after a stop that never comes."""
        if not far:
            return path
        if self._far is None or self._far[0] != far:
            self._far = (far, plan_route(KinematicState(last.position_enu_m), far))
        route, joint_s = self._far[1], path.trajectory.duration_s
        passed_s = (*path.passed_s, *(joint_s + time_s for time_s in route.passed_s))
        trajectory = path.trajectory.then(route.trajectory)
        return CheckedPath(trajectory, passed_s, path.samples, joint_s - _EXTEND_BEFORE_END_S)

    def _clearance_m(self, position_enu_m: Vector3, obstacles: Obstacles) -> float:
        config = self._config
        within_m = config.plan_clearance_m + config.corner_allowance_m + self._stray_m
        return clearance_at_m(position_enu_m, obstacles, within_m)

    @property
    def _stray_m(self) -> float:
        return _STRAY_SHARE * self._traits.turning_radius_m

    def _extras_m(self, room_m: float) -> list[float]:
        """Return what to keep beyond the clearance: as much as can be, and less after that.

        Args:
            room_m: what the points that are asked for have beyond the clearance.
        """
        extras_m = [
            self._stray_m + share * self._config.corner_allowance_m for share in _ALLOWANCE_SHARES
        ]
        extras_m.append(_STRAY_LEAST_SHARE * self._stray_m)
        return [extra_m for extra_m in dict.fromkeys(extras_m) if extra_m <= room_m] or [room_m]

    def _is_cornered(
        self, place_enu_m: Vector3, heading_enu_rad: float, obstacles: Obstacles
    ) -> bool:
        """Whether what drives would come nearer to an obstacle whichever way it steers."""
        radius_m, limit_m = self._traits.turning_radius_m, self._config.conflict_clearance_m
        here_m = clearance_at_m(place_enu_m, obstacles, limit_m)
        if radius_m <= 0.0 or here_m >= limit_m:
            return False
        angles = np.linspace(0.0, _STEERED_RAD, _STEERED_POINTS)
        ahead = radius_m * np.sin(angles)
        aside = radius_m * (1.0 - np.cos(angles))
        cosine, sine = math.cos(heading_enu_rad), math.sin(heading_enu_rad)
        for side in (-1.0, 0.0, 1.0):
            arc = np.zeros((_STEERED_POINTS, 3)) + np.array(place_enu_m)
            arc[:, 0] += ahead * cosine - side * aside * sine
            arc[:, 1] += ahead * sine + side * aside * cosine
            least_m = min(here_m, self._config.brake_clearance_m) - _NEARER_MAX_M
            if float(obstacles.clearance_m(arc).min()) >= least_m:
                return False
        return True

    def _beginnings(
        self, start: KinematicState, obstacles: Obstacles
    ) -> Iterator[Trajectory | None]:
        """Return what a path may begin with: nothing, or a brake if it moves."""
        if not self._acts(MotionSamples.at(start), obstacles)[0]:
            yield None
        if norm(start.velocity_enu_m_s) < _SLOW_M_S:
            return
        stop = plan_stop(start, self._braking_limits)
        braked = MotionSamples.of(stop).positions_enu_m
        if first_conflict(braked, obstacles, self._config.flown_clearance_m) is None:
            yield stop

    def _acts(self, motion: MotionSamples, obstacles: Obstacles) -> NDArray[np.bool_]:
        """Return when the brake would act."""
        config = self._config
        return must_brake(
            motion, obstacles, self._braking_limits, config.brake_clearance_m, config.reaction_s
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
            # With less to keep there may be a path that is found sooner than that there is none.
            thorough=extra_m <= 0.0,
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
    ) -> CheckedPath | _Fault:
        """Return a trajectory along lines that was found sound, or where none was.

        Args:
            state: where the lines begin.
            begin: what comes before, or None.
            vias: the points of the lines.
            obstacles: the known obstacles.
            tries: how many trajectories may be tried.
        """
        for _ in range(tries):
            route = plan_route(state, [via.point for via in vias])
            samples = MotionSamples.of(route.trajectory)
            faults_s = self._faults_s(samples, obstacles)
            if not faults_s:
                return _joined(begin, route, vias)
            slower = _gentler(state, vias, route, faults_s, self._braking_m)
            if slower is None:
                break
            vias = slower
        led_in_s = 0.5 * route.passed_s[0]
        moves = norm(state.velocity_enu_m_s) >= _SLOW_M_S
        return _Fault.BEGINNING if moves and faults_s[0] < led_in_s else _Fault.LATER

    def _faults_s(self, samples: MotionSamples, obstacles: Obstacles) -> list[float]:
        """Return when a trajectory is too near to an obstacle, or too fast towards one."""
        clearance_m = self._config.flown_clearance_m
        near = first_conflict(samples.positions_enu_m, obstacles, clearance_m)
        fast = np.flatnonzero(self._acts(samples, obstacles))
        indices = [*([] if near is None else [near]), *fast]
        return sorted(float(samples.times_s[index]) for index in indices)

    def _braking_m(self, limits: Limits, course_enu: Vector3) -> float:
        """Return the braking path from full speed."""
        velocity = scale(course_enu, limits.along(course_enu).speed_forward_m_s)
        cruise = MotionSamples.at(KinematicState(ZERO, velocity))
        end = stopping_ends(cruise, self._braking_limits, self._config.reaction_s)
        return float(np.linalg.norm(end))


def _joined(begin: Trajectory | None, route: RouteTrajectory, vias: list[_Via]) -> CheckedPath:
    """Return the path of a route, and of what comes before it."""
    trajectory, before_s = route.trajectory, 0.0
    if begin is not None:
        trajectory, before_s = begin.then(trajectory), begin.duration_s
    passed_s = [before_s + t for t, via in zip(route.passed_s, vias, strict=True) if via.asked]
    return CheckedPath(trajectory, tuple(passed_s), MotionSamples.of(trajectory))


def _split(
    place_enu_m: Vector3, points: Sequence[RoutePoint]
) -> tuple[tuple[RoutePoint, ...], tuple[RoutePoint, ...]]:
    """Return the points that are planned through now, and those that are for later."""
    ahead_m = 0.0
    for count, point in enumerate(points, 1):
        ahead_m += distance(place_enu_m, point.position_enu_m)
        place_enu_m = point.position_enu_m
        if count >= _POINTS_MAX or ahead_m >= _HORIZON_M:
            return tuple(points[:count]), tuple(points[count:])
    return tuple(points), ()


def _ended_short(path: CheckedPath, stretch: _Stretch, asked: int) -> CheckedPath:
    """Return a path that is flown, and looked at again, though it passes not all points."""
    duration_s = path.trajectory.duration_s
    look_s = 0.5 * duration_s if duration_s >= 2.0 * _LOOK_AGAIN_MIN_S else math.inf
    passed = len(stretch.points) - 1
    passed_s = path.passed_s[:passed] + (math.inf,) * (asked - passed)
    return replace(path, passed_s=passed_s, extend_s=look_s, ends_short=stretch.ends_short)


def _gentler(
    state: KinematicState,
    vias: list[_Via],
    route: RouteTrajectory,
    faults_s: list[float],
    braking_m: Callable[[Limits, Vector3], float],
) -> list[_Via] | None:
    """Return the same lines, to be flown more gently where there were faults.

    Args:
        state: where they begin.
        vias: their points.
        route: the trajectory along them.
        faults_s: when that has faults.
        braking_m: the braking path from full speed along a unit vector.

    Returns:
        The points, some more of them; None if it would become too slow.
    """
    legs: dict[int, float] = {}
    for time_s in faults_s:
        leg = min(bisect.bisect_left(route.passed_s, time_s), len(vias) - 1)
        end = vias[leg].point.position_enu_m
        left_m = distance(route.trajectory.sample(time_s).position_enu_m, end)
        legs[leg] = max(legs.get(leg, 0.0), left_m)
    result: list[_Via] = []
    places = [state.position_enu_m, *(via.point.position_enu_m for via in vias)]
    for index, (via, place) in enumerate(zip(vias, places, strict=False)):
        point = via.point
        if index in legs or index + 1 in legs:
            point = _sharper(point)
        if index in legs:
            slow = _slower(point)
            if slow is None:
                return None
            result += _fast_part(place, point, legs[index], braking_m)
            point = slow
        result.append(replace(via, point=point))
    return result


def _fast_part(
    begin_enu_m: Vector3,
    point: RoutePoint,
    slow_m: float,
    braking_m: Callable[[Limits, Vector3], float],
) -> list[_Via]:
    """Return the point up to which a long line may be flown as it was, if there is one."""
    length_m = distance(begin_enu_m, point.position_enu_m)
    course = unit_between(begin_enu_m, point.position_enu_m)
    if course is None:
        return []
    slow_m += braking_m(point.limits, course)
    if length_m < 2.0 * slow_m:
        return []
    place = add(point.position_enu_m, scale(course, -slow_m))
    return [_Via(RoutePoint(place, _ON_THE_LINE_M, point.limits), False)]


def _sharper(point: RoutePoint) -> RoutePoint:
    corner_m = _CORNER_FACTOR * point.corner_m
    return replace(point, corner_m=corner_m if corner_m >= _CORNER_MIN_M else 0.0)


def _slower(point: RoutePoint) -> RoutePoint | None:
    speed_m_s = _SPEED_FACTOR * point.limits.speed_horizontal_m_s
    if speed_m_s < _SPEED_MIN_M_S:
        return None
    # All else stays: a gentler acceleration would make the turns only wider.
    return replace(point, limits=replace(point.limits, speed_horizontal_m_s=speed_m_s))
