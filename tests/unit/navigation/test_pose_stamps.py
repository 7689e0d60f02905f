"""Stamps of what is published: when the vehicle measured it, however late the thread runs."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from rclpy.time import Time

from drone_navigation.server.publishing.topics import Topics
from mavlink_vehicle.io.clock import ManualClock
from mavlink_vehicle.io.endpoints import LinkStatistics
from navigation_bridge.names import SERVER_NODE_NAME
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.vehicle_clocks import CLOCKS, OtherClock

_BEGAN_S = 1_700_000_000


class KeptTopic:
    """A publisher that keeps what is published, with one subscriber at first."""

    def __init__(self) -> None:
        """Begin empty."""
        self.messages: list[Any] = []
        self.publish = self.messages.append
        self.readers = 1

    def get_subscription_count(self) -> int:
        """Return how many listen."""
        return self.readers


class Node:
    """A node whose clock goes with the driver's."""

    def __init__(self, clock: ManualClock) -> None:
        """Begin without publishers."""
        self.topics: dict[str, KeptTopic] = {}
        self._clock = clock

    def create_publisher(self, _kind: Any, topic: str, _qos: Any) -> KeptTopic:
        return self.topics.setdefault(topic, KeptTopic())

    def get_fully_qualified_name(self) -> str:
        return f"/{SERVER_NODE_NAME}"

    def get_clock(self) -> Node:
        return self

    def now(self) -> Time:
        return Time(nanoseconds=_BEGAN_S * 10**9 + round(self._clock.now() * 1e9))


def test_a_thread_that_is_late_does_not_put_stamps_out_of_order() -> None:
    flight = SimulatedFlight().ready()
    clock = ManualClock()
    node = Node(clock)
    topics = Topics(node, flight.bridge, LinkStatistics, clock=clock)
    measured_s = []
    for step in range(60):
        late_s = (0.4, 0.0, 0.15)[step % 3]
        clock.advance_to(flight.now + late_s)
        before = len(node.topics["~/pose"].messages)
        topics.update(flight.now)
        flight.run_for(late_s + 0.05)
        if len(node.topics["~/pose"].messages) > before:
            measured_s.append(flight.now - late_s - 0.05)
    stamps = [message.header.stamp for message in node.topics["~/pose"].messages]
    stamps_s = [stamp.sec - _BEGAN_S + stamp.nanosec * 1e-9 for stamp in stamps]
    assert len(stamps_s) > 5
    assert all(earlier < later for earlier, later in pairwise(stamps_s))
    assert stamps_s == pytest.approx(measured_s, abs=0.1)


def test_a_clock_that_begins_at_0_gives_stamps_and_no_error() -> None:
    flight = SimulatedFlight().ready()
    clock = ManualClock()
    node = Node(clock)
    node.now = lambda: Time(nanoseconds=0)  # type: ignore[method-assign]
    topics = Topics(node, flight.bridge, LinkStatistics, clock=clock)
    for _ in range(20):
        clock.advance_to(flight.now + 0.2)
        topics.update(flight.now)
        flight.run_for(0.1)
    stamps = [message.header.stamp for message in node.topics["~/pose"].messages]
    assert len(stamps) > 5
    assert all(stamp.sec == stamp.nanosec == 0 for stamp in stamps)


@pytest.mark.parametrize("name", ["slow", "standing", "quick", "of 0", "set"])
def test_stamps_do_not_hang_on_how_the_clock_of_the_vehicle_runs(name: str) -> None:
    # One that is set back is believed after a second.
    tolerance_s = 1.3 if name == "set" else 0.5
    flight = SimulatedFlight()
    flight.codec = OtherClock(flight, CLOCKS[name])
    flight.ready().run_for(10.0)
    clock = ManualClock()
    node = Node(clock)
    topics = Topics(node, flight.bridge, LinkStatistics, clock=clock)
    for _ in range(200):
        clock.advance_to(flight.now)
        poses = node.topics["~/pose"].messages
        before = len(poses)
        topics.update(flight.now)
        for message in poses[before:]:
            stamp = message.header.stamp
            assert abs(stamp.sec - _BEGAN_S + stamp.nanosec * 1e-9 - flight.now) < tolerance_s
        flight.run_for(0.05)
    assert len(node.topics["~/pose"].messages) > 20


def test_streams_are_made_while_somebody_listens_only() -> None:
    flight = SimulatedFlight().ready()
    clock = ManualClock()
    node = Node(clock)
    topics = Topics(node, flight.bridge, LinkStatistics, clock=clock)
    # Latched, and so kept for who listens later, are other topics.
    streams = [node.topics[name] for name in ("/diagnostics", "/tf", "~/pose", "~/fix")]
    counts = []
    for readers in (1, 0, 1):
        for stream in streams:
            stream.readers = readers
            stream.messages.clear()
        for _ in range(30):
            flight.run_for(0.1)
            clock.advance_to(flight.now)
            topics.update(flight.now)
        counts.append([bool(stream.messages) for stream in streams])
    assert counts == [[True] * 4, [False] * 4, [True] * 4]
