"""Fleets whose servers hang, are late or find each other late keep apart, and nobody is stuck."""

from __future__ import annotations

import pytest

from navigation_bridge.goals.requests import ReturnRequest
from tests.fleets.flown import FlownFleet
from tests.fleets.hangs import CIRCLE_MAX_S, sent_to_one_that_hovers, swapped_and_returned
from tests.fleets.test_crossing import codes, copters

pytestmark = [pytest.mark.night, pytest.mark.timeout(900)]


def above_each_others_launch_points() -> FlownFleet:
    """Return two copters that hover there, at 5 and 9 m."""
    places = [(0.0, 0.0), (12.0, 0.0)]
    fleet = FlownFleet(copters(places)).ready()
    for craft, (east, north), height_m in zip(fleet.crafts, places[::-1], (5.0, 9.0), strict=True):
        fleet.go(craft, east, north, height_m)
    fleet.run_to_end(100.0)
    return fleet


def test_of_two_that_hover_above_each_others_launch_points_the_last_to_return_makes_room() -> None:
    fleet = above_each_others_launch_points()
    with fleet.holding():
        for craft in fleet.crafts:
            assert isinstance(fleet.send(craft, ReturnRequest()), str)
        fleet.run_to_end(200.0)
    assert codes(fleet) == ["SUCCESS"] * 4, fleet.report()


def test_one_whose_position_was_old_when_it_was_asked_to_return_makes_room() -> None:
    fleet = above_each_others_launch_points()
    with fleet.holding():
        first, last = fleet.crafts
        assert isinstance(fleet.send(first, ReturnRequest()), str)
        link = fleet.simulation.vehicles[last.row].link
        link.silent = True
        fleet.run_for(1.5)
        assert isinstance(fleet.send(last, ReturnRequest()), str)
        link.silent = False
        fleet.run_to_end(120.0)
    assert codes(fleet) == ["SUCCESS"] * 4, fleet.report()


@pytest.mark.parametrize(("seed", "servers"), [(0, 1), (0, 3), (5, 3)])
def test_after_hangs_all_that_swap_places_arrive_and_return(seed: int, servers: int) -> None:
    """`python -m tests.fleets --hangs` flies more."""
    flight = swapped_and_returned(seed, servers)
    assert flight.share >= 1.0, flight.text
    assert flight.waited_s <= CIRCLE_MAX_S, flight.text
    assert set(flight.codes) == {"SUCCESS"}, flight.text


@pytest.mark.parametrize("seed", range(4))
def test_who_is_sent_to_where_one_of_another_server_hovers_keeps_apart(seed: int) -> None:
    flight = sent_to_one_that_hovers(seed)
    assert flight.share >= 1.0, flight.text
