"""Paths around obstacles: the search for one, which continues beside the flight; brake, evasion."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import KinematicState, Vector3, distance, norm, subtract
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Array
from navigation_core.planning.conflicts import MotionSamples, first_conflict
from navigation_core.planning.planner import NoPath
from navigation_core.safety.keeping_apart import PREDICTED_S, moments_with_room_m, without_moving
from navigation_core.searches import Search
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath, PathPlanner
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint
from navigation_core.trajectories.trajectory import Trajectory, plan_stop, plan_to

__all__ = ["Evasion", "PathBeginning", "PathSearch", "joins"]

# A setpoint may jump by this distance and speed where a path that was found late is joined: less
# than the noise of a position, and less than a vehicle's speed changes within a period.
_JOINT_M, _JOINT_M_S = 0.15, 0.3
# Directions and steps in which a clear place is looked for, how many are tried, and what is kept
# there beyond the clearance.
_DIRECTIONS, _RING_M, _PLACES_MAX, _AWAY_M = 16, 0.5, 6, 0.2
# How far beside its end a brake may end as something moves, unless it is as slow as this.
_ASIDE_M, _ASIDE_MIN_M_S = (2.0, -2.0, 4.0, -4.0), 0.5
# It takes a second or two until something is seen to move, and by then the vehicle has braked. So
# within this distance beyond the clearance the brake is hard.
_MAY_COME_M = 1.5
# Moments from now on at which the room of a motion is looked at, and the weight of its mean.
_MOMENTS_S, _MEAN_SHARE = np.arange(0.0, PREDICTED_S + 0.1, 0.2), 0.1


@dataclass(frozen=True)
class PathBeginning:
    """Where a path begins.

    Attributes:
        carrot: the motion from which it continues.
        joint_s: when, in that motion's time.
        start: in which state.
        begins_here: whether that is where the vehicle is, so that the path joins no motion.
    """

    carrot: Carrot | None
    joint_s: float
    start: KinematicState
    begins_here: bool


@dataclass(frozen=True)
class _Pending:
    """A search for a path that is under way.

    Attributes:
        search: the search.
        beginning: where the path begins.
        route: the points asked for when it began.
        begun_s: when the search began.
    """

    search: Search[CheckedPath | NoPath]
    beginning: PathBeginning
    route: tuple[RoutePoint, ...]
    begun_s: float


class PathSearch:
    """Searches for the paths of one flight.

    Attributes:
        config: how to keep away from obstacles.
        evasion: its unplanned motions.
    """

    def __init__(self, config: AvoidanceConfig, traits: Traits, limits: Limits) -> None:
        """Prepare; the arguments are those of `PathPlanner`."""
        self.config = config
        self._traits = traits
        self._pending: _Pending | None = None
        self.keep(limits)

    def keep(self, limits: Limits) -> None:
        """Plan with these limits from now on."""
        self._planner = PathPlanner(self.config, self._traits, limits)
        self.evasion = Evasion(self.config, self._traits, limits)

    @property
    def is_open(self) -> bool:
        """Whether a search is under way."""
        return self._pending is not None

    def look(
        self, start: KinematicState, points: tuple[RoutePoint, ...], observation: Observation
    ) -> Search[CheckedPath | NoPath]:
        """Return a search that has begun.

        Args:
            start: where the path begins.
            points: the points that it goes through.
            observation: what is known.
        """
        planner, yaw = self._planner, observation.yaw_enu_rad or 0.0
        known, seen = observation.obstacles, observation.obstacles_now
        return self.config.searcher.begin(
            lambda is_wanted: planner.plan(start, yaw, points, known, seen, is_wanted)
        )

    def begin(
        self,
        beginning: PathBeginning,
        points: tuple[RoutePoint, ...],
        route: tuple[RoutePoint, ...],
        observation: Observation,
    ) -> None:
        """Begin a search whose result is asked for.

        Args:
            beginning: where the path begins.
            points: the points that it goes through.
            route: all points of the flight.
            observation: what is known.
        """
        search = self.look(beginning.start, points, observation)
        self._pending = _Pending(search, beginning, route, observation.time_s)

    def continues(self, carrot: Carrot | None, route: tuple[RoutePoint, ...]) -> bool:
        """Whether a search is under way from a motion to these points; another is abandoned."""
        pending = self._pending
        if pending is None:
            return False
        if pending.beginning.carrot is carrot and pending.route == route:
            return True
        self._give_up(pending)
        return False

    def result(self, sent: KinematicState, now: float) -> CheckedPath | NoPath | None:
        """Return the path, or why there is none; None while that is not known.

        A path that is found too late for the setpoint to go over to it is lost; then no search is
        under way any more.

        Args:
            sent: the setpoint sent last.
            now: time in seconds.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        pending = self._pending
        if pending is None:
            return None
        try:
            found = pending.search.result()
        except Exception:
            self._pending = None
            raise
        if found is None:
            limit_s = self.config.search_timeout_s
            if now - pending.begun_s <= limit_s:
                return None
            self._give_up(pending)
            return NoPath(f"The search for a path took longer than {limit_s:g} s.")
        carrot = pending.beginning.carrot
        if isinstance(found, NoPath) or carrot is None or pending.beginning.begins_here:
            self._pending = None
            return found
        # A setpoint that stands is never late.
        late_s = 0.0 if carrot.ended else carrot.time_s - pending.beginning.joint_s
        if late_s < 0.0:
            return None
        self._pending = None
        return replace(found, entered_s=late_s) if joins(sent, found, late_s) else None

    def _give_up(self, pending: _Pending) -> None:
        pending.search.abandon()
        self._pending = None


def joins(sent: KinematicState, path: CheckedPath, time_s: float) -> bool:
    """Return whether the setpoint can go over to a path at a time without a jump."""
    state = path.trajectory.sample(time_s)
    velocity = subtract(state.velocity_enu_m_s, sent.velocity_enu_m_s)
    gap_m = distance(state.position_enu_m, sent.position_enu_m)
    return gap_m <= _JOINT_M and norm(velocity) <= _JOINT_M_S


class Evasion:
    """Stops one vehicle, and lets it give way."""

    def __init__(self, config: AvoidanceConfig, traits: Traits, limits: Limits) -> None:
        """Prepare; the arguments are those of `PathPlanner`."""
        self._config = config
        self._traits = traits
        self._limits = limits
        self._emergency_limits = _harder(limits, config.emergency_factor)

    def stop(self, start: KinematicState, observation: Observation) -> CheckedPath:
        """Return the braking path: an emergency's if the usual one leads too near to something.

        Where something moves, what flies may leave sideways as it brakes, if that keeps more room.

        Args:
            start: state at the beginning, in the map frame.
            observation: the obstacles.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        usual = _checked(plan_stop(start, self._limits))
        clearance_m = self._config.conflict_clearance_m
        if math.isfinite(observation.obstacles_reach_m):
            clearance_m += _MAY_COME_M
        places, known = usual.samples.positions_enu_m, observation.obstacles
        if first_conflict(places, known, clearance_m) is None:
            return usual
        hard = _checked(plan_stop(start, self._emergency_limits))
        if not (observation.moving and self._traits.flies):
            return hard
        stops = [hard, usual, *self._stops_aside(start, hard)]
        rooms = [self.room_m(stop.samples, 0.0, observation) for stop in stops]
        return stops[int(np.argmax(rooms))]

    def room_m(self, motion: MotionSamples, time_s: float, observation: Observation) -> float:
        """Return how much room a motion leaves to what stands and, at its time, to what moves.

        Args:
            motion: the motion.
            time_s: up to when it is over, in its own time.
            observation: the obstacles.

        Returns:
            The least of the next seconds in m, up to the clearance of a plan, and a tenth of the
            mean: of two that come as near, the one that stays less long.
        """
        moving, enough_m = observation.moving, self._config.plan_clearance_m
        in_s = np.maximum(_MOMENTS_S + time_s, motion.times_s[0])
        places = np.stack(
            [np.interp(in_s, motion.times_s, motion.positions_enu_m[:, axis]) for axis in range(3)],
            axis=1,
        )
        standing = without_moving(observation.obstacles_now, moving)
        rooms_m = moments_with_room_m(_MOMENTS_S, places, moving, standing, enough_m)
        return float(rooms_m.min() + _MEAN_SHARE * rooms_m.mean())

    def _stops_aside(self, start: KinematicState, stop: CheckedPath) -> list[CheckedPath]:
        """Return brakes that end to the left and to the right of another."""
        course, speed_m_s = start.velocity_enu_m_s, norm(start.velocity_enu_m_s)
        if speed_m_s < _ASIDE_MIN_M_S:
            return []
        x, y, z = stop.trajectory.end_position_enu_m
        left = (-course[1] / speed_m_s, course[0] / speed_m_s)
        ends = [(x + aside * left[0], y + aside * left[1], z) for aside in _ASIDE_M]
        return [_checked(plan_to(start, end, self._emergency_limits)) for end in ends]

    def plan_away(self, start: KinematicState, observation: Observation) -> CheckedPath | None:
        """Return a path to the nearest clear place; None if there is none within reach.

        A rover or boat has none: it could not leave sideways, and is safer standing than turning.

        Args:
            start: state at the beginning, in the map frame.
            observation: the obstacles.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if not self._traits.flies:
            return None
        obstacles = observation.obstacles
        needed_m = self._config.plan_clearance_m + _AWAY_M
        places = self._places(start.position_enu_m)
        clear = obstacles.clearance_m(places) >= needed_m
        for x, y, z in places[clear][:_PLACES_MAX]:
            trajectory = plan_to(start, (float(x), float(y), float(z)), self._emergency_limits)
            samples = MotionSamples.of(trajectory)
            clearance_m = self._config.conflict_clearance_m
            if first_conflict(samples.positions_enu_m, obstacles, clearance_m) is None:
                return CheckedPath(trajectory, (trajectory.duration_s,), samples)
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


def _checked(trajectory: Trajectory) -> CheckedPath:
    return CheckedPath(trajectory, (), MotionSamples.of(trajectory))


def _harder(limits: Limits, factor: float) -> Limits:
    """Return limits with more acceleration, built up and taken away the sooner."""
    return replace(
        limits,
        acceleration_horizontal_m_s2=factor * limits.acceleration_horizontal_m_s2,
        jerk_m_s3=factor * factor * limits.jerk_m_s3,
    )
