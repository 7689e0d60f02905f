"""Routes by setpoints, against the simulated ArduCopter."""

from __future__ import annotations

import itertools
import math

import pytest

from navigation_bridge.goals.requests import AltitudeReference, WaypointRequest, WaypointsRequest
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


@pytest.fixture
def flight() -> SimulatedFlight:
    flight = SimulatedFlight().ready()
    flight.fly_up()
    return flight


def route(*positions: tuple[float, float, float], **options: float) -> WaypointsRequest:
    radius_m = options.pop("radius_m", 2.0)
    waypoints = tuple(WaypointRequest(place, acceptance_radius_m=radius_m) for place in positions)
    return WaypointsRequest(waypoints, **options)  # type: ignore[arg-type]


def fly_and_watch(
    flight: SimulatedFlight, goal_id: str, places: list[tuple[float, float, float]]
) -> tuple[list[float], list[float]]:
    """Fly to the end; returns how near the truth came to each place, and the speed there."""
    nearest = [math.inf] * len(places)
    speeds = [math.inf] * len(places)
    while not flight.ends(goal_id):
        flight.run_for(0.05)
        position, speed_m_s = flight.truth()
        for i, place in enumerate(places):
            here = math.dist(position, place)
            if here < nearest[i]:
                nearest[i], speeds[i] = here, speed_m_s
    return nearest, speeds


def test_waypoints_are_flown_through_without_a_stop(flight: SimulatedFlight) -> None:
    places = [(15.0, 0.0, 3.0), (15.0, 15.0, 5.0), (0.0, 15.0, 3.0)]
    goal_id = flight.start(route(*places))
    nearest, speeds = fly_and_watch(flight, goal_id, places)
    (end,) = flight.ends(goal_id)
    assert end.code.value == "SUCCESS", end.message
    assert end.waypoints_reached == 3
    assert max(nearest[:2]) < 2.0
    assert nearest[2] < 1.0
    assert min(speeds[:2]) > 1.0
    feedback = [item.route for item in flight.feedback(goal_id) if item.route is not None]
    assert [item.current for item in feedback] == sorted(item.current for item in feedback)
    assert feedback[0].remaining == 3
    distances = [item.distance_remaining_m for item in flight.feedback(goal_id)]
    assert distances[0] == pytest.approx(45.3, abs=3.0)
    assert all(b <= a + 0.5 for a, b in itertools.pairwise(distances))


def test_a_waypoint_with_a_hold_time_is_a_stop_of_that_time(flight: SimulatedFlight) -> None:
    waypoints = (
        WaypointRequest((10.0, 0.0, 3.0), hold_time_s=4.0),
        WaypointRequest((20.0, 0.0, 3.0)),
    )
    goal_id = flight.start(WaypointsRequest(waypoints))
    still_s = 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.05)
        position, speed_m_s = flight.truth()
        if math.dist(position, (10.0, 0.0, 3.0)) < 0.5 and speed_m_s < 0.3:
            still_s += 0.05
    assert still_s == pytest.approx(4.5, abs=1.0)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS"


def test_laps_are_counted(flight: SimulatedFlight) -> None:
    goal_id = flight.start(route((8.0, 0.0, 3.0), (0.0, 8.0, 3.0), laps=3))
    end = flight.run_to_end(goal_id, 180.0)
    assert end.code.value == "SUCCESS", end.message
    assert end.waypoints_reached == 6
    laps = {item.route.lap for item in flight.feedback(goal_id) if item.route is not None}
    assert laps == {0, 1, 2}


@pytest.mark.night
def test_each_leg_keeps_to_its_own_speed(flight: SimulatedFlight) -> None:
    waypoints = (
        WaypointRequest((20.0, 0.0, 3.0), acceptance_radius_m=2.0, max_speed_m_s=4.0),
        WaypointRequest((40.0, 0.0, 3.0), max_speed_m_s=1.0),
    )
    goal_id = flight.start(WaypointsRequest(waypoints))
    speeds: list[tuple[float, float]] = []
    while not flight.ends(goal_id):
        flight.run_for(0.05)
        position, speed_m_s = flight.truth()
        speeds.append((position[0], speed_m_s))
    assert max(speed for x, speed in speeds if x < 18.0) > 3.0
    assert max(speed for x, speed in speeds if x > 22.0) <= 1.0 * 1.05


def test_a_pause_and_a_cancel_in_a_route(flight: SimulatedFlight) -> None:
    goal_id = flight.start(route((20.0, 0.0, 3.0), (20.0, 20.0, 3.0), (0.0, 20.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][1] > 6.0)
    flight.bridge.services.pause(flight.now)
    flight.run_for(6.0)
    assert flight.truth()[1] < 0.3
    flight.bridge.services.resume(flight.now)
    flight.run_until(lambda: flight.truth()[0][0] < 12.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert end.waypoints_reached == 2
    assert flight.truth()[1] < 0.3


def test_a_new_route_continues_without_a_stop(flight: SimulatedFlight) -> None:
    old = flight.start(route((40.0, 0.0, 3.0), (40.0, 20.0, 3.0)))
    flight.run_until(lambda: flight.truth()[1] > 2.5)
    new = flight.start(route((40.0, -10.0, 3.0), (60.0, -10.0, 3.0)))
    assert flight.slowest_m_s(4.0) > 1.5
    assert flight.ends(old)[0].code.value == "PREEMPTED"
    assert flight.run_to_end(new).code.value == "SUCCESS"


def test_geodetic_waypoints_above_home_and_above_the_sea(flight: SimulatedFlight) -> None:
    waypoints = (
        WaypointRequest((-35.363261, 149.16523 + 1.1e-4, 4.0), AltitudeReference.HOME),
        WaypointRequest((-35.363261 + 9e-5, 149.16523, 584.0 + 6.0), AltitudeReference.AMSL),
    )
    goal_id = flight.start(WaypointsRequest(waypoints))
    nearest, _ = fly_and_watch(flight, goal_id, [(9.99, 0.0, 4.0), (0.0, 9.98, 6.0)])
    assert flight.ends(goal_id)[0].code.value == "SUCCESS"
    assert max(nearest) < 1.0


@pytest.mark.parametrize(
    ("request_", "code", "words"),
    [
        (WaypointsRequest(()), "INVALID_WAYPOINTS", "no waypoint"),
        (route(*[(0.0, 0.0, 3.0)] * 1001), "INVALID_WAYPOINTS", "1001"),
        (route((0.0, 0.0, 3.0), laps=60000), "INVALID_WAYPOINTS", "60000"),
        (route((0.0, 0.0, 3.0), (0.0, math.nan, 3.0)), "INVALID_NUMBER", "Waypoint 2"),
        (route((0.0, 0.0, -3.0)), "BELOW_GROUND", "Waypoint 1"),
        (route((0.0, 0.0, 3.0), (9000.0, 0.0, 3.0)), "OUTSIDE_VOLUME", "Waypoint 2"),
        (route((0.0, 0.0, 3.0), radius_m=-1.0), "INVALID_WAYPOINTS", "acceptance_radius"),
        (route((0.0, 0.0, 3.0), max_speed_m_s=-1.0), "INVALID_WAYPOINTS", "max_speed"),
        (
            WaypointsRequest((WaypointRequest((95.0, 0.0, 3.0), AltitudeReference.HOME),)),
            "INVALID_NUMBER",
            "not a position on earth",
        ),
        (
            WaypointsRequest((WaypointRequest((1.0, 0.0, 3.0), AltitudeReference.GROUND),)),
            "INVALID_WAYPOINTS",
            "above the ground",
        ),
    ],
)
def test_a_route_that_makes_no_sense_is_rejected(
    request_: WaypointsRequest, code: str, words: str
) -> None:
    rejection = SimulatedFlight().ready().check(request_)
    assert rejection is not None
    assert rejection.code.value == code
    assert words in rejection.message
