"""The setpoint of a flight: where it begins, where it leads, and what was sent last."""

from __future__ import annotations

import math

from navigation_core.braking import STANDING_M_S
from navigation_core.geometry import (
    KinematicState,
    Vector3,
    distance,
    horizontal_norm,
    norm,
    subtract,
    wrap_angle,
)
from navigation_core.limits import Limits
from navigation_core.routes import RoutePoint, plan_route
from navigation_core.tasks.avoidance import AvoidanceConfig
from navigation_core.tasks.base import COPTER, Observation, Setpoint, Traits
from navigation_core.tasks.carrot import Carrot
from navigation_core.tasks.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.measurement import is_located, measured_state
from navigation_core.tasks.way import NoWay, Way, WayPlanner
from navigation_core.tasks.way_out import WayOut
from navigation_core.trajectory import plan_stop, plan_to

# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5


# Share of the goal's speed that is planned with. A vehicle sways about the speed it is told
# (simulated copter: up to 6 % after a change), and a goal's speed bounds what it really does.
_CRUISE_SHARE = 0.97
# As near to a point as so many times the allowed distance from its corner, it counts as passed by
# a setpoint that goes over to another way: it could not be met again without a stop.
_PASSED_CORNERS = 1.5
# Slower than this, a direction of travel says nothing.
_COURSE_SPEED_M_S = 0.5


def cruise_limits(limits: Limits, speed_m_s: float | None) -> Limits:
    """Return limits for a flight that is not to be faster than a speed; None changes none."""
    return limits.with_speed(speed_m_s and speed_m_s * _CRUISE_SHARE)


class Flight:
    """Plans trajectories and remembers the last setpoint, so that the next one fits it."""

    def __init__(
        self,
        goal: GotoGoal,
        config: GotoConfig,
        predecessor: KinematicState | None,
        predecessor_yaw: float | None,
        avoidance: AvoidanceConfig | None = None,
        traits: Traits = COPTER,
    ) -> None:
        """Prepare.

        Args:
            goal: where to go.
            config: how to go there.
            predecessor: state of the setpoint that was sent last, by whomever.
            predecessor_yaw: yaw of that setpoint.
            avoidance: how to keep away from obstacles; None to fly straight.
            traits: what the vehicle can do.
        """
        self.limits = cruise_limits(config.limits, goal.max_speed_m_s)
        self.carrot: Carrot | None = None
        # Where the last plan to the goal leads.
        self.path_enu_m: tuple[Vector3, ...] = ()
        self.commanded = predecessor
        self.commanded_yaw = predecessor_yaw
        # Time that the setpoint has yet to walk in this step.
        self.dt_s = 0.0
        # Whether time has passed without setpoints, so that the last one says nothing.
        self.is_stale = False
        self._goal = goal
        self._config = config
        self._yaw_goal = goal.yaw_enu_rad
        self._via: tuple[RoutePoint, ...] = ()
        self._via_yaw: tuple[float | None, ...] = ()
        self._passed_s: tuple[float, ...] = ()
        # The way around obstacles that is flown, and why there is none.
        self.way: Way | None = None
        self.no_way = ""
        # Whether the search for one is not at its end.
        self.undecided = False
        self._leads_to_goal = False
        self.ways = self.way_out = None
        self.starts_here = False
        if avoidance is not None:
            self.ways = WayPlanner(avoidance, traits, self.limits)
            # What drives lags behind its setpoint by metres. A way or a brake from there would
            # come too late, and could begin in what it was to keep away from.
            self.starts_here = not traits.flies
            self.way_out = WayOut(avoidance, traits, self.limits)

    @property
    def passed(self) -> int:
        """How many points of the route the carrot has passed since the flight was planned."""
        if self.carrot is None:
            return 0
        return sum(1 for time_s in self._passed_s if time_s <= self.carrot.time_s)

    def set_route(
        self, points: tuple[RoutePoint, ...], yaws_enu_rad: tuple[float | None, ...]
    ) -> None:
        """Fly to the goal by way of points from the next plan on.

        Args:
            points: the way; the last is the goal. Empty for the straight way.
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

    def plan_to_goal(self, observation: Observation, attempt: int | None = None) -> None:
        """Plan the flight to the goal; there is no carrot if nothing is known to begin with.

        If obstacles leave no way, ``no_way`` says why, and the vehicle is stopped.

        Args:
            observation: what is known.
            attempt: the only one to make, see :meth:`~.way.WayPlanner.plan`; if others are left
                after it, ``undecided`` says so, and the vehicle is stopped.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        before, held = self.commanded, self.carrot
        self.carrot = None
        self.no_way, self.undecided = "", False
        if not self._choose_start(observation):
            return
        assert self.commanded is not None
        assert self.commanded_yaw is not None
        if self.ways is not None:
            way = self.find_way(observation, attempt=attempt)
            if isinstance(way, Way):
                self.take(way)
                return
            self.undecided = way is None
            self.no_way = "" if way is None else way.reason
            if held is not None and not self._leads_to_goal and self.commanded is before:
                self.carrot = held
            else:
                self.plan_stop(observation)
            return
        if self._yaw_goal is None:
            self._yaw_goal = self._yaw_of_travel(self.commanded.position_enu_m, self.commanded_yaw)
        if self._via:
            route = plan_route(self.commanded, self._via)
            trajectory, self._passed_s = route.trajectory, route.passed_s
        else:
            trajectory = plan_to(self.commanded, self._goal.position_enu_m, self.limits)
            self._passed_s = ()
        self.carrot = Carrot(trajectory, self._config, self.commanded_yaw, self._yaw_goal)
        self.path_enu_m = trajectory.path_enu_m

    def preview(self, position_enu_m: Vector3, observation: Observation) -> Way | None:
        """Return the way around obstacles as it would be from a place; None without one."""
        if self.ways is None:
            return None
        yaw = observation.yaw_enu_rad or 0.0
        start = KinematicState(position_enu_m)
        way = self.ways.plan(start, yaw, self._points, observation.obstacles)
        return way if isinstance(way, Way) else None

    def find_way(
        self, observation: Observation, under_way: bool = False, attempt: int | None = None
    ) -> Way | NoWay | None:
        """Look for a way around obstacles, from :meth:`start` on.

        Args:
            observation: what is known; there must have been a setpoint.
            under_way: whether the points that were passed are left out.
            attempt: the only one to make, see :meth:`~.way.WayPlanner.plan`.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        assert self.ways is not None
        assert self.commanded is not None
        points = self._points
        if under_way:
            points = self.points
            gap_m = distance(points[0].position_enu_m, self.commanded.position_enu_m)
            if len(points) > 1 and gap_m <= _PASSED_CORNERS * points[0].corner_m:
                points = points[1:]
        yaw = observation.yaw_enu_rad or 0.0
        start = self.start(observation)
        return self.ways.plan(start, yaw, points, observation.obstacles, attempt)

    def start(self, observation: Observation) -> KinematicState:
        """Return where a way around obstacles begins; there must have been a setpoint."""
        assert self.commanded is not None
        if self.starts_here and is_located(observation, self._config.position_stale_s):
            return measured_state(observation)
        return self.commanded

    def take(self, way: Way, leads_to_goal: bool = True) -> None:
        """Fly a way that begins at :meth:`start`.

        Args:
            way: what to fly.
            leads_to_goal: whether it goes through the points that are left, or elsewhere.
        """
        assert self.commanded_yaw is not None
        self._passed_s = ()
        if leads_to_goal:
            gone = len(self._points) - len(way.passed_s)
            self._passed_s = (-math.inf,) * gone + way.passed_s
            self.path_enu_m = way.trajectory.path_enu_m
        self.carrot = Carrot(way.trajectory, self._config, self.commanded_yaw, self.commanded_yaw)
        self.way = way
        self._leads_to_goal = leads_to_goal

    def plan_stop(self, observation: Observation) -> None:
        """Plan a brake; there is no carrot if nothing is known to begin with.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        self.carrot = self.way = None
        self._leads_to_goal = False
        self._passed_s = ()
        if not self._choose_start(observation):
            return
        assert self.commanded is not None
        assert self.commanded_yaw is not None
        if self.starts_here and norm(self.commanded.velocity_enu_m_s) < STANDING_M_S:
            # A standstill is measured with a little speed. A brake that begins with that, asked
            # for again and again, would pass it on, and the vehicle would creep.
            self.commanded = KinematicState(self.commanded.position_enu_m)
        if self.way_out is None:
            trajectory = plan_stop(self.commanded, self.limits)
        else:
            self.way = self.way_out.stop(self.commanded, observation.obstacles)
            trajectory = self.way.trajectory
        self.carrot = Carrot(trajectory, self._config, self.commanded_yaw, self.commanded_yaw)

    def walk(self, position_enu_m: Vector3 | None) -> None:
        """Let the carrot walk on by the time of this step."""
        if self.carrot is not None:
            if self._passed_s:
                self.carrot.turn_to(self._yaw_on_route(self.carrot))
            self.carrot.advance(self.dt_s, position_enu_m)
        self.dt_s = 0.0

    def _yaw_on_route(self, carrot: Carrot) -> float:
        """Return the yaw of the leg that the carrot is on, or its direction of travel."""
        yaws = self._via_yaw or (self._goal.yaw_enu_rad,)
        yaw = yaws[min(self.passed, len(yaws) - 1)]
        if yaw is not None and (self._via or self._is_time_to_turn(carrot, yaw)):
            return yaw
        east, north, _ = carrot.state.velocity_enu_m_s
        if math.hypot(east, north) < _COURSE_SPEED_M_S:
            return carrot.setpoint.yaw_enu_rad
        return math.atan2(north, east)

    @staticmethod
    def _is_time_to_turn(carrot: Carrot, yaw_enu_rad: float) -> bool:
        """Whether to turn to the goal's yaw. Until then the nose, and its sensor, looks ahead."""
        turn_rad = abs(wrap_angle(yaw_enu_rad - carrot.setpoint.yaw_enu_rad))
        left_s = carrot.trajectory.duration_s - carrot.time_s
        return left_s <= turn_rad / carrot.trajectory.limits.yaw_rate_rad_s

    def note(self, setpoint: Setpoint) -> None:
        """Remember the setpoint that is sent."""
        self.commanded = KinematicState(
            setpoint.position_enu_m,
            setpoint.velocity_enu_m_s,
            setpoint.acceleration_enu_m_s2,
        )
        self.commanded_yaw = setpoint.yaw_enu_rad

    def forget_commanded(self) -> None:
        """Drop the last setpoint; the next flight begins where the vehicle is."""
        self.commanded = self.commanded_yaw = self.carrot = None

    def _choose_start(self, observation: Observation) -> bool:
        """Begin at the last setpoint if that still makes sense, else where the vehicle is.

        Returns:
            Whether there is anything to begin with.
        """
        located = is_located(observation, self._config.position_stale_s)
        usable = self.commanded is not None and self.commanded_yaw is not None
        if usable and not (located and self._must_start_anew(observation)):
            return True
        if not located:
            return False
        self.commanded = measured_state(observation)
        self.commanded_yaw = observation.yaw_enu_rad
        self.is_stale = False
        self.dt_s = 0.0
        return True

    def _must_start_anew(self, observation: Observation) -> bool:
        """Whether the last setpoint is nothing to go on from."""
        if self.starts_here or self.is_stale:
            return True
        assert self.commanded is not None
        here = measured_state(observation).position_enu_m
        error_m = distance(self.commanded.position_enu_m, here)
        return error_m > _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _yaw_of_travel(self, start_enu_m: Vector3, yaw_enu_rad: float) -> float:
        """Return the heading from a point to the goal, or the present one if it is close."""
        offset = subtract(self._goal.position_enu_m, start_enu_m)
        if horizontal_norm(offset) < self._config.yaw_distance_min_m:
            return yaw_enu_rad
        return math.atan2(offset[1], offset[0])
