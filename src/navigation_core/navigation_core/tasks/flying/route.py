"""Flies a route through its waypoints, stopping only at those with a hold time.

A route is cut into sections that each end in a stop: where a waypoint has a hold time, and at
the end. Each section is flown like a flight to a point, but by way of its other waypoints, so
arming, take-off, pauses, cancels and lost positions are those of
:class:`~navigation_core.tasks.flying.goto.Goto`.

A waypoint counts as reached when the vehicle itself was within its radius, not when the
setpoint was. One that was passed further off is turned back for, if that is wanted, or the route
is flown on and ends with WAYPOINT_MISSED.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from navigation_core.geometry import KinematicState, Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.base import (
    COPTER,
    Observation,
    Outcome,
    Progress,
    RouteProgress,
    Traits,
)
from navigation_core.tasks.conditions import Dwell
from navigation_core.tasks.flying.goto import Goto
from navigation_core.tasks.flying.goto_base import Answer
from navigation_core.tasks.flying.goto_config import GotoConfig, GotoGoal
from navigation_core.tasks.flying.goto_phases import PhaseEvent
from navigation_core.tasks.flying.waypoint import RouteWaypoint
from navigation_core.tasks.leading.avoidance import AvoidanceConfig
from navigation_core.tasks.leading.path_follower import cruise_limits
from navigation_core.trajectories.route_trajectory import RoutePoint

__all__ = ["FlyRoute", "RouteError", "RouteWaypoint"]

# Share of a waypoint's radius by which the planned path may cut its corner; the rest is for
# the vehicle, which does not follow exactly.
_CORNER_SHARE = 0.5
# What could not be met in so many more attempts cannot be met.
_RETURNS = 2
# What drives heads for a waypoint until it is this near to it, in radii; then for what follows.
_MET_SHARE = 0.6


class RouteError(ValueError):
    """A route cannot be flown; the sentence says why."""


class FlyRoute(Goto):
    """The task of one route. See :class:`navigation_core.tasks.base.Task`."""

    def __init__(
        self,
        waypoints: tuple[RouteWaypoint, ...],
        laps: int,
        config: GotoConfig,
        predecessor: KinematicState | None = None,
        predecessor_yaw: float | None = None,
        predecessor_time_s: float | None = None,
        traits: Traits = COPTER,
        avoidance: AvoidanceConfig | None = None,
        turns_back: bool = False,
    ) -> None:
        """Prepare.

        Args:
            waypoints: at least one; they are expected to have passed ``safety.check_target``.
            laps: how often they are flown, at least once.
            config: how to fly.
            predecessor: as for :class:`~navigation_core.tasks.flying.goto.Goto`.
            predecessor_yaw: as there.
            predecessor_time_s: as there.
            traits: what the vehicle can do.
            avoidance: how to keep away from obstacles; None to fly straight.
            turns_back: whether to turn back for a waypoint that was passed outside its radius.

        Raises:
            RouteError: there is no waypoint or no lap.
        """
        if not waypoints or laps < 1:
            raise RouteError("A route needs at least one waypoint and one lap.")
        self._waypoints = waypoints
        self._laps = laps
        # The next waypoint that the vehicle has not passed, counted over all laps.
        self._next = 0
        self._reached = 0
        self._missed: list[int] = []
        self._nearest_m = math.inf
        # How often it may still turn back for the next waypoint.
        self._returns = self._returns_max = _RETURNS if turns_back else 0
        self._planned_from = 0
        super().__init__(
            self._section_goal(),
            config,
            predecessor,
            predecessor_yaw,
            predecessor_time_s,
            traits,
            avoidance,
        )
        self._set_section()

    # --- sections ------------------------------------------------------------------------

    @property
    def _total(self) -> int:
        return len(self._waypoints) * self._laps

    def _at(self, index: int) -> RouteWaypoint:
        return self._waypoints[index % len(self._waypoints)]

    def _section_end(self) -> int:
        """Return the index of the waypoint at which the section under way stops."""
        for index in range(self._next, self._total - 1):
            if self._at(index).hold_time_s > 0.0:
                return index
        return self._total - 1

    def _section_goal(self) -> GotoGoal:
        end = self._at(self._section_end())
        return GotoGoal(end.position_enu_m, end.yaw_enu_rad, end.max_speed_m_s)

    def _set_section(self) -> None:
        """Pass the flight the waypoints up to the next stop."""
        end = self._section_end()
        indices = range(self._next, end + 1)
        points = tuple(
            RoutePoint(
                self._at(i).position_enu_m,
                0.0 if i == end else _CORNER_SHARE * self._at(i).acceptance_radius_m,
                cruise_limits(self._config.limits, self._at(i).max_speed_m_s, self._traits),
            )
            for i in indices
        )
        stop = self._at(end)
        self._goal = self._section_goal()
        self._follower.set_goal(self._goal)
        self._follower.set_route(points, tuple(self._at(i).yaw_enu_rad for i in indices))
        self._estimator.set_goal(stop.position_enu_m)
        self._arrival_radius_m = max(stop.acceptance_radius_m, self._traits.arrival_radius_m)
        self._hold_time_s = stop.hold_time_s
        self._arrival = Dwell(max(self._config.arrival_dwell_s, stop.hold_time_s))
        self._planned_from = self._next
        self._nearest_m = math.inf

    def _begin_flight(self, event: PhaseEvent, observation: Observation, now: float) -> None:
        self._set_section()
        super()._begin_flight(event, observation, now)

    def _note_place(self, observation: Observation) -> None:
        """Tick off the waypoints that the vehicle has come near, or has flown past."""
        position = observation.position_enu_m
        end = self._section_end()
        if position is None or self._next >= end:
            return
        waypoint = self._at(self._next)
        here_m = distance(position, waypoint.position_enu_m)
        self._nearest_m = min(self._nearest_m, here_m)
        near = self._nearest_m <= waypoint.acceptance_radius_m
        setpoint_gone = self._planned_from + self._follower.passed > self._next
        receding = here_m > self._nearest_m + 0.1 and not self._pursuit.leaves
        if not setpoint_gone or not (near or receding):
            return
        if near or self._returns == 0:
            self._tick_off(near)
            return
        self._returns -= 1
        self._nearest_m = math.inf
        self._follower.is_stale = True  # so it is replanned, from here to the same waypoint

    def _tick_off(self, reached: bool) -> None:
        if reached:
            self._reached += 1
        else:
            self._missed.append(self._next)
        self._next += 1
        self._nearest_m = math.inf
        self._returns = self._returns_max

    def _until_s(self) -> float:
        """Return up to when the path may be looked ahead to: no further than what is to be met."""
        if self._next >= self._section_end():
            return math.inf
        if self._nearest_m <= _MET_SHARE * self._at(self._next).acceptance_radius_m:
            return math.inf
        return self._follower.passed_at_s(self._next - self._planned_from)

    def _arrived(self, observation: Observation, now: float) -> Answer:
        error_m = self._error_m(observation)
        self._tick_off(True)
        self._held_s, self._least_left_m = 0.0, math.inf
        if self._next < self._total:
            self._begin_flight(PhaseEvent.REPLAN, observation, now)
            return None
        text = f"Flew {self._reached} of {self._total} waypoints."
        if not self._missed:
            return Outcome(OutcomeCode.SUCCESS, text, error_m)
        names = ", ".join(str(index) for index in self._missed)
        text += f" Passed outside their radius: {names} (counted from 0, over all laps)."
        return Outcome(OutcomeCode.WAYPOINT_MISSED, text, error_m)

    # --- progress ------------------------------------------------------------------------

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress of the whole route."""
        progress = super().progress(observation, now)
        index = min(self._next, self._total - 1)
        more_m, more_s = self._after_section()
        if self._estimator.is_straight and observation.position_enu_m is not None:
            detour_m = self._detour_m(observation.position_enu_m)
            more_m += detour_m
            more_s += detour_m / self._config.limits.speed_horizontal_m_s
        return replace(
            progress,
            distance_remaining_m=progress.distance_remaining_m + more_m,
            time_remaining_s=progress.time_remaining_s + more_s,
            route=RouteProgress(
                current=index % len(self._waypoints),
                lap=index // len(self._waypoints),
                remaining=self._total - self._next,
                reached=self._reached,
                missed=tuple(self._missed),
            ),
        )

    def _detour_m(self, position_enu_m: Vector3) -> float:
        """Return how much longer the path by the waypoints is than straight to the next stop."""
        end = self._section_end()
        places = [position_enu_m, *(self._at(i).position_enu_m for i in range(self._next, end + 1))]
        path_m = sum(distance(a, b) for a, b in itertools.pairwise(places))
        return path_m - distance(places[0], places[-1])

    def _after_section(self) -> tuple[float, float]:
        """Return path and time of what comes after the stop that is flown to."""
        if self._next >= self._total:
            return 0.0, 0.0
        end = self._section_end()
        length_m, time_s = 0.0, self._at(end).hold_time_s
        for index in range(end + 1, self._total):
            waypoint = self._at(index)
            leg_m = distance(self._at(index - 1).position_enu_m, waypoint.position_enu_m)
            limits = cruise_limits(self._config.limits, waypoint.max_speed_m_s, self._traits)
            length_m += leg_m
            time_s += leg_m / limits.speed_horizontal_m_s + waypoint.hold_time_s
        return length_m, time_s
