"""The round trip, measured by our own requests only."""

from __future__ import annotations

from typing import Any

from mavlink_vehicle.codec import make
from mavlink_vehicle.protocols.monitoring.timesync import Timesync
from mavlink_vehicle.protocols.operations.command import Address

ADDRESS = Address(1, 191, 1, 1)


def _asked(timesync: Timesync, now: float) -> int:
    timesync.handle_timer(now)
    (message,) = timesync.messages_to_send()
    assert message.tc1 == 0
    return int(message.ts1)


def _timesync(**fields: int) -> Any:
    return make("TIMESYNC", **fields)


def test_the_smallest_round_trip_counts() -> None:
    timesync = Timesync(2.0)
    timesync.resume(ADDRESS, 10.0)
    timesync.receive(_timesync(tc1=5, ts1=_asked(timesync, 10.0)), 10.03)
    timesync.receive(_timesync(tc1=5, ts1=_asked(timesync, 12.0)), 12.01)
    timesync.receive(_timesync(tc1=5, ts1=_asked(timesync, 14.0)), 14.5)
    assert timesync.round_trip_s is not None
    assert abs(timesync.round_trip_s - 0.01) < 1e-9


def test_what_is_not_an_answer_to_us_is_left_alone() -> None:
    timesync = Timesync(2.0)
    timesync.resume(ADDRESS, 10.0)
    ts1 = _asked(timesync, 10.0)
    timesync.receive(_timesync(tc1=0, ts1=ts1), 10.1)  # a question of the autopilot's
    timesync.receive(_timesync(tc1=7, ts1=ts1 + 1), 10.1)  # an answer to somebody else
    assert timesync.round_trip_s is None
    timesync.receive(_timesync(tc1=7, ts1=ts1), 10.2)
    timesync.receive(_timesync(tc1=7, ts1=ts1), 10.9)  # the same again
    assert timesync.round_trip_s is not None


def test_it_asks_at_its_interval_and_stops_when_the_vehicle_is_gone() -> None:
    timesync = Timesync(2.0)
    assert timesync.deadline_s is None
    timesync.resume(ADDRESS, 0.0)
    for expected_s in (0.0, 2.0, 4.0):
        assert timesync.deadline_s == expected_s
        timesync.handle_timer(expected_s)
    timesync.pause()
    assert timesync.deadline_s is None


def test_an_interval_of_zero_never_asks() -> None:
    timesync = Timesync(0.0)
    timesync.resume(ADDRESS, 0.0)
    assert timesync.deadline_s is None


def test_two_stations_that_ask_in_the_same_instant_do_not_take_each_others_answers() -> None:
    """The same program may run twice on one machine, by the same clock."""
    ours, theirs = Timesync(2.0), Timesync(2.0)
    for stranger in (Address(1, 190, 1, 1), Address(255, 191, 1, 1)):
        ours.resume(ADDRESS, 10.0)
        theirs.resume(stranger, 10.0)
        own = _asked(ours, 10.0)
        ours.receive(_timesync(tc1=7, ts1=_asked(theirs, 10.0)), 10.1)
        assert ours.round_trip_s is None
        ours.receive(_timesync(tc1=7, ts1=own), 10.1)
        assert ours.round_trip_s is not None
