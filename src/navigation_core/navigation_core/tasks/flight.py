"""The setpoint of a flight: where it begins, where it leads, and what was sent last."""

from __future__ import annotations

import math

from navigation_core.geometry import (
    KinematicState,
    Vector3,
    distance,
    horizontal_norm,
    subtract,
)
from navigation_core.limits import Limits
from navigation_core.routes import RoutePoint, plan_route
from navigation_core.tasks.base import Observation, Setpoint
from navigation_core.tasks.carrot import Carrot
from navigation_core.tasks.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.measurement import is_located, measured_state
from navigation_core.trajectory import plan_stop, plan_to

# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5


# Share of the goal's speed that is planned with. A vehicle sways about the speed it is told
# (simulated copter: up to 6 % after a change), and a goal's speed bounds what it really does.
_CRUISE_SHARE = 0.97
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
    ) -> None:
        """Prepare.

        Args:
            goal: where to go.
            config: how to go there.
            predecessor: state of the setpoint that was sent last, by whomever.
            predecessor_yaw: yaw of that setpoint.
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

    def plan_to_goal(self, observation: Observation) -> None:
        """Plan the flight to the goal; there is no carrot if nothing is known to begin with.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        self.carrot = None
        if not self._choose_start(observation):
            return
        assert self.commanded is not None
        assert self.commanded_yaw is not None
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

    def plan_stop(self, observation: Observation) -> None:
        """Plan a brake; there is no carrot if nothing is known to begin with.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        self.carrot = None
        self._passed_s = ()
        if not self._choose_start(observation):
            return
        assert self.commanded is not None
        assert self.commanded_yaw is not None
        self.carrot = Carrot(
            plan_stop(self.commanded, self.limits),
            self._config,
            self.commanded_yaw,
            self.commanded_yaw,
        )

    def walk(self, position_enu_m: Vector3 | None) -> None:
        """Let the carrot walk on by the time of this step."""
        if self.carrot is not None:
            if self._passed_s:
                self.carrot.turn_to(self._yaw_on_route(self.carrot))
            self.carrot.advance(self.dt_s, position_enu_m)
        self.dt_s = 0.0

    def _yaw_on_route(self, carrot: Carrot) -> float:
        """Return the yaw of the leg that the carrot is on, or its direction of travel."""
        leg = min(self.passed, len(self._via_yaw) - 1)
        yaw = self._via_yaw[leg]
        if yaw is not None:
            return yaw
        east, north, _ = carrot.state.velocity_enu_m_s
        if math.hypot(east, north) < _COURSE_SPEED_M_S:
            return carrot.setpoint.yaw_enu_rad
        return math.atan2(north, east)

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
        if usable and not (located and (self.is_stale or not self._is_near(observation))):
            return True
        if not located:
            return False
        self.commanded = measured_state(observation)
        self.commanded_yaw = observation.yaw_enu_rad
        self.is_stale = False
        self.dt_s = 0.0
        return True

    def _is_near(self, observation: Observation) -> bool:
        assert self.commanded is not None
        here = measured_state(observation).position_enu_m
        error_m = distance(self.commanded.position_enu_m, here)
        return error_m <= _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _yaw_of_travel(self, start_enu_m: Vector3, yaw_enu_rad: float) -> float:
        """Return the heading from a point to the goal, or the present one if it is close."""
        offset = subtract(self._goal.position_enu_m, start_enu_m)
        if horizontal_norm(offset) < self._config.yaw_distance_min_m:
            return yaw_enu_rad
        return math.atan2(offset[1], offset[0])
