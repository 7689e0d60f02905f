"""Flies a route through its waypoints, stopping only at those with a hold time.

A route is cut into sections that each end in a stop: where a waypoint has a hold time, and at
the end. Each section is flown like a flight to a point, but by way of its other waypoints, so
arming, take-off, pauses, cancels and lost positions are those of
:class:`~navigation_core.tasks.flying.flight.SetpointFlight`.

A waypoint counts as reached when the vehicle itself was within its radius, not when the
setpoint was. One that was passed further off is turned back for, if that is wanted, or the route
is flown on and ends with WAYPOINT_MISSED. The acts of a waypoint are done once it is reached, those
of a stop after its hold time.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.act_queue import ActQueue
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.itinerary import Section
from navigation_core.tasks.goto_config import GotoGoal
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import cruise_limits
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.progress import Progress
from navigation_core.tasks.waypoint import Route
from navigation_core.trajectories.route_trajectory import RoutePoint

# Share of a waypoint's radius by which the planned path may cut its corner; the rest is for
# the vehicle, which does not follow exactly.
_CORNER_SHARE = 0.5
# Further attempts at a waypoint that was missed. One that is missed again then is given up.
_RETURNS_MAX = 2
# A rover or boat heads for a waypoint until it is this near to it, as a share of the acceptance
# radius; then for the next one.
_MET_SHARE = 0.6


class RouteItinerary:
    """The sections of a route. See :class:`~navigation_core.tasks.flying.itinerary.Itinerary`."""

    def __init__(self, route: Route, terms: FlightTerms, turns_back: bool, acts: ActQueue) -> None:
        """Prepare; the arguments are those of :func:`fly_route`, and what does the acts."""
        self._route = route
        self._acts = acts
        self._limits = terms.config.limits
        self._traits = terms.traits
        # The next waypoint that the vehicle has not passed.
        self._next = 0
        self._reached = 0
        self._missed: list[int] = []
        self._nearest_m = math.inf
        # How often it may still turn back for the next waypoint.
        self._returns = self._returns_max = _RETURNS_MAX if turns_back else 0
        self._planned_from = 0

    def _section_end(self) -> int:
        """Return the index of the waypoint at which the section in progress stops."""
        for index in range(self._next, self._route.total - 1):
            if self._route.at(index).stay_s > 0.0:
                return index
        return self._route.total - 1

    def begin_section(self, observation: Observation | None = None) -> Section:
        """Return the waypoints up to the next stop."""
        end = self._section_end()
        indices = range(self._next, end + 1)
        points = tuple(
            RoutePoint(
                self._route.at(i).position_enu_m,
                0.0 if i == end else _CORNER_SHARE * self._route.at(i).acceptance_radius_m,
                cruise_limits(self._limits, self._route.at(i).max_speed_m_s, self._traits),
            )
            for i in indices
        )
        stop = self._route.at(end)
        self._acts.expect_stop(end, self._route.numbers((end,)), stop.acts)
        self._planned_from = self._next
        self._nearest_m = math.inf
        return Section(
            GotoGoal(stop.position_enu_m, stop.yaw_enu_rad, stop.max_speed_m_s),
            points,
            tuple(self._route.at(i).yaw_enu_rad for i in indices),
            stop.acceptance_radius_m,
            stop.hold_time_s,
        )

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Tick off the waypoints that the vehicle has come near, or has flown past."""
        if position_enu_m is None or self._next >= self._section_end():
            return False
        waypoint = self._route.at(self._next)
        here_m = distance(position_enu_m, waypoint.position_enu_m)
        self._nearest_m = min(self._nearest_m, here_m)
        near = self._nearest_m <= waypoint.acceptance_radius_m
        setpoint_gone = self._planned_from + passed > self._next
        receding = here_m > self._nearest_m + 0.1 and not leaves
        if not setpoint_gone or not (near or receding):
            return False
        if near or self._returns == 0:
            self._tick_off(near)
            return False
        self._returns -= 1
        self._nearest_m = math.inf
        return True

    def _tick_off(self, reached: bool) -> None:
        if self._next != self._section_end():
            number, acts = self._route.numbers((self._next,)), self._route.at(self._next).acts
            self._acts.add(number, acts, reached=reached)
        if reached:
            self._reached += 1
        else:
            self._missed.append(self._next)
        self._next += 1
        self._nearest_m = math.inf
        self._returns = self._returns_max

    def point_to_meet(self) -> int | None:
        """Return the next waypoint, counted from the section's first; None for the stop."""
        if self._next >= self._section_end():
            return None
        if self._nearest_m <= _MET_SHARE * self._route.at(self._next).acceptance_radius_m:
            return None
        return self._next - self._planned_from

    def arrive(self, error_m: float) -> Outcome | None:
        """Tick off the stop; returns the end of the route after the last."""
        self._tick_off(True)
        if self._next < self._route.total:
            return None
        text = f"Flew {self._reached} of {self._route.total} waypoints."
        if self._acts.failed:
            text += f" Not done: {', '.join(self._acts.failed)}."
        if not self._missed:
            return Outcome(OutcomeCode.SUCCESS, text, error_m)
        names = self._route.numbers(self._missed)
        text += f" Passed outside their radius: {names} (counted over all laps)."
        return Outcome(OutcomeCode.WAYPOINT_MISSED, text, error_m)

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return the progress of the whole route."""
        more_m, more_s = self._after_section()
        if is_straight and position_enu_m is not None:
            detour_m = self._detour_m(position_enu_m)
            more_m += detour_m
            more_s += detour_m / self._limits.speed_horizontal_m_s
        return replace(
            progress,
            distance_remaining_m=progress.distance_remaining_m + more_m,
            time_remaining_s=progress.time_remaining_s + more_s,
            route=self._route.progress(self._next, self._reached, tuple(self._missed)),
        )

    def _detour_m(self, position_enu_m: Vector3) -> float:
        """Return how much longer the path by the waypoints is than straight to the next stop."""
        end = self._section_end()
        places = [
            position_enu_m,
            *(self._route.at(i).position_enu_m for i in range(self._next, end + 1)),
        ]
        path_m = math.fsum(distance(a, b) for a, b in itertools.pairwise(places))
        return path_m - distance(places[0], places[-1])

    def _after_section(self) -> tuple[float, float]:
        """Return path and time of what comes after the stop that is flown to."""
        if self._next >= self._route.total:
            return 0.0, 0.0
        end = self._section_end()
        length_m, time_s = 0.0, self._route.at(end).stay_s
        for index in range(end + 1, self._route.total):
            waypoint = self._route.at(index)
            leg_m = distance(self._route.at(index - 1).position_enu_m, waypoint.position_enu_m)
            limits = cruise_limits(self._limits, waypoint.max_speed_m_s, self._traits)
            length_m += leg_m
            time_s += leg_m / limits.speed_horizontal_m_s + waypoint.stay_s
        return length_m, time_s


def fly_route(route: Route, terms: FlightTerms, turns_back: bool = False) -> SetpointFlight:
    """Return the flight along a route.

    Args:
        route: where to fly.
        terms: how to fly.
        turns_back: whether to turn back for a waypoint that was passed outside its radius.
    """
    acts = ActQueue()
    return SetpointFlight(RouteItinerary(route, terms, turns_back, acts), terms, acts)
