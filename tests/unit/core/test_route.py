"""Routes by setpoints: reached waypoints, and the handling of missed ones."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.progress import RouteProgress, Status
from navigation_core.tasks.waypoint import Route, RouteError, RouteWaypoint
from tests.support.models.point_mass import PointMass, fly

PLACES = ((8.0, 0.0, 3.0), (16.0, 0.0, 3.0), (24.0, 0.0, 3.0))
GUST_M_S = 1.8


def hovering() -> PointMass:
    return PointMass(position=(0.0, 0.0, 3.0), armed=True, in_control=True, airborne=True)


def route(laps: int = 1, hold_time_s: float = 0.0, turns_back: bool = False) -> SetpointFlight:
    """Three waypoints in a line, each with a radius of half a metre."""
    waypoints = tuple(RouteWaypoint(place, 0.5, hold_time_s, max_speed_m_s=2.0) for place in PLACES)
    return fly_route(Route(waypoints, laps), FlightTerms(GotoConfig()), turns_back=turns_back)


def gust(vehicle: PointMass, times: int = 1) -> Callable[[float], None]:
    """A wind that pushes aside around the second waypoint, the first times that it is there."""
    passes = 0
    was_within = False

    def each_step(_: float) -> None:
        nonlocal passes, was_within
        within = 12.0 < vehicle.position[0] < 18.0
        passes += was_within and not within
        was_within = within
        vehicle.wind = (0.0, GUST_M_S if within and passes < times else 0.0, 0.0)

    return each_step


def told(task: SetpointFlight, vehicle: PointMass) -> RouteProgress:
    progress = task.progress(vehicle.observe(), vehicle.now).route
    assert progress is not None
    return progress


def test_a_route_that_met_all_its_waypoints_succeeds() -> None:
    vehicle, task = hovering(), route()
    outcome = fly(task, vehicle).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.message == "Flew 3 of 3 waypoints."
    assert told(task, vehicle).missed == ()


def test_one_that_passed_a_waypoint_outside_its_radius_does_not() -> None:
    vehicle, task = hovering(), route()
    outcome = fly(task, vehicle, gust(vehicle)).outcome
    assert outcome.code is OutcomeCode.WAYPOINT_MISSED
    assert "Flew 2 of 3 waypoints. Passed outside their radius: 2 (counted" in outcome.message
    assert outcome.final_error_m is not None
    assert outcome.final_error_m < 0.5, "the rest is flown all the same"
    assert told(task, vehicle).missed == (1,)
    assert told(task, vehicle).reached == 2


def test_it_is_reported_while_the_rest_is_flown() -> None:
    vehicle, task = hovering(), route()
    each_step, missed = gust(vehicle), []

    def watch(elapsed_s: float) -> None:
        each_step(elapsed_s)
        if 20.0 < vehicle.position[0] < 22.0:
            missed.append(told(task, vehicle).missed)

    fly(task, vehicle, watch)
    assert set(missed) == {(1,)}


def test_it_turns_back_for_a_missed_waypoint_if_it_is_to() -> None:
    vehicle, task = hovering(), route(turns_back=True)
    outcome = fly(task, vehicle, gust(vehicle)).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.message == "Flew 3 of 3 waypoints."
    assert told(task, vehicle).missed == ()


def test_what_cannot_be_met_is_given_up_after_two_more_attempts() -> None:
    vehicle, task = hovering(), route(turns_back=True)
    each_step = gust(vehicle, times=100)
    approaches: list[tuple[Vector3, ...]] = []

    def watch(elapsed_s: float) -> None:
        each_step(elapsed_s)
        # The gust is as wide as the turn, so each attempt is one more plan to the same waypoint.
        if not approaches or task.path_enu_m is not approaches[-1]:
            approaches.append(task.path_enu_m)

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.WAYPOINT_MISSED
    assert told(task, vehicle).missed == (1,)
    assert len([path for path in approaches if path]) == 3


def test_waypoints_of_later_laps_are_counted_on() -> None:
    vehicle, task = hovering(), route(laps=2)
    each_step = gust(vehicle)

    def in_second_lap(elapsed_s: float) -> None:
        if told(task, vehicle).lap == 1 and told(task, vehicle).current > 0:
            each_step(elapsed_s)

    outcome = fly(task, vehicle, in_second_lap).outcome
    assert outcome.code is OutcomeCode.WAYPOINT_MISSED
    assert told(task, vehicle).missed == (4,)
    assert told(task, vehicle).reached == 5


def test_one_with_a_hold_time_is_never_missed_but_waited_for() -> None:
    vehicle, task = hovering(), route(hold_time_s=1.0)
    each_step = gust(vehicle)

    def for_a_while(elapsed_s: float) -> None:
        each_step(elapsed_s)
        if elapsed_s > 30.0:
            vehicle.wind = (0.0, 0.0, 0.0)

    assert fly(task, vehicle, for_a_while).outcome.code is OutcomeCode.SUCCESS


@pytest.mark.parametrize(("count", "laps"), [(0, 1), (1, 0)])
def test_a_route_without_waypoints_or_laps_is_none(count: int, laps: int) -> None:
    waypoint = RouteWaypoint(PLACES[0], 0.5)
    with pytest.raises(RouteError, match="at least one"):
        Route((waypoint,) * count, laps)


def test_what_is_left_of_a_paused_route_goes_through_its_waypoints() -> None:
    """And not straight to its end, which may be near."""
    corners = ((10.0, 0.0, 3.0), (10.0, 10.0, 3.0), (0.0, 10.0, 3.0))
    waypoints = tuple(RouteWaypoint(place, 0.5, max_speed_m_s=2.0) for place in corners)
    vehicle, task = hovering(), fly_route(Route(waypoints, 1), FlightTerms(GotoConfig()))
    left_m: dict[Status, list[float]] = {}

    def each_step(elapsed_s: float) -> None:
        if 2.0 <= elapsed_s < 6.0:
            task.pause(vehicle.now)
        else:
            task.unpause(vehicle.now)
        progress = task.progress(vehicle.observe(), vehicle.now)
        left_m.setdefault(progress.status, []).append(progress.distance_remaining_m)

    assert fly(task, vehicle, each_step).outcome.code is OutcomeCode.SUCCESS
    assert min(left_m[Status.PAUSED]) > 20.0
    assert max(left_m[Status.PAUSED]) < 30.1
