"""The least separation of flights, along time."""

from __future__ import annotations

import pytest

from drone_navigation.console.rehearsing.separations import TimedFlight, meetings
from navigation_core.geometry import Vector3
from navigation_core.tasks.traffic.volumes import Separation

SEPARATION = Separation(horizontal_m=5.0, vertical_m=3.0, parked_m=2.0)


def leg(start: Vector3, end: Vector3, begin_s: float, end_s: float) -> TimedFlight:
    return TimedFlight((start, end), (begin_s, end_s), parked=False)


def test_paths_that_cross_at_different_times_keep_apart() -> None:
    first = leg((-20.0, 0.0, 5.0), (20.0, 0.0, 5.0), 0.0, 20.0)
    late = leg((0.0, -20.0, 5.0), (0.0, 20.0, 5.0), 30.0, 50.0)
    (found,) = meetings({"a": first, "b": late}, SEPARATION)
    assert not found.is_too_near
    # It passes b, which still stays 20 m south.
    assert found.distance_m == pytest.approx(20.0, abs=0.2)
    at_once = leg((0.0, -20.0, 5.0), (0.0, 20.0, 5.0), 0.0, 20.0)
    (found,) = meetings({"a": first, "b": at_once}, SEPARATION)
    assert found.is_too_near
    assert found.time_s == pytest.approx(10.0, abs=0.2)
    assert found.distance_m < 0.5


def test_height_alone_separates() -> None:
    low = leg((-20.0, 0.0, 5.0), (20.0, 0.0, 5.0), 0.0, 20.0)
    high = leg((20.0, 0.0, 9.0), (-20.0, 0.0, 9.0), 0.0, 20.0)
    (found,) = meetings({"low": low, "high": high}, SEPARATION)
    assert not found.is_too_near
    assert found.distance_m == pytest.approx(4.0, abs=0.2)
    lower = leg((20.0, 0.0, 7.5), (-20.0, 0.0, 7.5), 0.0, 20.0)
    (found,) = meetings({"low": low, "lower": lower}, SEPARATION)
    assert found.is_too_near
    assert (found.horizontal_m, found.vertical_m) == pytest.approx((0.0, 2.5), abs=0.3)


def test_less_is_kept_from_one_that_is_parked_and_two_parked_ones_do_not_meet() -> None:
    passing = leg((-20.0, 3.0, 1.0), (20.0, 3.0, 1.0), 0.0, 20.0)
    parked = TimedFlight(((0.0, 0.0, 0.0),), (0.0,), parked=True)
    beside = TimedFlight(((1.0, 0.0, 0.0),), (0.0,), parked=True)
    (found,) = meetings({"a": passing, "parked": parked}, SEPARATION)
    assert not found.is_too_near
    hovering = TimedFlight(((0.0, 0.0, 0.0),), (0.0,), parked=False)
    (found,) = meetings({"a": passing, "hovering": hovering}, SEPARATION)
    assert found.is_too_near
    (found,) = meetings({"parked": parked, "beside": beside}, SEPARATION)
    assert not found.is_too_near


def test_one_that_has_taken_off_is_not_parked_when_it_comes_back() -> None:
    there_and_back = TimedFlight(
        ((0.0, 0.0, 0.0), (0.0, 0.0, 6.0), (30.0, 0.0, 6.0), (0.0, 0.0, 0.0)),
        (0.0, 5.0, 20.0, 40.0),
        parked=True,
    )
    late = leg((3.0, 50.0, 0.0), (3.0, 0.0, 0.0), 20.0, 40.0)
    (found,) = meetings({"a": there_and_back, "b": late}, SEPARATION)
    assert found.is_too_near
    assert found.required_m == (5.0, 3.0)


def test_the_worst_pair_comes_first() -> None:
    flights = {
        "a": leg((0.0, 0.0, 5.0), (10.0, 0.0, 5.0), 0.0, 10.0),
        "b": leg((0.0, 50.0, 5.0), (10.0, 50.0, 5.0), 0.0, 10.0),
        "c": leg((0.0, 53.0, 5.0), (10.0, 53.0, 5.0), 0.0, 10.0),
    }
    first, *rest = meetings(flights, SEPARATION)
    assert first.vehicles == ("b", "c")
    assert first.is_too_near
    assert not any(meeting.is_too_near for meeting in rest)
