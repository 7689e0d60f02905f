"""Follows the path to a goal: its start, its target, and the setpoint sent last."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    add,
    distance,
    horizontal_norm,
    norm,
    scale,
    subtract,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.planning.planner import NoPath
from navigation_core.safety.braking import STANDING_M_S
from navigation_core.searches import Search
from navigation_core.tasks.goto_config import GotoGoal
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath, PathPlanner
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.evasion import Evasion
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.measurement import is_located, measured_state
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint, plan_route
from navigation_core.trajectories.trajectory import plan_stop, plan_to

# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5


# Shares of the greatest speeds that are planned with, since the limits bound the real motion, too.
# The vehicle sways about the commanded speed, and overshoots a climb rate by a tenth when the
# acceleration ends: the loop around the acceleration of an ArduCopter takes a second to settle.
_CRUISE_SHARE = 0.97
_CLIMB_SHARE = 0.92
# A rover or boat does not sway, and is slowed down when it is too fast (see Pursuit).
_DRIVEN_SHARE = 0.99
# When a setpoint moves over to another path, a waypoint counts as passed within this many times
# the distance by which its corner may be cut: it could not be met again without a stop.
_PASSED_CORNERS = 1.5
# Slower than this, a direction of travel says nothing.
_COURSE_SPEED_M_S = 0.5
# A setpoint may jump by this distance and speed where a path that was found late is joined: less
# than the noise of a position, and less than a vehicle's speed changes within a period.
_JOINT_M, _JOINT_M_S = 0.15, 0.3
# Farther than a vehicle that follows is from a setpoint that stands.
_RUN_OUT_M = 0.5


def cruise_limits(limits: Limits, speed_m_s: float | None, traits: Traits) -> Limits:
    """Return limits for a path that is not to be faster than a speed; None: than the usual one."""
    if not traits.flies:
        return limits.with_speed(speed_m_s and speed_m_s * _DRIVEN_SHARE)
    chosen = limits.with_speed(speed_m_s)
    return dataclasses.replace(
        chosen,
        speed_horizontal_m_s=_CRUISE_SHARE * chosen.speed_horizontal_m_s,
        speed_up_m_s=_CLIMB_SHARE * chosen.speed_up_m_s,
        speed_down_m_s=_CLIMB_SHARE * chosen.speed_down_m_s,
    )


@dataclass(frozen=True)
class Commanded:
    """The setpoint sent last.

    Attributes:
        state: its position and true derivatives.
        yaw_enu_rad: its yaw.
    """

    state: KinematicState
    yaw_enu_rad: float


@dataclass(frozen=True)
class _Avoiding:
    """How the flight keeps away from obstacles within its present limits."""

    config: AvoidanceConfig
    planner: PathPlanner
    evasion: Evasion


@dataclass(frozen=True)
class _Pending:
    """A search for a path that is under way.

    Attributes:
        search: the search.
        carrot: the motion from which the path continues.
        route: the points asked for when it began.
        joint_s: when the path continues from there, in that motion's time.
        begun_s: when the search began.
        begins_here: whether the path begins where the vehicle is, and joins no motion.
    """

    search: Search[CheckedPath | NoPath]
    carrot: Carrot | None
    route: tuple[RoutePoint, ...]
    joint_s: float
    begun_s: float
    begins_here: bool


def joins(sent: KinematicState, path: CheckedPath, time_s: float) -> bool:
    """Return whether the setpoint can go over to a path at a time without a jump."""
    state = path.trajectory.sample(time_s)
    velocity = subtract(state.velocity_enu_m_s, sent.velocity_enu_m_s)
    gap_m = distance(state.position_enu_m, sent.position_enu_m)
    return gap_m <= _JOINT_M and norm(velocity) <= _JOINT_M_S


class PathFollower:
    """Plans trajectories and follows them; each plan fits the setpoint sent last."""

    def __init__(self, goal: GotoGoal, terms: FlightTerms) -> None:
        """Prepare the flight to a goal."""
        config, traits = terms.config, terms.traits
        self.limits = cruise_limits(config.limits, goal.max_speed_m_s, traits)
        self.carrot: Carrot | None = None
        # Where the last plan to the goal leads.
        self.path_enu_m: tuple[Vector3, ...] = ()
        self.commanded: Commanded | None = None
        state, yaw_enu_rad = terms.handover.commanded, terms.handover.yaw_enu_rad
        if state is not None and yaw_enu_rad is not None:
            self.commanded = Commanded(state, yaw_enu_rad)
        # Time that the setpoint has yet to walk in this step.
        self.dt_s = 0.0
        # Whether time has passed without setpoints, so that the last one says nothing.
        self.is_stale = False
        self._goal = goal
        # A rover or boat is not led by its carrot's derivatives.
        if not traits.flies:
            config = dataclasses.replace(config, following_gain_per_s=0.0, response_s=0.0)
        self._config = config
        self._yaw_goal = goal.yaw_enu_rad
        self._via: tuple[RoutePoint, ...] = ()
        self._via_yaw: tuple[float | None, ...] = ()
        self._passed_s: tuple[float, ...] = ()
        # The path around obstacles that is flown, and why there is none.
        self.path: CheckedPath | None = None
        self.no_path = ""
        # Whether one is still searched for.
        self.undecided = False
        self._pending: _Pending | None = None
        self._leads_to_goal = False
        self._traits = traits
        self._avoiding: _Avoiding | None = None
        # A rover or boat is led from its measured position, not from the planned one.
        self.starts_here = not traits.flies
        self._keep(self.limits, terms.avoidance)

    def _keep(self, limits: Limits, avoidance: AvoidanceConfig | None) -> None:
        """Plan with these limits from now on."""
        self.limits = limits
        braking_m_s2 = limits.acceleration_horizontal_m_s2
        self._braking_m_s2 = min(self._traits.braking_m_s2, braking_m_s2)
        if avoidance is not None:
            planner = PathPlanner(avoidance, self._traits, limits)
            self._avoiding = _Avoiding(avoidance, planner, Evasion(avoidance, self._traits, limits))

    @property
    def passed(self) -> int:
        """The number of route points that the carrot has passed since the flight was planned."""
        return 0 if self.carrot is None else self._passed_by(self.carrot.time_s)

    def _passed_by(self, carrot_time_s: float) -> int:
        return sum(1 for time_s in self._passed_s if time_s <= carrot_time_s)

    def passed_at_s(self, index: int) -> float:
        """Return when the carrot passes a point, from 0 on; infinite if that is not planned."""
        return self._passed_s[index] if 0 <= index < len(self._passed_s) else math.inf

    def set_route(
        self, points: tuple[RoutePoint, ...], yaws_enu_rad: tuple[float | None, ...]
    ) -> None:
        """Fly to the goal by way of points from the next plan on.

        Args:
            points: the path; the last is the goal. Empty for the straight path.
            yaws_enu_rad: for each point the yaw on the way to it, None for the direction of
                travel.
        """
        self._via, self._via_yaw = points, yaws_enu_rad

    def set_goal(self, goal: GotoGoal) -> None:
        """Fly to another goal from the next plan on."""
        self._goal = goal
        self._yaw_goal = goal.yaw_enu_rad

    @property
    def points(self) -> tuple[RoutePoint, ...]:
        """The points that are still ahead of the carrot; the last is the goal."""
        return self._points[self.passed :] or self._points[-1:]

    @property
    def _points(self) -> tuple[RoutePoint, ...]:
        return self._via or (RoutePoint(self._goal.position_enu_m, 0.0, self.limits),)

    def plan_to_goal(self, observation: Observation) -> None:
        """Plan the flight to the goal; there is no carrot if nothing is known to begin with.

        While a path around obstacles is searched for, ``undecided`` says so; if they leave none,
        ``no_path`` says why. In both cases the vehicle is stopped.

        Args:
            observation: what is known.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if self._avoiding is not None:
            self._plan_around(observation)
            return
        self.carrot = None
        sent = self._choose_start(observation)
        if sent is None:
            return
        if self._yaw_goal is None:
            self._yaw_goal = self._yaw_of_travel(sent.state.position_enu_m, sent.yaw_enu_rad)
        start = sent.state
        if self.starts_here:
            # Of its path only the line counts; how it gets round to that is the pursuit's.
            start = KinematicState(start.position_enu_m)
        if self._via:
            route = plan_route(start, self._via)
            trajectory, self._passed_s = route.trajectory, route.passed_s
        else:
            trajectory = plan_to(start, self._goal.position_enu_m, self.limits)
            self._passed_s = ()
        self.carrot = Carrot(trajectory, self._config, sent.yaw_enu_rad, self._yaw_goal)
        self.path_enu_m = trajectory.path_enu_m

    def _plan_around(self, observation: Observation) -> None:
        """Advance to the goal around obstacles, or stop while no path is known."""
        self.no_path, self.undecided = "", False
        if self._search_from_here() is None:
            before, held = self.commanded, self.carrot
            self.carrot = None
            if self._choose_start(observation) is None:
                return
            if held is not None and not self._leads_to_goal and self.commanded is before:
                self.carrot = held
            else:
                self.plan_stop(observation)
        path = self.find_path(observation)
        if isinstance(path, CheckedPath):
            self.take(path)
        else:
            self.undecided = path is None
            self.no_path = "" if path is None else path.reason

    def preview(
        self, position_enu_m: Vector3, observation: Observation
    ) -> Search[CheckedPath | NoPath] | None:
        """Search for the path around obstacles as it would be from a place, to estimate it."""
        if self._avoiding is None:
            return None
        yaw = observation.yaw_enu_rad or 0.0
        start, points, planner = (
            KinematicState(position_enu_m),
            self._points,
            self._avoiding.planner,
        )
        known, seen = observation.obstacles, observation.obstacles_now
        return self._avoiding.config.searcher.begin(
            lambda is_wanted: planner.plan(start, yaw, points, known, seen, is_wanted)
        )

    def find_path(
        self, observation: Observation, under_way: bool = False
    ) -> CheckedPath | NoPath | None:
        """Look for a path around obstacles, to be called until there is an answer.

        The first call begins a search, which continues beside the flight. The path that it finds
        begins a little further on, where the setpoint will be when it is found, and is returned
        when the setpoint has come there.

        Args:
            observation: what is known.
            under_way: whether the points that were passed are left out.

        Returns:
            The path, why there is none, or None while that is not known, as it is before the
            first setpoint and where no obstacles are avoided.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        avoiding, sent = self._avoiding, self.commanded
        if avoiding is None or sent is None:
            return None
        pending = self._search_from_here()
        if pending is None:
            pending = self._begin_search(avoiding, sent, observation, under_way)
        try:
            found = pending.search.result()
        except Exception:
            self._pending = None
            raise
        if found is None:
            limit_s = avoiding.config.search_timeout_s
            if observation.time_s - pending.begun_s <= limit_s:
                return None
            self._give_search_up()
            return NoPath(f"The search for a path took longer than {limit_s:g} s.")
        if isinstance(found, NoPath) or pending.carrot is None or pending.begins_here:
            self._pending = None
            return found
        # A setpoint that stands is never late.
        late_s = 0.0 if pending.carrot.ended else pending.carrot.time_s - pending.joint_s
        if late_s < 0.0:
            return None
        self._pending = None
        if not joins(sent.state, found, late_s):
            self._begin_search(avoiding, sent, observation, under_way)
            return None
        return replace(found, entered_s=late_s)

    def _search_from_here(self) -> _Pending | None:
        """Return the search in progress if it continues from the motion that is flown."""
        pending = self._pending
        if pending is None:
            return None
        if pending.carrot is self.carrot and pending.route == self._points:
            return pending
        self._give_search_up()
        return None

    def _begin_search(
        self, avoiding: _Avoiding, sent: Commanded, observation: Observation, under_way: bool
    ) -> _Pending:
        searcher, carrot, joint_s = avoiding.config.searcher, self.carrot, 0.0
        begins_here = self._begins_here(sent, observation)
        start = self._start(sent, observation)
        if begins_here:
            # The vehicle keeps its present velocity at least until the new path is found.
            moved = scale(start.velocity_enu_m_s, searcher.lead_s)
            start = replace(start, position_enu_m=add(start.position_enu_m, moved))
        elif carrot is not None and carrot.state.position_enu_m == start.position_enu_m:
            joint_s, start = carrot.ahead(searcher.lead_s)
        elif carrot is not None:
            joint_s = carrot.time_s
        points = self._points
        if under_way:
            # A path from where the vehicle is joins nothing: what it has passed counts from there.
            passed = self.passed if begins_here else self._passed_by(joint_s)
            points = points[passed:] or points[-1:]
            gap_m = distance(points[0].position_enu_m, start.position_enu_m)
            if len(points) > 1 and gap_m <= _PASSED_CORNERS * points[0].corner_m:
                points = points[1:]
        planner, yaw = avoiding.planner, observation.yaw_enu_rad or 0.0
        known, seen = observation.obstacles, observation.obstacles_now
        search = searcher.begin(
            lambda is_wanted: planner.plan(start, yaw, points, known, seen, is_wanted)
        )
        self._pending = _Pending(
            search, carrot, self._points, joint_s, observation.time_s, begins_here
        )
        return self._pending

    def _give_search_up(self) -> None:
        if self._pending is not None:
            self._pending.search.abandon()
            self._pending = None

    def path_away(self, observation: Observation) -> CheckedPath | None:
        """Return a path to the nearest clear position; None if none is known (see `Evasion`).

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if self._avoiding is None or self.commanded is None:
            return None
        start = self._start(self.commanded, observation)
        return self._avoiding.evasion.plan_away(start, observation.obstacles)

    def _start(self, sent: Commanded, observation: Observation) -> KinematicState:
        """Return where a path around obstacles begins."""
        located = is_located(observation, self._config.position_stale_s)
        if located and self._begins_here(sent, observation):
            return self._measured(observation)
        return sent.state

    def _begins_here(self, sent: Commanded, observation: Observation) -> bool:
        """Whether a path begins where the vehicle is, and not at its setpoint.

        It does for a rover or boat; and for an aircraft that has not stopped at its setpoint but
        somewhere further on: an emergency's brake may be harder than the autopilot follows. A
        path that began at the setpoint would lead back first, or to another side of an approaching
        obstacle.
        """
        if self.starts_here:
            return True
        if norm(sent.state.velocity_enu_m_s) > STANDING_M_S:
            return False
        if not is_located(observation, self._config.position_stale_s):
            return False
        here = measured_state(observation).position_enu_m
        return distance(here, sent.state.position_enu_m) > _RUN_OUT_M

    def _measured(self, observation: Observation) -> KinematicState:
        """Return the state that a flight begins with where the vehicle is."""
        here = measured_state(observation)
        if self.starts_here and norm(here.velocity_enu_m_s) < STANDING_M_S:
            # A standstill is measured with a little speed, in any direction. A brake that begins
            # with it, asked for again and again, would pass it on, and the vehicle would creep.
            return KinematicState(here.position_enu_m)
        return here

    def take(self, path: CheckedPath, leads_to_goal: bool = True) -> None:
        """Fly a path that begins at the setpoint sent last, or where the vehicle is.

        Args:
            path: what to fly.
            leads_to_goal: whether it goes through the points that are left, or elsewhere.
        """
        if self.commanded is None:
            return
        yaw_enu_rad = self.commanded.yaw_enu_rad
        self._passed_s = ()
        if leads_to_goal:
            gone = len(self._points) - len(path.passed_s)
            self._passed_s = (-math.inf,) * gone + path.passed_s
            self.path_enu_m = path.trajectory.path_enu_m
        self.carrot = Carrot(
            path.trajectory, self._config, yaw_enu_rad, yaw_enu_rad, path.entered_s
        )
        self.path = path
        self._leads_to_goal = leads_to_goal

    def plan_stop(self, observation: Observation) -> None:
        """Plan a brake; there is no carrot if nothing is known to begin with.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        self.carrot = self.path = None
        self._leads_to_goal = False
        self._passed_s = ()
        sent = self._choose_start(observation)
        if sent is None:
            return
        if self._avoiding is None:
            trajectory = plan_stop(sent.state, self.limits)
        else:
            self.path = self._avoiding.evasion.stop(sent.state, observation.obstacles)
            trajectory = self.path.trajectory
        self.carrot = Carrot(trajectory, self._config, sent.yaw_enu_rad, sent.yaw_enu_rad)

    def walk(self, position_enu_m: Vector3 | None, rate_max: float = 1.0) -> None:
        """Let the carrot walk on by the time of this step, at a share of its speed at most."""
        if self.carrot is not None:
            if self._passed_s:
                self.carrot.turn_to(self._yaw_on_route(self.carrot))
            self.carrot.advance(self.dt_s, position_enu_m, rate_max)
        self.dt_s = 0.0

    def follow(self, position_enu_m: Vector3, until_s: float) -> DrivenPath | None:
        """Let the carrot be where a vehicle that drives has come to; return the path ahead.

        Args:
            position_enu_m: where it is.
            until_s: up to when, in the carrot's time, the path may be looked ahead to.
        """
        dt_s, self.dt_s = self.dt_s, 0.0
        if self.carrot is None:
            return None
        return self.carrot.follow(dt_s, position_enu_m, self._braking_m_s2, until_s)

    def _yaw_on_route(self, carrot: Carrot) -> float:
        """Return the yaw of the leg that the carrot is on, or its direction of travel."""
        yaws = self._via_yaw or (self._goal.yaw_enu_rad,)
        yaw = yaws[min(self.passed, len(yaws) - 1)]
        if yaw is not None and (self._via or self._is_time_to_turn(carrot, yaw)):
            return yaw
        east, north, _ = carrot.state.velocity_enu_m_s
        if math.hypot(east, north) < _COURSE_SPEED_M_S:
            return carrot.yaw_enu_rad
        return math.atan2(north, east)

    @staticmethod
    def _is_time_to_turn(carrot: Carrot, yaw_enu_rad: float) -> bool:
        """Whether to turn to the goal's yaw. Until then the nose, and its sensor, looks ahead."""
        turn_rad = abs(wrap_angle(yaw_enu_rad - carrot.yaw_enu_rad))
        left_s = carrot.trajectory.duration_s - carrot.time_s
        return left_s <= turn_rad / carrot.trajectory.limits.yaw_rate_rad_s

    def note(self, carrot: Carrot) -> None:
        """Remember the setpoint that is sent."""
        self.commanded = Commanded(carrot.state, carrot.yaw_enu_rad)

    def forget_commanded(self) -> None:
        """Drop the last setpoint; the next flight begins where the vehicle is."""
        self.commanded = self.carrot = None

    def _choose_start(self, observation: Observation) -> Commanded | None:
        """Begin at the last setpoint if that still makes sense, else where the vehicle is.

        Returns:
            The setpoint to begin with; None if nothing is known.
        """
        located, sent = is_located(observation, self._config.position_stale_s), self.commanded
        if sent is None or (located and self._must_start_anew(sent, observation)):
            yaw_enu_rad = observation.yaw_enu_rad
            if not located or yaw_enu_rad is None:
                return None
            sent = self.commanded = Commanded(self._measured(observation), yaw_enu_rad)
            self.is_stale = False
            self.dt_s = 0.0
        self._allow_slowing(horizontal_norm(sent.state.velocity_enu_m_s))
        return sent

    def _allow_slowing(self, speed_m_s: float) -> None:
        """Let a vehicle that is faster than its goal allows slow down as hard as others do.

        With the acceleration of a slow goal it would fly on for a long time, paused or cancelled,
        too.
        """
        usual = self._config.limits
        limits = self.limits.slowing_from(speed_m_s, usual)
        if limits != self.limits:
            self._keep(limits, None if self._avoiding is None else self._avoiding.config)
        self._via = tuple(
            dataclasses.replace(point, limits=point.limits.slowing_from(speed_m_s, usual))
            for point in self._via
        )

    def _must_start_anew(self, sent: Commanded, observation: Observation) -> bool:
        """Whether the last setpoint is nothing to continue from."""
        if self.starts_here or self.is_stale:
            return True
        here = measured_state(observation).position_enu_m
        error_m = distance(sent.state.position_enu_m, here)
        return error_m > _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _yaw_of_travel(self, start_enu_m: Vector3, yaw_enu_rad: float) -> float:
        """Return the heading from a point to the goal, or the present one if it is close."""
        offset = subtract(self._goal.position_enu_m, start_enu_m)
        if horizontal_norm(offset) < self._config.yaw_distance_min_m:
            return yaw_enu_rad
        return math.atan2(offset[1], offset[0])
