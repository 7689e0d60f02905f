"""Follows the path to a goal: its start, its target, and the setpoint sent last."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import replace

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    add,
    distance,
    horizontal_norm,
    scale,
    subtract,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.planning.planner import NoPath
from navigation_core.searches import Search
from navigation_core.tasks.goto_config import GotoGoal
from navigation_core.tasks.leading.carrot import Carrot, Commanded, SentSetpoint
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.driven_path import DrivenPath
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.leading.path_search import PathBeginning, PathSearch
from navigation_core.tasks.leading.ring_path import RingGuide, RingPart
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.route_trajectory import RoutePoint, plan_route
from navigation_core.trajectories.trajectory import plan_stop, plan_to

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


def cruise_limits(limits: Limits, speed_m_s: float | None, traits: Traits) -> Limits:
    """Return limits for a path that is not to be faster than a speed; None: than the usual one."""
    if not traits.flies:
        return limits.with_speed(speed_m_s and speed_m_s * _DRIVEN_SHARE)
    chosen = limits.with_speed(speed_m_s)
    return replace(
        chosen,
        speed_horizontal_m_s=_CRUISE_SHARE * chosen.speed_horizontal_m_s,
        speed_up_m_s=_CLIMB_SHARE * chosen.speed_up_m_s,
        speed_down_m_s=_CLIMB_SHARE * chosen.speed_down_m_s,
    )


class PathFollower:
    """Plans trajectories and follows them; each plan fits the setpoint sent last."""

    def __init__(self, goal: GotoGoal, terms: FlightTerms) -> None:
        """Prepare the flight to a goal."""
        config, traits = terms.config, terms.traits
        self.limits = cruise_limits(config.limits, goal.max_speed_m_s, traits)
        self.carrot: Carrot | None = None
        # Where the last plan to the goal leads.
        self.path_enu_m: tuple[Vector3, ...] = ()
        self.sent = SentSetpoint(terms)
        self._goal = goal
        # A rover or boat is not led by its carrot's derivatives.
        if not traits.flies:
            config = replace(config, following_gain_per_s=0.0, response_s=0.0)
        self._config, self._turn_rate_rad_s = config, terms.turn_rate_rad_s
        self._via: tuple[RoutePoint, ...] = ()
        self._via_yaw: tuple[float | None, ...] = ()
        self._passed_s: tuple[float, ...] = ()
        # The path around obstacles that is flown, why there is none, whether it is searched for.
        self.path: CheckedPath | None = None
        self.no_path, self.undecided = "", False
        self._leads_to_goal = False
        self.ring = RingGuide(terms)
        self._traits = traits
        self._search: PathSearch | None = None
        if terms.avoidance is not None:
            self._search = PathSearch(terms.avoidance, traits, self.limits)

    @property
    def passed(self) -> int:
        """The number of route points that the carrot has passed since the flight was planned."""
        return 0 if self.carrot is None else bisect_right(self._passed_s, self.carrot.time_s)

    def passed_at_s(self, index: int) -> float:
        """Return when the carrot passes a point, from 0 on; infinite if that is not planned."""
        return self._passed_s[index] if 0 <= index < len(self._passed_s) else math.inf

    def lead_to(
        self,
        goal: GotoGoal,
        points: tuple[RoutePoint, ...],
        yaws_enu_rad: tuple[float | None, ...],
        part: RingPart | None = None,
    ) -> None:
        """Fly to another goal by way of points, or along a circle, from the next plan on.

        Args:
            goal: the goal.
            points: the path; the last is the goal. Empty for the straight path.
            yaws_enu_rad: for each point the yaw on the way to it, None for that of travel.
            part: the part of a circle that leads to the goal; None for points.
        """
        self._goal = goal
        self._via, self._via_yaw = points, yaws_enu_rad
        self.ring.lead_along(part)

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
        if self._search is not None and self.ring.part is None:
            self._plan_around(self._search, observation)
            return
        self.carrot, self.no_path, self.undecided = None, "", False
        sent = self._choose_start(observation)
        if sent is None:
            return
        if self.ring.part is not None:
            self._take_or_stop(self.ring.plan(sent.state, self.limits, observation), observation)
            return
        # How what drives gets round to the line is the pursuit's.
        start = sent.state if self._traits.flies else KinematicState(sent.state.position_enu_m)
        if self._via:
            route = plan_route(start, self._via)
            trajectory, self._passed_s = route.trajectory, route.passed_s
        else:
            trajectory = plan_to(start, self._goal.position_enu_m, self.limits)
            self._passed_s = ()
        yaw_enu_rad = _first_yaw(self._goal, sent, self._config.yaw_distance_min_m)
        self.carrot = Carrot(trajectory, self._config, sent.yaw_enu_rad, yaw_enu_rad)
        self.path_enu_m = trajectory.path_enu_m

    def _take_or_stop(self, path: CheckedPath | NoPath, observation: Observation) -> None:
        if isinstance(path, CheckedPath):
            self.take(path)
        else:
            self.plan_stop(observation)
            self.no_path = path.reason

    def _plan_around(self, search: PathSearch, observation: Observation) -> None:
        """Advance to the goal around obstacles, or stop while no path is known."""
        self.no_path, self.undecided = "", False
        if not search.continues(self.carrot, self._points):
            before, held = self.sent.commanded, self.carrot
            self.carrot = None
            if self._choose_start(observation) is None:
                return
            if held is not None and not self._leads_to_goal and self.sent.commanded is before:
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
        if self._search is None:
            return None
        return self._search.look(KinematicState(position_enu_m), self._points, observation)

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
        search, sent = self._search, self.sent.commanded
        if search is None or sent is None:
            return None
        if self.ring.part is not None:
            return self.ring.another_path(observation)
        if not search.continues(self.carrot, self._points):
            self._begin_search(search, sent, observation, under_way)
        found = search.result(sent.state, observation.time_s)
        if found is None and not search.is_open:  # it was found too late
            self._begin_search(search, sent, observation, under_way)
        return found

    def _begin_search(
        self, search: PathSearch, sent: Commanded, observation: Observation, under_way: bool
    ) -> None:
        beginning = _beginning(self.sent, sent, self.carrot, observation, search.config)
        points = self._points
        if under_way:
            # A path from where the vehicle is joins nothing: what it has passed counts from there.
            joined = bisect_right(self._passed_s, beginning.joint_s)
            points = points[self.passed if beginning.begins_here else joined :] or points[-1:]
            gap_m = distance(points[0].position_enu_m, beginning.start.position_enu_m)
            if len(points) > 1 and gap_m <= _PASSED_CORNERS * points[0].corner_m:
                points = points[1:]
        search.begin(beginning, points, self._points, observation)

    def path_away(self, observation: Observation) -> CheckedPath | None:
        """Return a path to the nearest clear position; None if none is known (see `Evasion`).

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if self._search is None or self.sent.commanded is None:
            return None
        start = self.sent.start_around(self.sent.commanded, observation)
        return self._search.evasion.plan_away(start, observation)

    def take(self, path: CheckedPath, leads_to_goal: bool = True) -> None:
        """Fly a path that begins at the setpoint sent last, or where the vehicle is.

        Args:
            path: what to fly.
            leads_to_goal: whether it goes through the points that are left, or elsewhere.
        """
        if self.sent.commanded is None:
            return
        yaw_enu_rad = self.sent.commanded.yaw_enu_rad
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
        if self._search is None:
            trajectory = plan_stop(sent.state, self.limits)
        else:
            self.path = self._search.evasion.stop(sent.state, observation)
            trajectory = self.path.trajectory
        self.carrot = Carrot(trajectory, self._config, sent.yaw_enu_rad, sent.yaw_enu_rad)

    def walk(self, position_enu_m: Vector3 | None, rate_max: float = 1.0) -> None:
        """Let the carrot walk on by the time of this step, at a share of its speed at most."""
        dt_s = self.sent.take_time_s()
        if self.carrot is None:
            return
        if self._turn_rate_rad_s:
            self.carrot.turn_on(self._turn_rate_rad_s)
        elif self._passed_s:
            self.carrot.turn_to(self._yaw_on_route(self.carrot))
        self.carrot.advance(dt_s, position_enu_m, rate_max)
        self.ring.lead(self.carrot, position_enu_m, dt_s)

    def follow(self, position_enu_m: Vector3, until_s: float) -> DrivenPath | None:
        """Let the carrot be where a vehicle that drives has come to; return the path ahead.

        Args:
            position_enu_m: where it is.
            until_s: up to when, in the carrot's time, the path may be looked ahead to.
        """
        dt_s = self.sent.take_time_s()
        if self.carrot is None:
            return None
        braking_m_s2 = min(self._traits.braking_m_s2, self.limits.acceleration_horizontal_m_s2)
        self.ring.lead(self.carrot, position_enu_m, dt_s)
        return self.carrot.follow(dt_s, position_enu_m, braking_m_s2, until_s)

    def _yaw_on_route(self, carrot: Carrot) -> float:
        """Return the yaw of the leg that the carrot is on, or its direction of travel."""
        if self.ring.part is not None:
            return self.ring.part.yaw_at(carrot.state.position_enu_m)
        yaws = self._via_yaw or (self._goal.yaw_enu_rad,)
        yaw = yaws[min(self.passed, len(yaws) - 1)]
        if yaw is not None and (self._via or _is_time_to_turn(carrot, yaw)):
            return yaw
        return _yaw_of_motion(carrot)

    def forget_commanded(self) -> None:
        """Drop the last setpoint; the next flight begins where the vehicle is."""
        self.sent.commanded = self.carrot = None

    def extend_at(self, time_s: float) -> None:
        """Plan the rest of a long path at a time of the carrot, and not before."""
        if self.path is not None:
            self.path = replace(self.path, extend_s=time_s)

    def leave_path(self) -> None:
        """Have the next path begin at the setpoint."""
        self.carrot = None

    def _choose_start(self, observation: Observation) -> Commanded | None:
        """Return the setpoint to begin with; None if nothing is known.

        A vehicle that is faster than its goal allows may slow down as hard as others do. With the
        acceleration of a slow goal it would fly on for a long time, paused or cancelled, too.
        """
        sent = self.sent.beginning(observation)
        if sent is None:
            return None
        speed_m_s, usual = horizontal_norm(sent.state.velocity_enu_m_s), self._config.limits
        limits = self.limits.slowing_from(speed_m_s, usual)
        if limits != self.limits:
            self.limits = limits
            if self._search is not None:
                self._search.keep(limits)
        self._via = tuple(
            replace(point, limits=point.limits.slowing_from(speed_m_s, usual))
            for point in self._via
        )
        return sent


def _beginning(
    setpoint: SentSetpoint,
    sent: Commanded,
    carrot: Carrot | None,
    observation: Observation,
    config: AvoidanceConfig,
) -> PathBeginning:
    """Return where a path begins that is found after the usual time of a search."""
    begins_here, lead_s = setpoint.is_left(sent, observation), config.searcher.lead_s
    start, joint_s = setpoint.start_around(sent, observation), 0.0
    if begins_here:
        # The vehicle keeps its present velocity at least until the new path is found.
        moved = scale(start.velocity_enu_m_s, lead_s)
        start = replace(start, position_enu_m=add(start.position_enu_m, moved))
    elif carrot is not None and carrot.state.position_enu_m == start.position_enu_m:
        joint_s, start = carrot.ahead(lead_s)
    elif carrot is not None:
        joint_s = carrot.time_s
    return PathBeginning(carrot, joint_s, start, begins_here)


def _is_time_to_turn(carrot: Carrot, yaw_enu_rad: float) -> bool:
    """Whether to turn to the goal's yaw. Until then the nose, and its sensor, looks ahead."""
    turn_rad = abs(wrap_angle(yaw_enu_rad - carrot.yaw_enu_rad))
    left_s = carrot.trajectory.duration_s - carrot.time_s
    return left_s <= turn_rad / carrot.trajectory.limits.yaw_rate_rad_s


def _yaw_of_motion(carrot: Carrot) -> float:
    """Return the direction of travel; at rest the yaw."""
    east, north, _ = carrot.state.velocity_enu_m_s
    if math.hypot(east, north) < _COURSE_SPEED_M_S:
        return carrot.yaw_enu_rad
    return math.atan2(north, east)


def _first_yaw(goal: GotoGoal, start: Commanded, distance_min_m: float) -> float:
    """Return the yaw of the goal, or the heading to it; if it is close, that at the beginning."""
    if goal.yaw_enu_rad is not None:
        return goal.yaw_enu_rad
    offset = subtract(goal.position_enu_m, start.state.position_enu_m)
    if horizontal_norm(offset) < distance_min_m:
        return start.yaw_enu_rad
    return math.atan2(offset[1], offset[0])
