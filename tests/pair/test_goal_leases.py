"""Goals that end once their client is not heard any more."""

from __future__ import annotations

import math

import pytest

from navigation_bridge.goals.requests import LandRequest, TakeoffRequest
from navigation_bridge.requests.goal_leases import GoalLeases
from tests.support.flights.simulated_flight import SimulatedFlight

LOST = "The client that sent the goal has not been heard for"


def flying() -> SimulatedFlight:
    flight = SimulatedFlight().ready()
    flight.fly_up()
    return flight


def renew_for(flight: SimulatedFlight, goal_id: str, seconds: float) -> None:
    """Renew the lease each second, for some time."""
    for _ in range(int(seconds)):
        flight.bridge.feature(GoalLeases).renew(goal_id, flight.now)
        flight.run_for(1.0)


def test_a_goal_whose_client_is_not_heard_any_more_ends_and_the_vehicle_holds() -> None:
    flight = flying()
    goal_id = flight.send(0.0, 100.0, 3.0, 1.0)
    renew_for(flight, goal_id, 20)
    assert not flight.ends(goal_id)
    assert flight.truth()[1] > 0.5, "it flies while its client is heard"
    end = flight.run_to_end(goal_id, 15.0)
    assert end.code.value == "CLIENT_LOST"
    assert end.message.startswith(f"CLIENT_LOST: {LOST}")
    (east, north, up), _ = flight.truth()
    flight.run_for(5.0)
    assert math.dist(flight.truth()[0], (east, north, up)) < 0.5, "it holds"
    assert flight.simulation.vehicles[0].firmware.armed


def test_a_goal_that_was_never_leased_flies_on_without_its_client() -> None:
    flight = flying()
    goal_id = flight.send(0.0, 30.0, 3.0)
    flight.bridge.feature(GoalLeases).renew("f" * 32, flight.now)
    assert flight.run_to_end(goal_id).code.value == "SUCCESS"


def test_a_lease_that_comes_before_its_goal_counts() -> None:
    flight = flying()
    goal_id, leases = f"{2:032x}", flight.bridge.feature(GoalLeases)
    leases.renew(goal_id, flight.now)
    assert flight.send(0.0, 100.0, 3.0, 1.0) == goal_id
    assert flight.run_to_end(goal_id, 15.0).code.value == "CLIENT_LOST"

    # Others' ids push out the oldest only.
    late, early = f"{3:032x}", f"{4:032x}"
    leases.renew(late, flight.now)
    for number in range(100):
        leases.renew(f"{1000 + number:032x}", flight.now)
    leases.renew(early, flight.now)
    assert flight.send(0.0, 0.0, 3.0) == late
    assert flight.run_to_end(late).code.value == "SUCCESS"
    assert flight.send(0.0, 100.0, 3.0, 1.0) == early
    assert flight.run_to_end(early, 15.0).code.value == "CLIENT_LOST"


def test_a_person_who_replaces_the_goal_has_the_vehicle() -> None:
    flight = flying()
    first = flight.send(0.0, 100.0, 3.0, 1.0)
    renew_for(flight, first, 3)
    second = flight.send(0.0, 20.0, 3.0, 1.0)
    renew_for(flight, first, 2)  # its client has not heard yet that it is over
    assert flight.run_to_end(second).code.value == "SUCCESS"


def test_a_paused_goal_ends_with_its_client_and_is_not_resumed() -> None:
    flight = flying()
    goal_id = flight.send(0.0, 100.0, 3.0, 1.0)
    renew_for(flight, goal_id, 3)
    assert flight.bridge.services.pause(flight.now)[0]
    renew_for(flight, goal_id, 8)
    assert flight.status(goal_id) == "PAUSED"
    assert flight.run_to_end(goal_id, 15.0).code.value == "CLIENT_LOST"
    assert not flight.bridge.services.resume(flight.now)[0]


@pytest.mark.parametrize("landing", [True, False])
def test_a_landing_or_a_take_off_without_its_client_is_left_in_the_air(landing: bool) -> None:
    flight = SimulatedFlight().ready()
    if landing:
        end = flight.run_to_end(flight.send(0.0, 0.0, 30.0))
        assert end.code.value == "SUCCESS"
    goal_id = flight.start(LandRequest() if landing else TakeoffRequest(60.0))
    flight.bridge.feature(GoalLeases).renew(goal_id, flight.now)
    assert flight.run_to_end(goal_id, 25.0).code.value == "CLIENT_LOST"
    up = flight.truth()[0][2]
    assert up > 2.0
    flight.run_for(5.0)
    assert flight.truth()[0][2] == pytest.approx(up, abs=0.5)


def test_a_server_that_stood_still_itself_waits_for_the_client_to_be_heard_again() -> None:
    flight = flying()
    goal_id = flight.send(0.0, 100.0, 3.0, 1.0)
    renew_for(flight, goal_id, 5)
    flight.hang_for(8.0)
    flight.run_for(0.5)
    renew_for(flight, goal_id, 10)
    assert not flight.ends(goal_id)
    # The client did not come back: it is not waited for any longer than before.
    flight.hang_for(8.0)
    assert flight.run_to_end(goal_id, 10.0).code.value == "CLIENT_LOST"
