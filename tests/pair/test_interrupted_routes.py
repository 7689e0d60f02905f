"""Routes that are interrupted and continued by another goal, as after a change of battery."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import WaypointRequest, WaypointsRequest
from tests.support.flights.simulated_flight import SimulatedFlight

PLACES = ((10.0, 0.0, 3.0), (10.0, 20.0, 3.0), (20.0, 20.0, 3.0), (20.0, 0.0, 3.0))
ROUTE = WaypointsRequest(tuple(WaypointRequest(p, acceptance_radius_m=2.0) for p in PLACES))


def interrupt(flight: SimulatedFlight, route: WaypointsRequest, at_index: int) -> GoalFinished:
    """Cancel a route on its way to a waypoint, counted from 0 over all laps."""
    goal_id = flight.start(route)

    def is_there() -> bool:
        told = [item.route for item in flight.feedback(goal_id) if item.route is not None]
        return bool(told) and told[-1].next_index == at_index

    flight.run_until(is_there, 200.0)
    flight.run_for(1.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    return flight.run_to_end(goal_id, 60.0)


@pytest.mark.night_but_first
@pytest.mark.parametrize(
    ("autopilot", "by_mission"),
    [
        ("ardupilot", False),
        pytest.param("px4", False, marks=pytest.mark.wide),
        pytest.param("ardupilot", True, marks=pytest.mark.wide),
        ("px4", True),
    ],
)
def test_the_rest_of_an_interrupted_route_is_flown_and_nothing_twice(
    autopilot: str, by_mission: bool
) -> None:
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot)).ready()
    flight.fly_up()
    route = replace(ROUTE, by_mission=by_mission)
    cancelled = interrupt(flight, route, 2)
    assert cancelled.code.value == "CANCELED", cancelled.message
    assert cancelled.next_index == 2
    assert cancelled.waypoints_reached == 2
    rest = replace(route, first=cancelled.next_index, interrupted_id=cancelled.route_id)
    goal_id = flight.start(rest)
    east_m, nearest_m = [], math.inf
    while not flight.ends(goal_id):
        flight.run_for(0.1)
        position = flight.truth()[0]
        east_m.append(position[0])
        nearest_m = min(nearest_m, math.dist(position, PLACES[2]))
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert (end.next_index, end.waypoints_reached) == (4, 2)
    assert end.route_id == cancelled.route_id
    assert min(east_m) > 8.0  # not back to the first one
    assert nearest_m < 2.5
    told = [item.route for item in flight.feedback(goal_id) if item.route is not None]
    assert (told[0].current, told[0].remaining) == (2, 2)


@pytest.mark.wide
def test_laps_are_counted_on() -> None:
    flight = SimulatedFlight().ready()
    flight.fly_up()
    near = tuple(WaypointRequest(p, acceptance_radius_m=2.0) for p in ((6.0, 0.0, 3.0), PLACES[0]))
    route = WaypointsRequest(near, laps=3)
    cancelled = interrupt(flight, route, 3)
    assert cancelled.next_index == 3
    goal_id = flight.start(replace(route, first=3))
    end = flight.run_to_end(goal_id, 120.0)
    assert end.code.value == "SUCCESS", end.message
    assert (end.next_index, end.waypoints_reached) == (6, 3)
    told = [item.route for item in flight.feedback(goal_id) if item.route is not None]
    assert (told[0].lap, told[0].current) == (1, 1)
    assert {item.lap for item in told} == {1, 2}


@pytest.mark.wide
def test_a_plane_continues_its_route() -> None:
    plane = VehicleConfig(autopilot="ardupilot", vehicle="plane")
    flight = SimulatedFlight(simulated=plane, volume_radius_m=3000.0).ready()
    far = ((300.0, 0.0, 60.0), (300.0, 400.0, 60.0), (0.0, 400.0, 60.0))
    route = WaypointsRequest(tuple(WaypointRequest(p) for p in far))
    cancelled = interrupt(flight, route, 1)
    assert cancelled.next_index == 1
    goal_id = flight.start(replace(route, first=1))
    end = flight.run_to_end(goal_id, 300.0)
    assert end.code.value == "SUCCESS", end.message
    assert (end.next_index, end.waypoints_reached) == (3, 2)


def test_another_route_and_a_waypoint_that_it_does_not_have_are_rejected() -> None:
    flight = SimulatedFlight().ready()
    flight.fly_up()
    cancelled = interrupt(flight, ROUTE, 1)
    shorter = WaypointsRequest(ROUTE.waypoints[:3])
    for other, sentence in (
        (replace(shorter, first=1, interrupted_id=cancelled.route_id), "not the one that was"),
        (replace(ROUTE, laps=2, first=1, interrupted_id=cancelled.route_id), "not the one that"),
        (replace(ROUTE, first=4), "first is 4; the route has 4 waypoints over all laps"),
        (WaypointsRequest(ROUTE.waypoints * 250, laps=1000, first=1), "The rest has 999999"),
    ):
        rejection = flight.check(other)
        assert rejection is not None
        assert rejection.code.value == "INVALID_WAYPOINTS"
        assert sentence in rejection.message
    position, speed_m_s = flight.truth()
    assert speed_m_s < 0.5, position
